//! The wall clock, beside the clock of an end.

use std::time::{SystemTime, UNIX_EPOCH};

use crate::io::clock::Clock;
use crate::record::messages::Stamp;
use crate::time::Time;

/// The wall clock at a moment of an end's clock: both ends of a record lie on one axis.
#[derive(Clone, Copy, Debug)]
pub struct Wall {
    pub(super) stamp: Stamp,
    pub(super) at: Time,
}

impl Wall {
    /// Now.
    pub fn now(clock: Clock) -> Self {
        let since = SystemTime::now().duration_since(UNIX_EPOCH);
        let nanos = since.map_or(0, |since| since.as_nanos());
        Self {
            stamp: Stamp(u64::try_from(nanos).unwrap_or(0)),
            at: clock.now(),
        }
    }

    /// This moment of the wall clock and of the end's.
    pub fn of(stamp: Stamp, at: Time) -> Self {
        Self { stamp, at }
    }

    /// A moment of the end's clock on the wall clock.
    pub fn stamp(&self, at: Time) -> Stamp {
        let since = at.signed_since(self.at);
        Stamp(self.stamp.0.saturating_add_signed(since))
    }
}
