//! The plant of the estimators' tests: a box on the ground, pushed along a line through the coupling.
//!
//! Semi-implicit Euler with an exact stick test: f_n from tool and box before the step,
//! v_n = v_{n−1} + T (f_n − b v_n − c sign v_n)/m, p_n = p_{n−1} + T v_n.

pub(super) use mmt_shared::fixtures::COUPLING;
use mmt_shared::model::geometry::{Vec2, rotate};
use mmt_shared::rng::Substream;
use mmt_shared::time::TICK_S;
use std::f64::consts::TAU;

use crate::estimator::Measured;

pub(super) const TRUTH: [f64; 3] = [0.7, 3.0, 0.3 * 0.7 * 9.81];

/// How the tool moves: mean speed and two modulations, or a rest.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    pub(super) speed: f64,
    pub(super) slow: (f64, f64),
    pub(super) fast: (f64, f64),
    pub(super) phase: (f64, f64),
}

impl Motion {
    /// The scripted operator of `docs/model.md`.
    pub(super) fn of_operator(seed: u64, push: u64) -> Self {
        let mut random = Substream::new(seed, "operator", push);
        Self {
            speed: random.uniform_in(0.10, 0.22),
            slow: (0.30, random.uniform_in(0.4, 1.0)),
            fast: (0.12, random.uniform_in(1.5, 3.0)),
            phase: (random.uniform_in(0.0, TAU), random.uniform_in(0.0, TAU)),
        }
    }

    pub(super) fn steady(speed: f64) -> Self {
        Self {
            speed,
            slow: (0.0, 1.0),
            fast: (0.0, 1.0),
            phase: (0.0, 0.0),
        }
    }

    fn at(&self, t: f64) -> f64 {
        let slow = self.slow.0 * libm::sin(TAU * self.slow.1 * t + self.phase.0);
        let fast = self.fast.0 * libm::sin(TAU * self.fast.1 * t + self.phase.1);
        self.speed * (1.0 + slow + fast)
    }
}

/// Standard deviations of the sensors: position, m, and force, N.
#[derive(Clone, Copy, Debug)]
pub(super) struct Noise(pub(super) f64, pub(super) f64);

impl Noise {
    pub(super) const NONE: Self = Self(0.0, 0.0);
    pub(super) const DEFAULT: Self = Self(10e-6, 10e-3);
}

/// The box, the tool and the sensors.
pub(super) struct Plant {
    pub(super) params: [f64; 3],
    pub(super) heading: f64,
    noise: Noise,
    /// Noise of the force that the estimator expects, N.
    pub(super) expected_force_noise_n: f64,
    random: Substream,
    tool: f64,
    tool_speed: f64,
    /// Position and velocity of the box's face along the line.
    position: f64,
    pub(super) velocity: f64,
    clock: f64,
    /// Sideways drift of the smooth tool along the face, m/s.
    pub(super) slide: f64,
    side: f64,
}

impl Plant {
    pub(super) fn new(seed: u64, noise: Noise) -> Self {
        Self {
            params: TRUTH,
            heading: 0.4,
            noise,
            expected_force_noise_n: 0.0,
            random: Substream::new(seed, "plant", 0),
            tool: -0.001,
            tool_speed: 0.0,
            position: 0.0,
            velocity: 0.0,
            clock: 0.0,
            slide: 0.02,
            side: 0.0,
        }
    }

    /// One tick of pushing; the tool's speed follows the motion within 1.2 m/s².
    pub(super) fn push(&mut self, motion: &Motion) -> Measured {
        self.clock += TICK_S;
        let step = motion.at(self.clock) - self.tool_speed;
        self.tool_speed += step.clamp(-1.2 * TICK_S, 1.2 * TICK_S);
        self.tool += self.tool_speed * TICK_S;
        self.side += self.slide * TICK_S;
        let penetration = self.tool - self.position;
        let rate = self.tool_speed - self.velocity;
        let touching = penetration > 0.0;
        let force = if touching {
            COUPLING.force(penetration, rate)
        } else {
            0.0
        };
        self.advance(force);
        self.measure(force, touching)
    }

    /// The tool jumps 1 cm away from the face, or back to it, and stands still.
    pub(super) fn retract(&mut self) {
        self.tool = self.position - 0.010;
        self.tool_speed = 0.0;
    }

    fn advance(&mut self, force: f64) {
        let [m, b, c] = self.params;
        // implicit Coulomb: what friction cannot stop within the step goes on sliding
        let free = m * self.velocity + TICK_S * force;
        let left = free.abs() - TICK_S * c;
        self.velocity = if left > 0.0 {
            left.copysign(free) / (m + TICK_S * b)
        } else {
            0.0
        };
        self.position += TICK_S * self.velocity;
    }

    fn measure(&mut self, force: f64, touching: bool) -> Measured {
        let (px, py) = self.random.normal_pair();
        let (fx, fy) = self.random.normal_pair();
        let ahead = rotate(self.heading, Vec2::new(1.0, 0.0));
        let tool = rotate(self.heading, Vec2::new(self.tool, self.side));
        Measured {
            back: Vec2::zeros(),
            force_noise_n: self.expected_force_noise_n,
            held_back: false,
            tool: tool + Vec2::new(px, py) * self.noise.0,
            force: ahead * force + Vec2::new(fx, fy) * self.noise.1,
            normal: touching.then_some(ahead),
            seen: None,
        }
    }
}
