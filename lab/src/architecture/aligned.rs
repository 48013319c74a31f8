//! The force that the hand feels against the true force at the tool, each shifted by the delay that the architecture has.
//!
//! A force that crosses the network is felt a way later than it was met, a model's force a way before. Compared like this,
//! lateness itself costs nothing, and what the law makes of the force is left. Against [`ForceMetrics`] of the same HIP sample, in
//! which lateness counts. It must never look for the shift that fits best.

use std::collections::VecDeque;

use mmt_shared::metrics::ForceMetrics;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::time::Time;

/// Forces in the order of their ticks, and what their comparison came to.
#[derive(Clone, Debug, Default)]
pub(super) struct AlignedError {
    /// By the hand's time.
    felt: VecDeque<(Time, Vec2)>,
    /// By the time at which the hand is to feel them.
    met: VecDeque<(Time, Vec2)>,
    metrics: ForceMetrics,
}

impl AlignedError {
    /// Takes what the hand feels in a tick, N on the object.
    pub(super) fn push_felt(&mut self, now: Time, force: Vec2) {
        self.felt.push_back((now, force));
        self.compare();
    }

    /// Takes the true force of a tick of the tool's, N on the object; `felt` is the tick of the hand's in which this architecture
    /// would have it felt.
    pub(super) fn push_met(&mut self, felt: Time, force: Vec2) {
        self.met.push_back((felt, force));
        self.compare();
    }

    /// Relative vector error of what could be compared; none without a force.
    pub(super) fn relative(&self) -> Option<f64> {
        self.metrics.summary().relative_error
    }

    /// Compares each true force with the newest that was felt by its time, once both are there.
    fn compare(&mut self) {
        while let (Some((due, met)), Some((newest, _))) = (self.met.front(), self.felt.back())
            && due <= newest
        {
            while self.felt.get(1).is_some_and(|(next, _)| next <= due) {
                self.felt.pop_front();
            }
            if let Some((_, felt)) = self.felt.front().filter(|(then, _)| then <= due) {
                self.metrics.push(*met, *felt);
            }
            self.met.pop_front();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn force(ms: u64) -> Vec2 {
        Vec2::new(2.0 + libm::sin(ms as f64 * 0.02), 0.5)
    }

    /// The error of a force that is felt `late_ms` after it was met (before, if negative), aligned by `aligned_ms`.
    fn error(late_ms: i64, aligned_ms: i64, gain: f64) -> f64 {
        let mut error = AlignedError::default();
        let at = |ms: u64, by: i64| ms.checked_add_signed(by);
        for ms in 1000..5000 {
            if let Some(met) = at(ms, -late_ms) {
                error.push_felt(Time::from_millis(ms), force(met) * gain);
            }
            if let Some(felt) = at(ms, aligned_ms) {
                error.push_met(Time::from_millis(felt), force(ms));
            }
        }
        assert!(error.felt.len() + error.met.len() < 600);
        error.relative().unwrap()
    }

    #[test]
    fn a_force_that_is_late_by_the_delay_is_right_and_one_that_is_off_is_off_by_as_much() {
        for late_ms in [0, 1, 100, 500, -1, -500] {
            assert!(error(late_ms, late_ms, 1.0) < 1e-12, "{late_ms}");
            assert!((error(late_ms, late_ms, 0.9) - 0.1).abs() < 1e-12);
        }
    }

    #[test]
    fn a_force_that_is_later_than_the_delay_is_wrong() {
        assert!(error(100, 0, 1.0) > 0.1);
        assert!(error(100, 50, 1.0) > 0.1);
        assert!(error(0, 100, 1.0) > 0.1);
    }

    #[test]
    fn without_a_force_there_is_no_error() {
        let mut error = AlignedError::default();
        error.push_felt(Time::ZERO, Vec2::zeros());
        error.push_met(Time::ZERO, Vec2::zeros());
        assert_eq!(error.relative(), None);
    }
}
