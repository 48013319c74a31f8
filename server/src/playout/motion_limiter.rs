//! The limits on the played HIP: after an outage the hand is elsewhere, and the tool must not jump there; and wherever
//! the hand is, the tool stays within its reach.

use std::time::Duration;

use mmt_shared::model::geometry::Vec2;
use mmt_shared::time::{TICK, Time};

use super::config::PlayoutConfig;

/// A tick is at most this long to the speed limit: a slave that was stopped for a second must not jump.
const TICK_MAX: Duration = Duration::from_millis(10);

/// One tick of the played HIP.
pub(super) struct Step {
    /// m.
    pub(super) hip: Vec2,
    /// Over this tick, m/s.
    pub(super) velocity: Vec2,
    /// Whether a limit holds the HIP back.
    pub(super) limited: bool,
}

/// Follows the HIP that is aimed at, no faster than the limit and no farther than the reach.
#[derive(Clone, Copy, Debug)]
pub(super) struct SpeedLimiter {
    speed_max_m_per_s: f64,
    deceleration_m_per_s2: f64,
    reach_m: f64,
    /// Where the HIP is, m; none before it is known.
    hip: Option<Vec2>,
    /// When it was played; none before the first tick.
    played: Option<Time>,
}

impl SpeedLimiter {
    pub(super) fn new(config: &PlayoutConfig) -> Self {
        Self {
            speed_max_m_per_s: config.speed_max_m_per_s,
            deceleration_m_per_s2: config.deceleration_m_per_s2,
            reach_m: config.reach_m,
            hip: None,
            played: None,
        }
    }

    /// Sets where the tool is before the first tick, m.
    pub(super) fn start_at(&mut self, hip: Vec2) {
        if self.played.is_none() {
            self.hip = Some(hip);
        }
    }

    /// The tool is there, m.
    pub(super) fn move_to(&mut self, place: Vec2) {
        self.hip = Some(place);
    }

    /// The HIP that was played last, m; none before the first tick.
    pub(super) fn hip(&self) -> Option<Vec2> {
        self.hip.filter(|_| self.played.is_some())
    }

    /// Where the tool is, m; none before that is known.
    pub(super) fn place(&self) -> Option<Vec2> {
        self.hip
    }

    /// How long the tick that ends at `now` took, at most [`TICK_MAX`].
    pub(super) fn elapsed(&self, now: Time) -> Duration {
        self.played
            .map_or(TICK, |then| now.saturating_since(then).min(TICK_MAX))
    }

    /// The place within reach that is nearest to `aim`, m.
    pub(super) fn within_reach(&self, aim: Vec2) -> Vec2 {
        let far = aim.norm();
        if far > self.reach_m {
            aim * (self.reach_m / far)
        } else {
            aim
        }
    }

    /// One tick of length `elapsed` towards `aim`, m. Once samples have run out a HIP that is still behind becomes slower as
    /// well, for `slowing` by now: it does not go on to a place of long ago.
    pub(super) fn step(
        &mut self,
        now: Time,
        elapsed: Duration,
        aim: Vec2,
        slowing: Duration,
    ) -> Step {
        let period = elapsed.as_secs_f64();
        let slower = slowing.saturating_sub(elapsed).as_secs_f64() * self.deceleration_m_per_s2;
        let move_max = (self.speed_max_m_per_s - slower).max(0.0) * period;
        let within = self.within_reach(aim);
        let beyond = within != aim;
        let aim = within;
        let wanted = self.hip.map_or_else(Vec2::zeros, |from| aim - from);
        let distance = wanted.norm();
        // a hair of room, so that a motion at the limit is not held back by rounding
        let limited = distance > move_max * (1.0 + 1e-9);
        let (hip, moved) = match self.hip {
            Some(from) if limited => {
                let moved = wanted * (move_max / distance);
                (from + moved, moved)
            }
            _ => (aim, wanted),
        };
        let still = period <= 0.0 || self.played.is_some_and(|then| then >= now);
        (self.hip, self.played) = (Some(hip), Some(now));
        Step {
            hip,
            velocity: if still { Vec2::zeros() } else { moved / period },
            limited: limited || beyond,
        }
    }
}
