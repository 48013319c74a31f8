//! The mass that a hand would take the object for, from what the hand does and feels.
//!
//! While the hand pushes the sliding object, `f·d = m a·d + b |v| + c` with d the direction of its motion: the same law
//! (1) that the slave estimates by, but between the hand's own motion and the hand's own force. Force, velocity and
//! acceleration pass the same filter, so that none is late against the others. The same regression of the tool's motion
//! and force gives what there is to be felt: a box that turns under a push is not a point mass for either of them.

use std::collections::VecDeque;

use mmt_shared::model::geometry::Vec2;
use mmt_shared::time::{TICK_S, Time};
use nalgebra::{Matrix3, Vector3};

/// Corner of each of the three filter stages, rad/s: above the hand's own motion (3 Hz), below its tremor (9 Hz).
const CORNER_RAD_PER_S: f64 = 40.0;
/// Slower than this the object may stick, m/s: three times its stopping way of 10 ms.
const SPEED_MIN_M_PER_S: f64 = 0.03;
/// Ticks of pushing before a sample counts: five time constants of the filter's three stages, and the touch is over.
const SETTLING_TICKS: u32 = 150;
/// Fewer samples than this show nothing: a second.
const SAMPLES_MIN: u64 = 1000;

/// A tool that feels less than this, kg, does not push the box but bounces on it: nothing to compare with.
const MASS_MIN_KG: f64 = 0.2;

/// Three first-order stages.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Filter([Vec2; 3]);

impl Filter {
    fn step(&mut self, input: Vec2) -> Vec2 {
        self.0.iter_mut().fold(input, |input, stage| {
            *stage += (input - *stage) * (CORNER_RAD_PER_S * TICK_S);
            *stage
        })
    }
}

/// Least squares of the felt m, b and c over a run. Fixed size, no allocation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FeltMass {
    last_hip: Option<Vec2>,
    last_velocity: Vec2,
    velocity: Filter,
    force: Filter,
    pushing_ticks: u32,
    samples: u64,
    normal: Matrix3<f64>,
    right: Vector3<f64>,
}

impl FeltMass {
    /// Takes one tick: the HIP (m), the force that the device displays, on the object (N), and whether the hand pushes.
    pub fn push(&mut self, hip: Vec2, force: Vec2, pushes: bool) {
        let moved = (hip - self.last_hip.unwrap_or(hip)) / TICK_S;
        self.last_hip = Some(hip);
        let v = self.velocity.step(moved);
        let f = self.force.step(force);
        let a = (v - self.last_velocity) / TICK_S;
        self.last_velocity = v;
        let speed = v.norm();
        self.pushing_ticks = if pushes && speed > SPEED_MIN_M_PER_S {
            self.pushing_ticks.saturating_add(1)
        } else {
            0
        };
        if self.pushing_ticks > SETTLING_TICKS {
            let direction = v / speed;
            // (1) along the motion
            let row = Vector3::new(a.dot(&direction), speed, 1.0);
            self.normal += row * row.transpose();
            self.right += row * f.dot(&direction);
            self.samples += 1;
        }
    }

    /// The felt mass, kg: negative if the force leads the motion. Absent where the hand hardly pushed.
    #[must_use]
    pub fn kg(&self) -> Option<f64> {
        if self.samples < SAMPLES_MIN {
            return None;
        }
        let solved = self.normal.cholesky()?.solve(&self.right);
        Some(solved.x).filter(|m| m.is_finite())
    }
}

/// What the hand felt and what there was to be felt, over the same HIP samples.
#[derive(Clone, Debug, Default)]
pub struct FeltMasses {
    hand: FeltMass,
    tool: FeltMass,
    /// Whether the hand pushed, by the stamps of the samples that the tool has not followed yet.
    pushing: VecDeque<(Time, bool)>,
}

impl FeltMasses {
    /// Takes a tick of the hand: stamp, HIP (m), displayed force on the object (N), whether it pushes the object.
    pub fn push_hand(&mut self, stamp: Time, hip: Vec2, force: Vec2, pushes: bool) {
        self.hand.push(hip, force, pushes);
        self.pushing.push_back((stamp, pushes));
    }

