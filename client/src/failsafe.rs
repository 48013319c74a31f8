//! What the master does about a silent link: one pure function decides, the most severe action wins.
//!
//! Without *updates* a link is normal under a deadband; what is watched here is the link itself, which carries in each
//! direction at least a heartbeat every 50 ms, and with it an answer to what was sent. The frozen local model is passive, so
//! that it is rendered on; only when the link must be taken for dead is the hand released.

use std::time::Duration;

use mmt_shared::channel::datagram_channel::HEARTBEAT;
use serde::{Deserialize, Serialize};

/// Two heartbeats missed and some jitter: shown, nothing else.
pub const LATE: Duration = Duration::from_millis(120);
/// Five heartbeats missed: the model may be out of date.
pub const STALE: Duration = Duration::from_millis(250);
/// Twenty heartbeats missed: the slave has to be taken for gone.
pub const RELEASE: Duration = Duration::from_secs(1);

/// An update answers a sample of longer ago than the path by no more than this: half a second for play-out, waiting and repeats,
/// and [`STALE`]. What is older is about a hand that has long been elsewhere.
pub const ANSWER_MAX: Duration = Duration::from_millis(500 + STALE.as_millis() as u64);

const _: () = assert!(
    HEARTBEAT.as_millis() * 2 < LATE.as_millis()
        && LATE.as_millis() < STALE.as_millis()
        && STALE.as_millis() < RELEASE.as_millis()
);

/// State of the link as the master sees it, in the order of severity.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LinkState {
    /// Something came within [`LATE`].
    #[default]
    Fresh,
    /// Nothing for [`LATE`]: flagged.
    Late,
    /// Nothing for [`STALE`]: the model is rendered as it is.
    Stale,
    /// Nothing for [`RELEASE`]: the force ramps to zero and stays there; a new session is needed.
    Released,
}

impl LinkState {
    /// The state for the time since something last came from the slave.
    pub fn of_silence(silence: Duration) -> Self {
        if silence >= RELEASE {
            Self::Released
        } else if silence >= STALE {
            Self::Stale
        } else if silence >= LATE {
            Self::Late
        } else {
            Self::Fresh
        }
    }

    /// The name shown on screens.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fresh => "fresh",
            Self::Late => "late",
            Self::Stale => "stale",
            Self::Released => "released",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_state_begins_exactly_at_its_threshold() {
        let just = Duration::from_nanos(1);
        let pairs = [
            (LATE, LinkState::Fresh, LinkState::Late),
            (STALE, LinkState::Late, LinkState::Stale),
            (RELEASE, LinkState::Stale, LinkState::Released),
        ];
        for (threshold, before, at) in pairs {
            assert_eq!(LinkState::of_silence(threshold - just), before);
            assert_eq!(LinkState::of_silence(threshold), at);
        }
    }
}
