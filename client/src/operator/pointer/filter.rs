//! From where the pointer is wanted to a HIP that a hand could have: a critically damped second-order low-pass with a
//! greatest speed.
//!
//! ẍ = ω² (u − x) − 2 ω ẋ, |ẋ| ≤ v_max. It lags a steady motion by 2/ω and never overshoots, neither from the filter
//! nor from the limit.

use std::f64::consts::TAU;

use mmt_shared::model::geometry::Vec2;
use mmt_shared::time::TICK_S;

/// ω, rad/s: 12 Hz, above what a hand does on purpose (up to 5 Hz) and below the frames of a screen. It lags by 27 ms.
const OMEGA: f64 = TAU * 12.0;
/// v_max, m/s: below the 0.6 m/s that the slave's tool follows, above what a hand pushes with (0.1 to 0.3 m/s).
pub(super) const SPEED_MAX_M_PER_S: f64 = 0.55;

/// Where the HIP is, and how fast.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Filter {
    position: Vec2,
    velocity: Vec2,
}

impl Filter {
    /// At rest at a point, m.
    pub(super) fn at_rest(position: Vec2) -> Self {
        Self {
            position,
            velocity: Vec2::zeros(),
        }
    }

    /// One tick towards `target`, m; returns the HIP, m.
    pub(super) fn step(&mut self, target: Vec2) -> Vec2 {
        let acceleration =
            (target - self.position) * (OMEGA * OMEGA) - self.velocity * (2.0 * OMEGA);
        // semi-implicit Euler: velocity first
        self.velocity += acceleration * TICK_S;
        let speed = self.velocity.norm();
        if speed > SPEED_MAX_M_PER_S {
            self.velocity *= SPEED_MAX_M_PER_S / speed;
        }
        self.position += self.velocity * TICK_S;
        self.position
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_reached_without_overshoot_and_no_faster_than_the_limit() {
        for far in [0.01, 1.0] {
            let mut filter = Filter::at_rest(Vec2::zeros());
            let (mut last, mut fastest) = (0.0, 0.0_f64);
            for _ in 0..4000 {
                let x = filter.step(Vec2::new(far, 0.0)).x;
                assert!(x >= last && x <= far + 1e-12, "{x} after {last}");
                fastest = fastest.max((x - last) / TICK_S);
                last = x;
            }
            assert!((last - far).abs() < 1e-9);
            assert!(fastest <= SPEED_MAX_M_PER_S + 1e-9);
            assert_eq!(
                fastest > 0.54,
                far > 0.1,
                "the limit acts on the long way only"
            );
        }
    }

    #[test]
    fn a_steady_motion_is_followed_two_over_omega_behind() {
        let mut filter = Filter::at_rest(Vec2::zeros());
        let mut lag = 0.0;
        for tick in 0..3000 {
            let wanted = 0.2 * f64::from(tick) * TICK_S;
            lag = wanted - filter.step(Vec2::new(wanted, 0.0)).x;
        }
        let expected = 0.2 * 2.0 / OMEGA;
        assert!((lag - expected).abs() < 0.1 * expected, "{lag}");
    }

    #[test]
    fn at_rest_it_stays_to_the_bit() {
        let start = Vec2::new(0.3, -0.7);
        let mut filter = Filter::at_rest(start);
        assert!((0..100).all(|_| filter.step(start) == start));
    }
}