    /// Takes a tick of the tool: stamp of the sample that it follows, position (m), contact force (N).
    pub fn push_tool(&mut self, stamp: Time, tool: Vec2, force: Vec2, in_contact: bool) {
        while self.pushing.get(1).is_some_and(|(next, _)| *next <= stamp) {
            self.pushing.pop_front();
        }
        let pushed = self.pushing.front().is_some_and(|(_, pushes)| *pushes);
        self.tool.push(tool, force, pushed && in_contact);
    }

    /// The hand's mass over the tool's; absent where one of them is, or where the tool's is less than 0.2 kg.
    #[must_use]
    pub fn ratio(&self) -> Option<f64> {
        let there_is = self.tool.kg().filter(|m| *m >= MASS_MIN_KG)?;
        Some(self.hand.kg()? / there_is)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mmt_shared::time::TICK;

    /// The felt mass of a hand that pushes at a modulated speed along a slanted line, its force delayed.
    fn felt(m: f64, b: f64, c: f64, delay_ticks: i32) -> f64 {
        let direction = Vec2::new(0.8, 0.6);
        let speed = |t: f64| 0.15 + 0.03 * libm::sin(5.0 * t) + 0.015 * libm::sin(13.0 * t);
        let (mut felt, mut x) = (FeltMass::default(), 0.0);
        for n in 0..20_000 {
            let t = f64::from(n) * TICK_S;
            x += speed(t) * TICK_S;
            let then = t - f64::from(delay_ticks) * TICK_S;
            let a = (speed(then) - speed(then - TICK_S)) / TICK_S;
            let f = m * a + b * speed(then) + c;
            // across the motion nothing counts
            let across = Vec2::new(-0.6, 0.8) * 2.0;
            felt.push(direction * x, direction * f + across, n > 100);
        }
        felt.kg().unwrap()
    }

    #[test]
    fn the_mass_of_a_hand_made_push_is_found_whatever_damping_and_friction() {
        for m in [0.0, 0.7, 1.4] {
            for (b, c) in [(0.0, 0.0), (3.0, 2.06)] {
                assert!((felt(m, b, c, 0) - m).abs() < 1e-3, "{}", felt(m, b, c, 0));
            }
        }
    }

    #[test]
    fn a_delay_takes_damping_times_delay_off_the_mass() {
        // b v(t − D) = b v(t) − b D a(t) for slow motion
        let late = felt(0.7, 3.0, 2.06, 20);
        assert!((late - (0.7 - 3.0 * 0.02)).abs() < 0.02, "{late}");
    }

    #[test]
    fn a_hand_that_did_not_push_long_enough_felt_no_mass() {
        let mut felt = FeltMass::default();
        for n in 0..1100 {
            felt.push(Vec2::new(1e-4 * f64::from(n), 0.0), Vec2::zeros(), true);
        }
        assert_eq!(felt.kg(), None);
    }

    #[test]
    fn a_hand_that_feels_twice_what_the_tool_meets_a_while_later_has_a_ratio_of_two() {
        let mut masses = FeltMasses::default();
        let (start, m) = (Time::from_millis(1000), 0.7);
        let speed = |n: i32| 0.15 + 0.03 * libm::sin(f64::from(n) * 5e-3);
        let x = |n: i32| 0.15e-3 * f64::from(n) - 0.006 * libm::cos(f64::from(n) * 5e-3);
        for n in 0..5000 {
            let at = |n: i32| Vec2::new(x(n), 0.0);
            let force = |n: i32| Vec2::new(m * (speed(n) - speed(n - 1)) / TICK_S + 2.0, 0.0);
            let stamp = start + TICK * u32::try_from(n).unwrap();
            masses.push_hand(stamp, at(n), force(n) * 2.0, n > 100);
            if n >= 30 {
                masses.push_tool(
                    stamp.offset_by(-30_000_000),
                    at(n - 30),
                    force(n - 30),
                    true,
                );
            }
        }
        assert!(
            (masses.ratio().unwrap() - 2.0).abs() < 0.02,
            "{:?}",
            masses.ratio()
        );
        assert!(masses.pushing.len() <= 31);
    }
}
