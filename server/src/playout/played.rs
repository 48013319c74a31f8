//! What play-out gives in a tick, and the counts of what happened to the samples.

use crate::tool::energy::HandSample;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::time::{TICK_S, Time};
use serde::{Deserialize, Serialize};

/// Where a played HIP comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// From samples: one, or two neighbours.
    Interpolated,
    /// Ahead of all samples, at constant velocity.
    Extrapolated,
    /// Samples ran out longer ago than is extrapolated: ramping to a stop, or stopped.
    Stopped,
}

/// What the slave's tool follows in one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Played {
    /// The point of the master's clock that is played, at most a second after the newest sample. Never decreases, unless
    /// the master's clock had to be learned anew and went back by more than a second.
    pub stamp: Time,
    /// HIP, world frame, m.
    pub hip: Vec2,
    /// Its velocity over the last tick, world frame, m/s.
    pub velocity: Vec2,
    /// `f_m` that the master rendered for this HIP, N; none where the HIP is not the master's: extrapolated,
    /// stopped or held back by the limits of the tool.
    pub force: Option<Vec2>,
    /// Where the master's hand is, whatever the limits of the tool are; none where no samples show it.
    pub hand: Option<HandSample>,
    /// Where it comes from.
    pub status: Status,
    /// How long the tick took, s: more than a tick's period after ticks that were missed.
    pub period_s: f64,
    /// The greatest speed of the tool in this tick, m/s: it falls while samples have run out.
    pub speed_max_m_per_s: f64,
    /// Whether the limits of the tool hold the HIP back.
    pub limited: bool,
    /// Whether the tool has to stand, or to stop: it is held, or there are no samples and the ramp to a stop is over.
    pub stands: bool,
}

impl Played {
    /// How many periods the tick took: 1, and as many more as ticks were missed before it.
    #[must_use]
    pub fn ticks(&self) -> u32 {
        (self.period_s / TICK_S).round().max(1.0) as u32
    }
}

/// What happened to samples that were not played, and how often play-out was not nominal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PlayoutCounts {
    /// Samples pushed.
    pub pushed: u64,
    /// Came after their time; the newest of them still guides the extrapolation.
    pub late: u64,
    /// Copies of a sample that was there.
    pub duplicate: u64,
    /// Oldest samples that made room, because the slave did not tick.
    pub overflow: u64,
    /// Stamps from more than a second in the future.
    pub implausible: u64,
    /// Times the sender's clock was learned anew.
    pub relearned: u64,
    /// Ticks played from samples.
    pub interpolated: u64,
    /// Ticks extrapolated.
    pub extrapolated: u64,
    /// Ticks stopping or stopped.
    pub stopped: u64,
    /// Ticks in which the limits of the tool held the HIP back.
    pub limited: u64,
}

impl PlayoutCounts {
    /// Counts a tick.
    pub(super) fn note(&mut self, played: &Played) {
        let counter = match played.status {
            Status::Interpolated => &mut self.interpolated,
            Status::Extrapolated => &mut self.extrapolated,
            Status::Stopped => &mut self.stopped,
        };
        *counter += 1;
        self.limited += u64::from(played.limited);
    }
}
