//! The limits on the played HIP: after an outage the hand is elsewhere, and the tool must not jump there; and wherever
//! the hand is, the tool stays within its reach.

use std::time::Duration;

use mmt_shared::model::geometry::Vec2;
use mmt_shared::time::{TICK, Time};

use super::config::PlayoutConfig;
use crate::motion_limits::{BEHIND_M, Goal, MotionLimits};

/// A tick is at most this long to the limits: a slave that was stopped for a second must not jump.
const TICK_MAX: Duration = Duration::from_millis(10);

/// One tick of the played HIP.
pub(super) struct Step {
    /// m.
    pub(super) hip: Vec2,
    /// Over this tick, m/s.
    pub(super) velocity: Vec2,
    /// Whether the limits keep the HIP behind.
    pub(super) limited: bool,
    /// The greatest speed in this tick, m/s.
    pub(super) speed_max_m_per_s: f64,
}

/// Follows the HIP that is aimed at: no faster and with no greater acceleration than the limits, and no farther than the reach.
#[derive(Clone, Copy, Debug)]
pub(super) struct MotionLimiter {
    limits: MotionLimits,
    reach_m: f64,
    /// Where the HIP is, m; none before it is known.
    hip: Option<Vec2>,
    /// Over the last tick, m/s; none of a HIP whose place nobody set, before its second tick: it goes as what is aimed at.
    velocity: Option<Vec2>,
    /// What was aimed at in the last tick, m; none if nothing was.
    aim: Option<Vec2>,
    /// When it was played; none before the first tick.
    played: Option<Time>,
}

impl MotionLimiter {
    pub(super) fn new(config: &PlayoutConfig) -> Self {
        Self {
            limits: config.limits(),
            reach_m: config.reach_m,
            hip: None,
            velocity: None,
            aim: None,
            played: None,
        }
    }

    /// Sets where the tool is before the first tick, m.
    pub(super) fn start_at(&mut self, hip: Vec2) {
        if self.played.is_none() {
            (self.hip, self.velocity) = (Some(hip), Some(Vec2::zeros()));
        }
    }

    /// The tool is there (m), at rest.
    pub(super) fn move_to(&mut self, place: Vec2) {
        (self.hip, self.velocity, self.aim) = (Some(place), Some(Vec2::zeros()), None);
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
        aim.cap_magnitude(self.reach_m)
    }

    /// One tick of length `elapsed` towards `aim` (m), or to a stop where there is none. Once samples have run out a HIP that
    /// is still behind becomes slower as well, for `slowing` by now: it does not go on to a place of long ago.
    pub(super) fn step(
        &mut self,
        now: Time,
        elapsed: Duration,
        aim: Option<Vec2>,
        slowing: Duration,
    ) -> Step {
        let period = elapsed.as_secs_f64();
        let (from, aimed) = match (self.hip, aim) {
            (Some(from), aim) => (from, aim),
            (None, Some(aim)) => (self.within_reach(aim), Some(aim)),
            (None, None) => (Vec2::zeros(), None),
        };
        let aim = self.within_reach(aimed.unwrap_or(from));
        let limits = self.slowed(slowing.saturating_sub(elapsed));
        let way = match aimed {
            _ if period <= 0.0 => Vec2::zeros(),
            None => {
                let before = self.velocity.unwrap_or_default();
                self.limits.towards(before, Vec2::zeros(), period) * period
            }
            Some(_) => self.way(limits, from, aim, period),
        };
        let (hip, way) = self.place_after(from, aim, way);
        let velocity = if period > 0.0 {
            way / period
        } else {
            Vec2::zeros()
        };
        self.velocity = self.hip.map(|_| velocity);
        (self.hip, self.aim, self.played) = (Some(hip), aimed.map(|_| aim), Some(now));
        Step {
            hip,
            velocity,
            limited: (aimed.unwrap_or(aim) - hip).norm() > BEHIND_M,
            speed_max_m_per_s: limits.speed_m_per_s,
        }
    }

    /// Where the tool is after a way towards `aim`, and the way that it has gone: one that brakes beside the end of its reach
    /// slides along it, and goes on from what it does.
    fn place_after(&self, from: Vec2, aim: Vec2, way: Vec2) -> (Vec2, Vec2) {
        if way == aim - from {
            return (aim, way);
        }
        let (reach, free) = (self.reach_m.max(from.norm()), from + way);
        let hip = free.cap_magnitude(reach);
        let way = if hip == free { way } else { hip - from };
        (hip, way)
    }

    /// The limits after a tool has had to become slower for so long.
    fn slowed(&self, slowing: Duration) -> MotionLimits {
        let slower = slowing.as_secs_f64() * self.limits.acceleration_m_per_s2;
        MotionLimits {
            speed_m_per_s: (self.limits.speed_m_per_s - slower).max(0.0),
            ..self.limits
        }
    }

    /// The way from a place towards `aim` in a tick of `period` (s), m.
    fn way(&self, limits: MotionLimits, from: Vec2, aim: Vec2, period: f64) -> Vec2 {
        let goal = Goal {
            way: aim - from,
            velocity: (aim - self.aim.unwrap_or(aim)) / period,
        };
        let before = self.velocity.unwrap_or(goal.velocity);
        let way = limits.way(before, goal, period);
        // before the end of its reach it brakes
        let far = from.norm();
        let outwards = if far > 0.0 { from / far } else { Vec2::zeros() };
        let most = limits.braking_speed((self.reach_m - far).max(0.0), period) * period;
        let beyond = outwards.dot(&way) - most;
        if beyond <= 0.0 {
            return way;
        }
        let velocity = (way - outwards * beyond) / period;
        limits.towards(before, velocity, period) * period
    }
}
