//! The state-variable filter: one low-pass for force and motion alike, so that it cancels in (1).
//!
//! (1) holds at every instant, so it holds between force, velocity, acceleration and sign of the motion
//! after *any* linear filter, provided that it is the *same* one and starts for all of them at the same
//! instant. The four signals therefore go through one filter as one vector; it must never be possible
//! to give one of them another filter or another start.

use mmt_shared::time::TICK_S;
use nalgebra::{Vector3, Vector4};

/// Weight of a new sample in a first-order stage of `cutoff` rad/s at the period T: `1 − exp(−ω T)`.
#[must_use]
pub(super) fn stage_weight(cutoff: f64) -> f64 {
    1.0 - libm::exp(-cutoff * TICK_S)
}

/// One tick of (1) along the contact normal: `f = m a + b v + c s`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Row {
    /// Regressor: acceleration a·n (m/s²), velocity v·n (m/s), s = sign(v·n).
    pub regressor: Vector3<f64>,
    /// Force f·n on the object, N.
    pub force: f64,
    /// What a and v were multiplied by, and their noise with them: 1 for a push through the centre.
    pub scale: f64,
}

impl Row {
    /// This row with s = 1: friction opposes the push alone.
    #[must_use]
    pub(super) fn pushed(mut self) -> Self {
        self.regressor.z = 1.0;
        self
    }
}

/// Three equal first-order stages in a row, each with unit gain at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct StateVariableFilter {
    weight: f64,
    stages: [Vector4<f64>; 3],
}

impl StateVariableFilter {
    /// A filter at zero whose stages have the corner `cutoff` (rad/s).
    #[must_use]
    pub(super) fn new(cutoff: f64) -> Self {
        Self {
            weight: stage_weight(cutoff),
            stages: [Vector4::zeros(); 3],
        }
    }

    /// Back to zero, all signals at once: the next rows are exact from the first on.
    pub(super) fn restart(&mut self) {
        self.stages = [Vector4::zeros(); 3];
    }

    /// Filters one tick.
    pub(super) fn step(&mut self, row: Row) -> Row {
        let mut signal = row.regressor.push(row.force);
        for stage in &mut self.stages {
            *stage += (signal - *stage) * self.weight;
            signal = *stage;
        }
        Row {
            regressor: signal.xyz(),
            force: signal.w,
            scale: row.scale,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_linear_relation_survives_from_the_first_tick_after_a_restart() {
        let theta = Vector3::new(0.7, 3.0, 2.06);
        let mut filter = StateVariableFilter::new(120.0);
        for k in 0..500 {
            if k % 90 == 0 {
                filter.restart();
            }
            let t = f64::from(k);
            let regressor =
                Vector3::new(libm::sin(t * 0.01), 0.2 + 0.1 * libm::cos(t * 0.017), 1.0);
            let force = theta.dot(&regressor);
            let scale = 1.0;
            let out = filter.step(Row {
                regressor,
                force,
                scale,
            });
            assert!((theta.dot(&out.regressor) - out.force).abs() < 1e-12);
        }
    }

    #[test]
    fn gain_at_rest_is_one_and_the_delay_is_three_time_constants() {
        let mut filter = StateVariableFilter::new(120.0);
        let (mut delay, mut last) = (0.0, 0.0);
        for _ in 0..400 {
            let row = Row {
                regressor: Vector3::zeros(),
                force: 1.0,
                scale: 1.0,
            };
            last = filter.step(row).force;
            delay += (1.0 - last) * TICK_S;
        }
        assert!((last - 1.0).abs() < 1e-12);
        // mean delay 3/ω less half a sample per stage
        assert!((delay - (3.0 / 120.0 - 0.0015)).abs() < 2e-4, "{delay}");
    }
}
