//! The sender's clock as seen from here: the least (arrival − stamp) of the last ten seconds.
//!
//! Two clocks that run apart by 200 ppm differ by 2 ms after ten seconds, so the minimum is over a sliding
//! window, and the offset in use follows it slowly. It must never make the played stamps jump, but forward after a
//! queue of a quarter of a second has gone.

use std::time::Duration;

use mmt_shared::stats::recent::Recent;
use mmt_shared::time::{Time, duration_nanos};

/// The window, seconds.
const WINDOW_S: usize = 10;
/// The offset in use stays while the measured one is within this, ns: half a tick. Stamps then advance by
/// exactly one tick per tick nearly always, even while the clocks drift apart.
const BAND_NS: u64 = 500_000;
/// Once it moves, it moves by at most 1/100 of the time that passes: played motion is 1 % too quick or slow.
const SLEW_DIVISOR: u64 = 100;
/// A path that has become quicker by more than this, ns, is followed at once: the samples of a quarter of a second
/// wait already, and at that pace half a minute would pass before they are played.
const QUICKER_NS: i64 = 250_000_000;

/// Offset of the receiver's clock to the sender's, the quickest transit included.
#[derive(Clone, Debug)]
pub(super) struct SenderClock {
    /// The least (arrival − stamp) of each of the last seconds, ns.
    minima: Recent<Option<i64>, WINDOW_S>,
    /// The offset in use, ns; none before the first sample.
    offset: Option<i64>,
    moving: bool,
}

impl SenderClock {
    /// Before the first sample.
    pub(super) fn new() -> Self {
        Self {
            minima: Recent::new(None),
            offset: None,
            moving: false,
        }
    }

    /// How far a stamp lies in the future of the quickest sample known; zero before the first.
    pub(super) fn ahead(&self, arrived: Time, stamp: Time) -> Duration {
        let earliest = match self.least() {
            Some(least) => arrived.offset_by(least.saturating_neg()),
            None => stamp,
        };
        stamp.saturating_since(earliest)
    }

    /// Learns from one sample.
    pub(super) fn observe(&mut self, arrived: Time, stamp: Time) {
        let seen = arrived.signed_since(stamp);
        if let Some(slice) = self.minima.at(arrived) {
            *slice = Some(slice.map_or(seen, |least| least.min(seen)));
        }
        self.offset.get_or_insert(seen);
    }

    /// Lets `elapsed` pass. Before play-out has started the offset follows at once.
    pub(super) fn advance(&mut self, now: Time, elapsed: Duration, playing: bool) {
        self.minima.advance(now);
        let (Some(target), Some(offset)) = (self.least(), self.offset) else {
            return;
        };
        let off = target.saturating_sub(offset);
        self.moving = off != 0 && (self.moving || off.unsigned_abs() > BAND_NS);
        let step = i64::try_from(duration_nanos(elapsed) / SLEW_DIVISOR).unwrap_or(i64::MAX);
        self.offset = Some(match (playing, self.moving) {
            _ if off < -QUICKER_NS => target,
            (false, _) => target,
            (true, true) => offset.saturating_add(off.clamp(-step, step)),
            (true, false) => offset,
        });
    }

    /// The stamp whose quickest sample arrives at `now`; none before the first sample.
    pub(super) fn stamp_at(&self, now: Time) -> Option<Time> {
        self.offset
            .map(|offset| now.offset_by(offset.saturating_neg()))
    }

    fn least(&self) -> Option<i64> {
        self.minima.iter().flatten().min().copied()
    }
}
