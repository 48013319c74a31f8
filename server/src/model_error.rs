//! How wrong the local model has been of late: the confidence that a choice of architecture rests on.
//!
//! It holds the measured force against the shadow's for the same HIP sample. It must never see the truth.

use mmt_shared::metrics::F_MIN_N;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::time::TICK_S;

/// Memory, s of contact: a third of a push.
const TAU_S: f64 = 0.5;
/// What is said before any contact: the median over eight seeds of the relative error in the first push of the default
/// scenario, at 0 to 20 ms one way (0.22 to 0.24: `lab/src/architecture/tests.rs` measures it).
pub const UNKNOWN: f64 = 0.23;
/// Force that the unknown weighs as much as, N: that of a light push.
const UNKNOWN_FORCE_N: f64 = 2.0;

/// Relative error of the model's force over the last half second of contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModelError {
    /// Mean square of |f_s − f_m|, N².
    error2: f64,
    /// Mean square of |f_s|, N².
    force2: f64,
}

impl Default for ModelError {
    fn default() -> Self {
        let force2 = UNKNOWN_FORCE_N * UNKNOWN_FORCE_N;
        Self {
            error2: UNKNOWN * UNKNOWN * force2,
            force2,
        }
    }
}

impl ModelError {
    /// Takes the measured force and the model's for the same HIP sample, N. Where neither is felt nothing is learned.
    pub fn push(&mut self, f_s: Vec2, f_m: Vec2) {
        if f_s.norm() <= F_MIN_N && f_m.norm() <= F_MIN_N {
            return;
        }
        let share = TICK_S / TAU_S;
        self.error2 += share * ((f_s - f_m).norm_squared() - self.error2);
        self.force2 += share * (f_s.norm_squared() - self.force2);
    }

    /// sqrt(mean |f_s − f_m|² / mean |f_s|²), at most 1.
    #[must_use]
    pub fn relative(&self) -> f64 {
        let ratio = self.error2 / self.force2.max(F_MIN_N * F_MIN_N);
        ratio.sqrt().min(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_begins_unknown_learns_in_contact_only_and_forgets() {
        let mut error = ModelError::default();
        assert!((error.relative() - UNKNOWN).abs() < 1e-12);
        for _ in 0..10_000 {
            error.push(Vec2::new(0.03, 0.0), Vec2::zeros());
        }
        assert!((error.relative() - UNKNOWN).abs() < 1e-12, "no contact");
        let (f_s, f_m) = (Vec2::new(3.0, 0.0), Vec2::new(3.0, 0.3));
        for _ in 0..5_000 {
            error.push(f_s, f_m);
        }
        assert!((error.relative() - 0.1).abs() < 1e-3);
        for _ in 0..5_000 {
            error.push(f_s, Vec2::zeros());
        }
        assert!((error.relative() - 1.0).abs() < 1e-3);
    }
}
