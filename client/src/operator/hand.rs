//! The hand between what an operator wants and where the HIP is: a mass on a spring and a damper, with
//! tremor. Through it, force feedback moves the HIP. It must never return a point that is not finite.

use std::f64::consts::TAU;

use mmt_shared::model::geometry::Vec2;
use mmt_shared::rng::Substream;
use mmt_shared::time::TICK_S;
use serde::{Deserialize, Serialize};

/// The impedance of a hand and its tremor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HandConfig {
    /// Moving mass, kg. Default 0.5; arms measure near 0.55.
    pub mass_kg: f64,
    /// Stiffness towards the wanted point, N/m. Default 400, a firm grip; relaxed arms measure near 135.
    pub stiffness_n_per_m: f64,
    /// Damping towards the wanted velocity, N s/m. Default 25: 0.9 of critical.
    pub damping_ns_per_m: f64,
    /// Frequency of the physiological tremor, Hz. Default 9.
    pub tremor_hz: f64,
    /// Amplitude of the tremor of the wanted point on each axis, m. Default 0.1 mm.
    pub tremor_m: f64,
}

impl Default for HandConfig {
    fn default() -> Self {
        Self {
            mass_kg: 0.5,
            stiffness_n_per_m: 400.0,
            damping_ns_per_m: 25.0,
            tremor_hz: 9.0,
            tremor_m: 1e-4,
        }
    }
}

/// A hand that holds the HIP.
#[derive(Clone, Debug)]
pub struct Hand {
    config: HandConfig,
    position: Vec2,
    velocity: Vec2,
    /// Phase of the tremor on x and y, rad.
    tremor_phase: [f64; 2],
}

impl Hand {
    /// A hand at rest at `hip` (m, world frame). The tremor's phases are drawn from `seed`.
    pub fn new(config: HandConfig, seed: u64, hip: Vec2) -> Self {
        let mut stream = Substream::new(seed, "operator/tremor", 0);
        Self {
            config,
            position: hip,
            velocity: Vec2::zeros(),
            tremor_phase: [stream.uniform_in(0.0, TAU), stream.uniform_in(0.0, TAU)],
        }
    }

    /// Moves the hand by one tick T and returns the HIP, m.
    ///
    /// `wanted` (m) is where the operator wants it at the beginning of the tick, as the hand itself is
    /// then, and `wanted_velocity` (m/s) how fast during it; `force` (N) is the device's force on the
    /// hand, the reaction of the one on the object. A force that is not finite counts as none.
    pub fn step(&mut self, wanted: Vec2, wanted_velocity: Vec2, force: Vec2) -> Vec2 {
        let HandConfig {
            mass_kg,
            stiffness_n_per_m,
            damping_ns_per_m,
            ..
        } = self.config;
        let finite = force.x.is_finite() && force.y.is_finite();
        let force = if finite { force } else { Vec2::zeros() };
        let (tremor, tremor_velocity) = self.tremor();
        let pull = (wanted + tremor - self.position) * stiffness_n_per_m
            + (wanted_velocity + tremor_velocity - self.velocity) * damping_ns_per_m;
        // semi-implicit Euler: velocity first
        self.velocity += (pull + force) * (TICK_S / mass_kg);
        self.position += self.velocity * TICK_S;
        self.position
    }

    /// Where the HIP is, m.
    pub fn hip(&self) -> Vec2 {
        self.position
    }

    /// The spring's pull on the HIP, N, with the operator's wish at `wanted` (m).
    pub fn pull(&self, wanted: Vec2) -> Vec2 {
        (wanted - self.position) * self.config.stiffness_n_per_m
    }

    /// Offset (m) and velocity (m/s) of the tremor; moves its phase on by a tick.
    fn tremor(&mut self) -> (Vec2, Vec2) {
        let HandConfig {
            tremor_hz,
            tremor_m,
            ..
        } = self.config;
        let turn = TAU * tremor_hz;
        let (sin_x, cos_x) = libm::sincos(self.tremor_phase[0]);
        let (sin_y, cos_y) = libm::sincos(self.tremor_phase[1]);
        for phase in &mut self.tremor_phase {
            *phase = (*phase + turn * TICK_S) % TAU;
        }
        (
            Vec2::new(sin_x, sin_y) * tremor_m,
            Vec2::new(cos_x, cos_y) * (tremor_m * turn),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn still() -> HandConfig {
        HandConfig {
            tremor_m: 0.0,
            ..HandConfig::default()
        }
    }

    #[test]
    fn a_steady_force_displaces_the_hip_by_force_over_stiffness() {
        let mut hand = Hand::new(still(), 1, Vec2::new(0.1, 0.2));
        let wanted = Vec2::new(0.1, 0.2);
        let mut hip = wanted;
        for _ in 0..2000 {
            hip = hand.step(wanted, Vec2::zeros(), Vec2::new(-4.0, 2.0));
        }
        assert!((hip - (wanted + Vec2::new(-0.01, 0.005))).norm() < 1e-9);
        assert!((hand.pull(wanted) - Vec2::new(4.0, -2.0)).norm() < 1e-6);
    }

    #[test]
    fn a_hand_at_rest_that_wants_to_stay_stays_to_the_bit() {
        let start = Vec2::new(0.3, -0.7);
        let mut hand = Hand::new(still(), 1, start);
        for _ in 0..1000 {
            assert_eq!(hand.step(start, Vec2::zeros(), Vec2::zeros()), start);
        }
    }

    #[test]
    fn without_force_a_steady_motion_is_followed_without_lag_or_lead() {
        let velocity = Vec2::new(0.2, 0.0);
        let mut hand = Hand::new(still(), 1, Vec2::zeros());
        let mut lag = Vec2::new(1.0, 0.0);
        for tick in 0..3000 {
            let at = |tick: i32| velocity * (f64::from(tick) * TICK_S);
            lag = at(tick + 1) - hand.step(at(tick), velocity, Vec2::zeros());
        }
        assert!(lag.norm() < 1e-9, "{lag}");
    }

    #[test]
    fn tremor_moves_the_hip_at_its_frequency_by_about_its_amplitude() {
        let mut hand = Hand::new(HandConfig::default(), 1, Vec2::zeros());
        let xs: Vec<f64> = (0..4000)
            .map(|_| hand.step(Vec2::zeros(), Vec2::zeros(), Vec2::zeros()).x)
            .skip(1000)
            .collect();
        let crossings = xs.windows(2).filter(|w| w[0] < 0.0 && w[1] >= 0.0).count();
        assert!((26..=28).contains(&crossings), "{crossings} in 3 s");
        let largest = xs.iter().fold(0.0_f64, |a, x| a.max(x.abs()));
        assert!((0.5e-4..1.5e-4).contains(&largest), "{largest}");
    }

    #[test]
    fn a_force_that_is_not_finite_counts_as_none() {
        let (mut a, mut b) = (
            Hand::new(still(), 1, Vec2::zeros()),
            Hand::new(still(), 1, Vec2::zeros()),
        );
        let wanted = Vec2::new(0.01, 0.0);
        let hip = a.step(wanted, Vec2::zeros(), Vec2::new(f64::NAN, f64::INFINITY));
        assert_eq!(hip, b.step(wanted, Vec2::zeros(), Vec2::zeros()));
    }
}
