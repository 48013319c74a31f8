//! The limit on the acceleration of a tool that somebody else's plant moves.
//!
//! A tool that asks for no more than the limit is followed exactly; one that asks for more is caught up with, no faster than
//! the greatest speed and without overshoot.

use mmt_shared::model::geometry::Vec2;
use mmt_shared::time::TICK_S;

/// Where the tool is sent.
#[derive(Clone, Copy, Debug)]
pub(super) struct Follower {
    speed_max_m_per_s: f64,
    acceleration_max_m_per_s2: f64,
    /// Place (m) and velocity (m/s); none before it is placed.
    at: Option<(Vec2, Vec2)>,
}

impl Follower {
    pub(super) fn new(speed_max_m_per_s: f64, acceleration_max_m_per_s2: f64) -> Self {
        Self {
            speed_max_m_per_s,
            acceleration_max_m_per_s2,
            at: None,
        }
    }

    /// At rest at a place, m.
    pub(super) fn place(&mut self, tool: Vec2) {
        self.at = Some((tool, Vec2::zeros()));
    }

    /// One tick towards `tool` (m), which moves at `velocity` (m/s): place and velocity.
    pub(super) fn step(&mut self, tool: Vec2, velocity: Vec2) -> (Vec2, Vec2) {
        let (place, before) = self.at.unwrap_or((tool, velocity));
        // how far behind it is besides the way of this tick, and the speed from which it can still brake in that way
        let behind = tool - velocity * TICK_S - place;
        let catch_up = shortened(
            behind / TICK_S,
            (2.0 * self.acceleration_max_m_per_s2 * behind.norm()).sqrt(),
        );
        let wanted = shortened(velocity + catch_up, self.speed_max_m_per_s);
        let most = self.acceleration_max_m_per_s2 * TICK_S;
        let now = before + shortened(wanted - before, most);
        let place = place + now * TICK_S;
        self.at = Some((place, now));
        (place, now)
    }
}

/// `v`, made no longer than `most`.
fn shortened(v: Vec2, most: f64) -> Vec2 {
    let length = v.norm();
    if length > most {
        v * (most / length)
    } else {
        v
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPEED: f64 = 0.6;
    const ACCELERATION: f64 = 13.0;

    #[test]
    fn a_tool_that_keeps_the_limits_is_followed_exactly() {
        let mut follower = Follower::new(SPEED, ACCELERATION);
        follower.place(Vec2::zeros());
        let (mut place, mut speed) = (0.0, 0.0);
        for n in 0..400 {
            speed += if n < 40 { 10.0 * TICK_S } else { 0.0 };
            place += speed * TICK_S;
            let (at, _) = follower.step(Vec2::new(place, 0.0), Vec2::new(speed, 0.0));
            assert!((at.x - place).abs() < 1e-12, "{n}");
        }
    }

    #[test]
    fn a_jump_is_gone_after_within_both_limits_and_without_overshoot() {
        let mut follower = Follower::new(SPEED, ACCELERATION);
        follower.place(Vec2::zeros());
        let goal = Vec2::new(0.3, -0.1);
        let mut before = (Vec2::zeros(), Vec2::zeros());
        let mut nearest = f64::MAX;
        for _ in 0..2000 {
            let now = follower.step(goal, Vec2::zeros());
            assert!(now.1.norm() <= SPEED + 1e-12);
            assert!((now.1 - before.1).norm() <= ACCELERATION * TICK_S + 1e-12);
            assert!((now.0 - before.0 - now.1 * TICK_S).norm() < 1e-12);
            nearest = nearest.min((goal - now.0).dot(&goal));
            before = now;
        }
        assert!((before.0 - goal).norm() < 1e-6, "{}", before.0);
        assert!(nearest > -2e-3 * goal.norm(), "overshoot: {nearest}");
    }
}
