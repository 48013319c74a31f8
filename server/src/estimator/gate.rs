//! When a tick carries information about m, b and c.
//!
//! Only while the tool pushes and the object slides, both for a while. While the object sticks the force
//! is anything between 0 and c, so a sticking tick must never reach the regression.

use serde::{Deserialize, Serialize};

/// A force of so many standard deviations of its noise is a push.
const DEVIATIONS: f64 = 5.0;

/// Settings of `Gate`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GateConfig {
    /// Least force along the normal, N. 0.15 N: 15 times the default force noise.
    pub force_min_n: f64,
    /// Least speed along the normal, m/s; three standard deviations of its noise if that is more.
    pub speed_min_m_per_s: f64,
    /// How long both must have lasted, ticks. 42: five time constants of a 120 rad/s stage.
    pub ticks: u32,
}

impl Default for GateConfig {
    fn default() -> Self {
        Self {
            force_min_n: 0.15,
            speed_min_m_per_s: 0.020,
            ticks: 42,
        }
    }
}

/// What a tick is good for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum GateState {
    /// No push, or the object sticks.
    Closed,
    /// First tick of a sliding push: the filter must start here.
    Begins,
    /// A sliding push, too young.
    Young,
    /// A sliding push whose rows count.
    Open,
}

/// Watches force and speed and opens when both have been enough for long enough.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gate {
    config: GateConfig,
    age: u32,
}

impl Gate {
    /// A closed gate.
    #[must_use]
    pub(super) fn new(config: GateConfig) -> Self {
        Self { config, age: 0 }
    }

    /// Takes force (N) and smoothed speed (m/s) along the normal, and the noise of the force where that is more than the
    /// settings are made for (N).
    ///
    /// A slow object slides if it is known to creep.
    pub(super) fn step(&mut self, force: f64, speed: f64, creeps: bool, noise: f64) -> GateState {
        let slides = self.slides(speed) || creeps;
        let enough = force > self.config.force_min_n.max(DEVIATIONS * noise) && slides;
        if !enough {
            self.age = 0;
            return GateState::Closed;
        }
        self.age = self.age.saturating_add(1);
        match self.age {
            1 => GateState::Begins,
            age if age > self.config.ticks => GateState::Open,
            _ => GateState::Young,
        }
    }

    /// Whether a smoothed speed (m/s) is that of sliding by itself. Nothing slides against a push: a surface that seems to come
    /// back while the force rises is that of a contact which is stiffer than believed.
    #[must_use]
    pub(super) fn slides(&self, speed: f64) -> bool {
        speed > 0.0 && self.moves(speed)
    }

    /// Whether a smoothed speed (m/s) is fast enough to be known by itself.
    #[must_use]
    pub(super) fn moves(&self, speed: f64) -> bool {
        speed.abs() > self.config.speed_min_m_per_s
    }

    /// Closes: contact was lost.
    pub(super) fn close(&mut self) {
        self.age = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pushed(ticks: u32) -> Gate {
        let mut gate = Gate::new(GateConfig::default());
        for _ in 0..ticks {
            gate.step(2.0, 0.1, false, 0.0);
        }
        gate
    }

    #[test]
    fn it_opens_after_42_ticks_of_sliding_and_not_before() {
        assert_eq!(pushed(0).step(2.0, 0.1, false, 0.0), GateState::Begins);
        assert_eq!(pushed(1).step(2.0, 0.1, false, 0.0), GateState::Young);
        assert_eq!(pushed(41).step(2.0, 0.1, false, 0.0), GateState::Young);
        assert_eq!(pushed(42).step(2.0, 0.1, false, 0.0), GateState::Open);
    }

    #[test]
    fn sticking_a_light_touch_and_a_reversal_each_begin_anew() {
        for (force, speed) in [(2.0, 0.020), (0.15, 0.1), (f64::NAN, 0.1), (2.0, f64::NAN)] {
            let mut gate = pushed(100);
            assert_eq!(gate.step(force, speed, false, 0.0), GateState::Closed);
            assert_eq!(gate.step(2.0, 0.1, false, 0.0), GateState::Begins);
        }
        assert_eq!(pushed(100).step(2.0, -0.1, false, 0.0), GateState::Closed);
    }
}
