//! How far the local model's pose is from the true pose of the object, sample by sample.

use crate::model::geometry::{Pose, wrap_angle};
use crate::stats::values::mean_of_sum;

/// Accumulates position and orientation error. Fixed size, no allocation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PoseError {
    n: u64,
    sum_position2: f64,
    sum_angle2: f64,
    position_max: f64,
    angle_max: f64,
}

impl PoseError {
    /// Takes the model's pose and the object's true pose for the same HIP sample. A pose that is not
    /// finite is ignored.
    pub fn push(&mut self, model: &Pose, truth: &Pose) {
        let position2 = (model.position - truth.position).norm_squared();
        let angle = wrap_angle(model.angle - truth.angle).abs();
        if !(self.sum_position2 + position2).is_finite() || !angle.is_finite() {
            return;
        }
        self.n += 1;
        self.sum_position2 += position2;
        self.sum_angle2 += angle * angle;
        self.position_max = self.position_max.max(position2.sqrt());
        self.angle_max = self.angle_max.max(angle);
    }

    /// Root mean square distance of the two centres, m; absent without samples.
    pub fn position_rms_m(&self) -> Option<f64> {
        mean_of_sum(self.sum_position2, self.n).map(f64::sqrt)
    }

    /// Root mean square orientation error, wrapped to at most half a turn, rad; absent without samples.
    pub fn angle_rms_rad(&self) -> Option<f64> {
        mean_of_sum(self.sum_angle2, self.n).map(f64::sqrt)
    }

    /// Largest distance of the two centres, m; absent without samples.
    pub fn position_max_m(&self) -> Option<f64> {
        (self.n > 0).then_some(self.position_max)
    }

    /// Largest orientation error, rad; absent without samples.
    pub fn angle_max_rad(&self) -> Option<f64> {
        (self.n > 0).then_some(self.angle_max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rms_and_largest_error_of_a_hand_computed_case() {
        let mut error = PoseError::default();
        assert_eq!(error.position_rms_m(), None);
        assert_eq!(error.angle_max_rad(), None);
        // 5 mm and 0.1 rad, then no error
        error.push(&Pose::new(0.003, 0.004, 0.1), &Pose::default());
        error.push(&Pose::new(1.0, 1.0, 2.0), &Pose::new(1.0, 1.0, 2.0));
        assert!((error.position_rms_m().unwrap() - 0.005 / 2f64.sqrt()).abs() < 1e-15);
        assert!((error.angle_rms_rad().unwrap() - 0.1 / 2f64.sqrt()).abs() < 1e-15);
        assert!((error.position_max_m().unwrap() - 0.005).abs() < 1e-15);
        assert!((error.angle_max_rad().unwrap() - 0.1).abs() < 1e-15);
    }

    #[test]
    fn a_whole_turn_is_no_orientation_error() {
        let mut error = PoseError::default();
        let turn = std::f64::consts::TAU;
        error.push(&Pose::new(0.0, 0.0, turn + 0.01), &Pose::default());
        assert!((error.angle_max_rad().unwrap() - 0.01).abs() < 1e-12);
    }

    #[test]
    fn poses_that_are_not_finite_are_ignored() {
        let mut error = PoseError::default();
        error.push(&Pose::new(f64::NAN, 0.0, 0.0), &Pose::default());
        error.push(&Pose::default(), &Pose::new(0.0, 0.0, f64::INFINITY));
        error.push(&Pose::new(f64::MAX, 0.0, 0.0), &Pose::default());
        assert_eq!(error, PoseError::default());
    }
}
