//! Whether the slave is in contact, from the size of the measured force, with hysteresis and debounce.

use serde::{Deserialize, Serialize};

/// Contact begins and ends at no less than so many standard deviations of the force.
const DEVIATIONS: (f64, f64) = (5.0, 3.0);

/// Thresholds of contact.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ContactConfig {
    /// |f_s| at and above which contact begins, N. Default 0.10: ten times the sensor noise per axis.
    pub on_n: f64,
    /// |f_s| below which contact ends, N. Default 0.05: five times the sensor noise per axis.
    pub off_n: f64,
    /// Samples in a row that it takes. Default 3.
    pub samples: u32,
}

impl Default for ContactConfig {
    fn default() -> Self {
        Self {
            on_n: 0.10,
            off_n: 0.05,
            samples: 3,
        }
    }
}

/// Debounced contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactDetector {
    config: ContactConfig,
    in_contact: bool,
    against: u32,
}

impl ContactDetector {
    /// Not in contact.
    #[must_use]
    pub fn new(config: ContactConfig) -> Self {
        Self {
            config,
            in_contact: false,
            against: 0,
        }
    }

    /// One sample of |f_s| (N), whose standard deviation per axis is `deviation` (N) where the thresholds are not made
    /// for it, else 0; returns whether the slave is in contact.
    pub fn step(&mut self, force: f64, deviation: f64) -> bool {
        let (on, off) = DEVIATIONS;
        let touches = if self.in_contact {
            force >= self.config.off_n.max(off * deviation)
        } else {
            force >= self.config.on_n.max(on * deviation)
        };
        self.against = if touches == self.in_contact {
            0
        } else {
            self.against + 1
        };
        if self.against >= self.config.samples.max(1) {
            self.in_contact = touches;
            self.against = 0;
        }
        self.in_contact
    }

    /// The thresholds at which contact begins and ends.
    #[must_use]
    pub fn config(&self) -> &ContactConfig {
        &self.config
    }

    /// Ends a contact that is none.
    pub fn release(&mut self) {
        (self.in_contact, self.against) = (false, 0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contact_begins_and_ends_at_its_thresholds_after_the_debounce() {
        let mut detector = ContactDetector::new(ContactConfig::default());
        let mut run =
            |force: f64, n: u32| (0..n).map(|_| detector.step(force, 0.0)).last().unwrap();
        assert!(!run(0.0999, 100));
        assert!(!run(0.10, 2));
        assert!(run(0.10, 1));
        assert!(run(0.05, 100), "hysteresis");
        assert!(run(0.0499, 2));
        assert!(!run(0.0499, 1));
    }

    #[test]
    fn thresholds_rise_to_five_and_three_deviations_where_that_is_more() {
        let begins = |force, deviation| {
            let mut detector = ContactDetector::new(ContactConfig::default());
            (0..3).map(|_| detector.step(force, deviation)).last()
        };
        assert_eq!(begins(0.10, 0.02), Some(true));
        assert_eq!(begins(0.199, 0.04), Some(false));
        let mut detector = ContactDetector::new(ContactConfig::default());
        let mut run = |force| (0..3).map(|_| detector.step(force, 0.04)).last();
        assert_eq!(run(0.201), Some(true));
        assert_eq!((run(0.121), run(0.119)), (Some(true), Some(false)));
    }
}
