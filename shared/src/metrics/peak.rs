//! The largest force of a run and the largest change of it within one tick.

use crate::model::geometry::Vec2;

/// Follows a force tick by tick. Fixed size, no allocation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ForcePeak {
    last: Option<Vec2>,
    largest: Option<f64>,
    largest_step: Option<f64>,
}

impl ForcePeak {
    /// Takes the force of one tick, N. A force that is not finite is ignored.
    pub fn push(&mut self, f: Vec2) {
        let size = f.norm();
        if !size.is_finite() {
            return;
        }
        let step = self.last.map(|last| (f - last).norm());
        self.last = Some(f);
        self.largest = larger(self.largest, Some(size));
        self.largest_step = larger(self.largest_step, step);
    }

    /// Largest |f|, N; absent before the first tick.
    pub fn largest_n(&self) -> Option<f64> {
        self.largest
    }

    /// Largest |f(n) − f(n−1)|, N; absent before the second tick.
    pub fn largest_step_n(&self) -> Option<f64> {
        self.largest_step
    }
}

fn larger(a: Option<f64>, b: Option<f64>) -> Option<f64> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.max(b)),
        (a, b) => a.or(b),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn largest_force_and_step_of_a_hand_computed_case() {
        let mut peak = ForcePeak::default();
        assert_eq!((peak.largest_n(), peak.largest_step_n()), (None, None));
        peak.push(Vec2::new(3.0, 4.0));
        assert_eq!((peak.largest_n(), peak.largest_step_n()), (Some(5.0), None));
        peak.push(Vec2::new(-3.0, -4.0));
        peak.push(Vec2::new(f64::NAN, 0.0));
        peak.push(Vec2::new(-3.0, -3.0));
        assert_eq!(
            (peak.largest_n(), peak.largest_step_n()),
            (Some(5.0), Some(10.0))
        );
    }
}
