//! Whether the tool touches, from the size of the measured force.
//!
//! Two thresholds above the force noise and a debounce, so that noise neither makes nor breaks a
//! contact. It must never change its mind on a force that is not a number.

use std::time::Duration;

use mmt_shared::time::Time;
use serde::{Deserialize, Serialize};

/// Settings of [`ContactDetector`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ContactThresholds {
    /// Above this force a contact begins, N. 0.10: ten times the default noise.
    pub on_n: f64,
    /// Below this force it ends, N. 0.05: five times the default noise.
    pub off_n: f64,
    /// For how long the force must say so. 3 ms: three samples.
    pub debounce: Duration,
}

impl Default for ContactThresholds {
    fn default() -> Self {
        Self {
            on_n: 0.10,
            off_n: 0.05,
            debounce: Duration::from_millis(3),
        }
    }
}

/// Follows the force and says whether the tool touches.
#[derive(Clone, Copy, Debug)]
pub struct ContactDetector {
    thresholds: ContactThresholds,
    touching: bool,
    doubted_since: Option<Time>,
}

impl ContactDetector {
    /// Not touching.
    #[must_use]
    pub fn new(thresholds: ContactThresholds) -> Self {
        Self {
            thresholds,
            touching: false,
            doubted_since: None,
        }
    }

    /// Takes the size of the force (N) at `now` and says whether the tool touches.
    ///
    /// The state changes at the first sample at which the force has contradicted it for the debounce.
    pub fn step(&mut self, now: Time, force: f64) -> bool {
        let contradicted = if self.touching {
            force < self.thresholds.off_n
        } else {
            force > self.thresholds.on_n
        };
        if !contradicted {
            self.doubted_since = None;
            return self.touching;
        }
        let since = *self.doubted_since.get_or_insert(now);
        if now.saturating_since(since) >= self.thresholds.debounce {
            self.touching = !self.touching;
            self.doubted_since = None;
        }
        self.touching
    }

    /// Whether the tool touches.
    #[must_use]
    pub fn touching(&self) -> bool {
        self.touching
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mmt_shared::rng::Substream;

    fn changes(forces: impl Iterator<Item = f64>) -> Vec<u64> {
        let mut detector = ContactDetector::new(ContactThresholds::default());
        let (mut before, mut changes) = (false, vec![]);
        for (ms, force) in (0..).zip(forces) {
            if detector.step(Time::from_millis(ms), force) != before {
                before = !before;
                changes.push(ms);
            }
        }
        changes
    }

    #[test]
    fn contact_begins_and_ends_three_milliseconds_after_the_force_says_so() {
        let forces = (0..200).map(|ms| if (50..100).contains(&ms) { 1.0 } else { 0.0 });
        assert_eq!(changes(forces), [53, 103]);
    }

    #[test]
    fn noise_neither_makes_nor_breaks_a_contact() {
        let mut noise = Substream::new(1, "contact", 0);
        let mut size = |mean: f64| {
            let (x, y) = noise.normal_pair();
            libm::hypot(mean + 0.010 * x, 0.010 * y)
        };
        let forces: Vec<f64> = (0..40_000)
            .map(|ms| {
                size(if (10_000..30_000).contains(&ms) {
                    0.12
                } else {
                    0.0
                })
            })
            .collect();
        assert!(forces.iter().skip(10_000).take(20_000).any(|f| *f < 0.10));
        let found = changes(forces.into_iter());
        assert_eq!(found.len(), 2, "{found:?}");
    }

    #[test]
    fn a_force_between_the_thresholds_or_not_a_number_changes_nothing() {
        for odd in [0.07, f64::NAN] {
            assert!(changes(std::iter::repeat_n(odd, 100)).is_empty());
            let forces = std::iter::repeat_n(1.0, 10).chain(std::iter::repeat_n(odd, 100));
            assert_eq!(changes(forces), [3]);
        }
    }
}
