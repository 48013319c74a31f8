//! What is made of the measured force before anything judges it: noise is measured, a bias is tared and followed, a gain is found
//! where the stiffness of the contact is known.
//!
//! The default sensor's noise and a bias that nobody feels leave every force and every threshold as they are. Pure, of
//! the measured force and the tool alone; it must never see the true force.

mod bias;
mod gain;
mod noise;
mod onset;
mod withdrawal;

use std::collections::VecDeque;

use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::model::settings::Mode;
use mmt_shared::range::{OutOfRange, in_range};
use serde::{Deserialize, Serialize};

use crate::sensing::FORCE_LAG_MS;
use crate::trigger::{ContactConfig, ContactDetector};
use bias::Bias;
use gain::Gain;
use noise::{CONTACT_MAX, Noise};
use withdrawal::Withdrawal;

pub use noise::JUDGED_MAX;

/// An averaged force of so many of its standard deviations is no noise.
const DEVIATIONS: f64 = 5.0;
/// A tool that reads no force may still touch where a drifting bias hides it: it is clear after this way, m.
const CLEAR_M: f64 = 3e-3;

/// Whether the force is conditioned.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ConditioningConfig {
    /// Whether the bias is tared in free space and followed. Default: in recommended mode.
    pub tare: bool,
    /// Whether the thresholds of contact, and the averages that contact and (12) are judged by, follow the measured
    /// noise. Default: in recommended mode.
    pub follow_noise: bool,
    /// Whether the gain of the force sensor is found: by how contacts begin, whose stiffness and damping must be the session's k_p
    /// and k_d. Default: not, for who knows them?
    pub find_gain: bool,
    /// Time constant of the force sensor's own low-pass, ms: 1000/(2 pi f) for a corner of f Hz. The estimator's tool goes through the
    /// same. Default 0.
    pub lag_ms: f64,
}

impl ConditioningConfig {
    /// Checks every number.
    ///
    /// # Errors
    /// Names the one that is out of range or not a number.
    pub(crate) fn check(&self) -> Result<(), OutOfRange> {
        in_range("conditioning: lag", "ms", self.lag_ms, FORCE_LAG_MS)
    }

    /// Paper mode takes the force as it is measured, as the paper does.
    #[must_use]
    pub fn of_mode(mode: Mode) -> Self {
        let cured = mode == Mode::Recommended;
        Self {
            tare: cured,
            follow_noise: cured,
            find_gain: false,
            lag_ms: 0.0,
        }
    }
}

impl Default for ConditioningConfig {
    fn default() -> Self {
        Self::of_mode(Mode::Recommended)
    }
}

/// The force of a tick, conditioned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conditioned {
    /// Without bias, and with the gain that is known, N.
    pub force: Vec2,
    /// The same over as many samples as contact is judged by, N.
    pub steady: Vec2,
    /// Noise per axis as measured, N, where it is more than thresholds are made for; else 0.
    pub noise_n: f64,
    /// By the gain as it is known now, forces of earlier ticks are this many times what was given; 1 where the gain stays.
    pub rescaled: f64,
    /// Whether the tool touches.
    pub in_contact: bool,
    /// Samples that (12) is to be judged by: 1 or more.
    pub averaged: usize,
}

/// A real contact is no softer than this share of k_p.
const SOFTEST: f64 = 0.25;

/// Measures noise, bias and gain, and decides whether the tool touches.
#[derive(Clone, Debug)]
pub struct Conditioner {
    config: ConditioningConfig,
    noise: Noise,
    bias: Bias,
    /// None where nobody knows the contact's stiffness.
    gain: Option<Gain>,
    recent: VecDeque<Vec2>,
    withdrawal: Withdrawal,
    /// Where the last contact ended, m, until the tool is clear of that place.
    left: Option<Vec2>,
    detector: ContactDetector,
    in_contact: bool,
    /// Whether images show the tool clear of everything.
    seen_clear: bool,
}

impl Conditioner {
    /// Of a tool whose session has this coupling.
    #[must_use]
    pub fn new(config: ConditioningConfig, contact: ContactConfig, coupling: &Coupling) -> Self {
        Self {
            config,
            noise: Noise::default(),
            bias: Bias::default(),
            gain: config.find_gain.then(|| Gain::new(*coupling)),
            recent: VecDeque::with_capacity(CONTACT_MAX),
            withdrawal: Withdrawal::new(SOFTEST * coupling.stiffness_n_per_m),
            left: None,
            detector: ContactDetector::new(contact),
            in_contact: false,
            seen_clear: false,
        }
    }

