//! The greatest speed and acceleration of the tool in free space: where the hand jumps, the tool does not.
//!
//! A motion that keeps both limits is followed exactly. One that does not is caught up with, from a speed that the tool can
//! brake from in the way that is left.

use mmt_shared::model::geometry::Vec2;

/// A tool that is further than this from where it is to be is behind, m: 0.1 N at 1000 N/m.
pub(crate) const BEHIND_M: f64 = 1e-4;
/// Room for rounding, so that a motion at a limit is not held back.
const HAIR: f64 = 1.0 + 1e-9;

/// The greatest speed and acceleration of a tool.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MotionLimits {
    /// m/s.
    pub(crate) speed_m_per_s: f64,
    /// m/s².
    pub(crate) acceleration_m_per_s2: f64,
}

/// What a tool is to do in a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Goal {
    /// From the tool to the place where it is to be after the tick, m.
    pub(crate) way: Vec2,
    /// The velocity of that place, m/s.
    pub(crate) velocity: Vec2,
}

impl MotionLimits {
    /// The way (m) that a tool with velocity `before` (m/s) goes in a tick of `period_s` (s) towards its goal.
    pub(crate) fn way(&self, before: Vec2, goal: Goal, period_s: f64) -> Vec2 {
        // what is left besides the goal's own way in this tick
        let behind = goal.way - goal.velocity * period_s;
        let distance = behind.norm();
        let catch_up = if distance > 0.0 {
            behind * (self.braking_speed(distance, period_s) / distance)
        } else {
            Vec2::zeros()
        };
        let velocity = (goal.velocity + catch_up).cap_magnitude(self.speed_m_per_s * HAIR);
        let velocity = self.towards(before, velocity, period_s);
        let way = velocity * period_s;
        // to the bit, if it gets there
        if (way - goal.way).norm() <= (HAIR - 1.0) * self.speed_m_per_s * period_s {
            goal.way
        } else {
            way
        }
    }

    /// The velocity after a tick of `period_s` (s) in which the tool goes over from `before` to `wanted` (both m/s).
    pub(crate) fn towards(&self, before: Vec2, wanted: Vec2, period_s: f64) -> Vec2 {
        let most = self.acceleration_m_per_s2 * period_s * HAIR;
        before + (wanted - before).cap_magnitude(most)
    }

    /// The greatest speed (m/s) of a tick of `period_s` (s) after which the tool can still stop within `distance` (m) from where
    /// it was before: v T + v²/(2 a) = d.
    pub(crate) fn braking_speed(&self, distance: f64, period_s: f64) -> f64 {
        let a = self.acceleration_m_per_s2;
        let in_one_tick = a * period_s;
        if distance <= in_one_tick * period_s {
            return distance / period_s;
        }
        let speed = a * ((period_s * period_s + 2.0 * distance / a).sqrt() - period_s);
        speed.max(in_one_tick)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mmt_shared::time::TICK_S;

    const LIMITS: MotionLimits = MotionLimits {
        speed_m_per_s: 0.6,
        acceleration_m_per_s2: 13.0,
    };

    /// Places and velocities of a tool at rest at the origin that is to be at `places`, a tick each.
    fn follow(places: impl Iterator<Item = Vec2>) -> Vec<(Vec2, Vec2)> {
        let (mut at, mut velocity, mut last) = (Vec2::zeros(), Vec2::zeros(), Vec2::zeros());
        places
            .map(|place| {
                let goal = Goal {
                    way: place - at,
                    velocity: (place - last) / TICK_S,
                };
                let way = LIMITS.way(velocity, goal, TICK_S);
                (at, velocity, last) = (at + way, way / TICK_S, place);
                (at, velocity)
            })
            .collect()
    }

    /// Speed and acceleration of a motion keep the limits.
    fn keeps_the_limits(motion: &[(Vec2, Vec2)]) -> bool {
        let most = LIMITS.acceleration_m_per_s2 * TICK_S + 1e-9;
        let slow = |(_, velocity): &(Vec2, Vec2)| velocity.norm() <= LIMITS.speed_m_per_s + 1e-8;
        motion.iter().all(slow)
            && motion
                .windows(2)
                .all(|pair| (pair[1].1 - pair[0].1).norm() <= most)
    }

    #[test]
    fn a_motion_that_keeps_the_limits_is_followed_exactly() {
        let mut speed = 0.0;
        let mut x = 0.0;
        let places: Vec<_> = (0..400)
            .map(|n| {
                speed += if n < 40 { 12.9 * TICK_S } else { 0.0 };
                x += speed * TICK_S;
                Vec2::new(x, 0.0)
            })
            .collect();
        for (place, (at, _)) in places.iter().zip(follow(places.iter().copied())) {
            assert!((place - at).norm() <= 1e-15, "{place} {at}");
        }
    }

    #[test]
    fn a_jump_is_gone_after_within_both_limits_and_without_overshoot() {
        let goal = Vec2::new(0.3, -0.1);
        let motion = follow(std::iter::repeat_n(goal, 2000));
        assert!(keeps_the_limits(&motion));
        let far = goal.norm();
        // the jump itself is a velocity for a tick
        let most = motion.iter().map(|(at, _)| at.dot(&goal) / far);
        assert!(most.fold(0.0, f64::max) <= far * (1.0 + 1e-9));
        let (end, velocity) = motion.last().unwrap();
        assert_eq!((*end, *velocity), (goal, Vec2::zeros()));
        // as fast as the limits allow: half a second at 0.6 m/s and 46 ms to get there and to brake
        let arrived = motion.iter().position(|(at, _)| (at - goal).norm() < 1e-4);
        assert!(arrived < Some(585), "{arrived:?}");
    }

    #[test]
    fn a_place_that_moves_on_is_caught_up_with_and_one_that_shivers_keeps_the_tool_near() {
        let moving = |n: u32| Vec2::new(0.05 + 0.2 * f64::from(n) * TICK_S, 0.0);
        let motion = follow((1..1000).map(moving));
        assert!(keeps_the_limits(&motion));
        assert_eq!(motion.last().unwrap().0, moving(999));
        // a device that reads in steps of 55 µm
        let shivering = |n: u32| Vec2::new(55e-6 * f64::from(n / 2), 0.0);
        let motion = follow((1..1000).map(shivering));
        assert!(keeps_the_limits(&motion));
        for (n, (at, _)) in motion.iter().enumerate() {
            assert!(
                (at - shivering(n as u32 + 1)).norm() < BEHIND_M,
                "{n}: {at}"
            );
        }
    }

    #[test]
    fn from_the_braking_speed_a_tool_stops_in_the_way_that_is_left() {
        for distance in [1e-6, 13e-6, 14e-6, 1e-3, 0.2] {
            let (mut left, mut before) = (distance, LIMITS.braking_speed(distance, TICK_S));
            for _ in 0..1000 {
                let speed = LIMITS.braking_speed(left, TICK_S);
                assert!(before - speed <= LIMITS.acceleration_m_per_s2 * TICK_S * HAIR);
                left -= speed * TICK_S;
                before = speed;
            }
            assert!((-1e-15..1e-9).contains(&left), "{left} of {distance}");
        }
    }
}