    /// Images show the tool clear of everything: a force that a drift of the bias explains is no contact.
    pub fn see_clear(&mut self) {
        self.seen_clear = true;
    }

    /// The tool may touch from the beginning: the first samples are no bias.
    pub fn resume(&mut self) {
        self.bias.begin();
    }

    /// Noise per axis as measured, N, where it is more than thresholds are made for; else 0.
    #[must_use]
    pub fn noise_n(&self) -> f64 {
        self.noise.beyond()
    }

    /// Measured force over true force, as contacts have shown it; none where it is not looked for, and before one has.
    #[must_use]
    pub fn sensor_gain(&self) -> Option<f64> {
        self.gain.as_ref().and_then(Gain::found)
    }

    /// Takes the measured force (N) of a tick with the tool at `tool` (m).
    pub fn step(&mut self, measured: Vec2, tool: Vec2) -> Conditioned {
        if self.config.follow_noise {
            self.noise.step(measured, !self.in_contact);
        }
        let (for_contact, for_trigger) = self.noise.averaged();
        let steady = self.average(measured, for_contact) - self.bias.known();
        let deviation = self.noise.of_average(for_contact);
        let untouched = self.config.tare && self.bias.first && self.is_bias();
        self.in_contact = !untouched && self.detector.step(steady.norm(), deviation);
        if self.config.tare {
            self.tare(measured, steady, tool, deviation);
        }
        let force = measured - self.bias.known();
        let (before, gain) = self.gain.as_mut().map_or((1.0, 1.0), |gain| {
            let before = gain.known();
            gain.step(force, tool, self.in_contact, self.noise.per_axis());
            (before, gain.known())
        });
        Conditioned {
            force: force / gain,
            steady: steady / gain,
            noise_n: self.noise.beyond(),
            rescaled: before / gain,
            in_contact: self.in_contact,
            averaged: for_trigger,
        }
    }

    /// Follows the bias in free space, and ends a contact that is none.
    fn tare(&mut self, measured: Vec2, steady: Vec2, tool: Vec2, deviation: f64) {
        if !self.in_contact {
            self.withdrawal.reset();
            let doubt = self.detector.config().off_n.max(DEVIATIONS * deviation);
            let clear = self.left.is_none_or(|left| (tool - left).norm() > CLEAR_M);
            if self.bias.first || (clear && steady.norm() < doubt) {
                self.left = None;
                self.bias.follow(measured, self.noise.per_axis());
            } else {
                self.bias.go_on();
            }
            return;
        }
        self.left = Some(tool);
        if self.bias.first {
            self.bias.begin();
        }
        self.bias.touch();
        let drifted = self.detector.config().on_n + 3.0 * deviation + self.bias.drifted_n();
        let stays = self.withdrawal.step(steady, tool, 3.0 * deviation);
        let seen = std::mem::take(&mut self.seen_clear).then_some(steady);
        if let Some(stays) = seen.or(stays).filter(|force| force.norm() < drifted) {
            self.bias.find(stays, self.noise.per_axis());
            self.detector.release();
            self.in_contact = false;
        }
    }

    /// Whether the newest measured forces may be the bias of an untouched tool. Of a few, as one may be noise; before there are
    /// so many, the others count as none.
    fn is_bias(&self) -> bool {
        let sum: Vec2 = self.recent.iter().sum();
        sum.norm() < bias::MAX_N * CONTACT_MAX as f64
    }

    /// The mean of the newest `n` measured forces, N.
    fn average(&mut self, force: Vec2, n: usize) -> Vec2 {
        while self.recent.len() >= CONTACT_MAX {
            self.recent.pop_front();
        }
        self.recent.push_back(force);
        if n == 1 {
            return force;
        }
        let newest = self.recent.iter().rev().take(n);
        let all = newest.len() as f64;
        newest.fold(Vec2::zeros(), |sum, force| sum + force) / all
    }
}

#[cfg(test)]
mod tests;
