//! Whether the slave is in contact, from the size of the measured force, with hysteresis and debounce.

use serde::{Deserialize, Serialize};

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

    /// One sample of |f_s| (N); returns whether the slave is in contact.
    pub fn step(&mut self, force: f64) -> bool {
        let touches = if self.in_contact {
            force >= self.config.off_n
        } else {
            force >= self.config.on_n
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
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contact_begins_and_ends_at_its_thresholds_after_the_debounce() {
        let mut detector = ContactDetector::new(ContactConfig::default());
        let mut run = |force: f64, n: u32| (0..n).map(|_| detector.step(force)).last().unwrap();
        assert!(!run(0.0999, 100));
        assert!(!run(0.10, 2));
        assert!(run(0.10, 1));
        assert!(run(0.05, 100), "hysteresis");
        assert!(run(0.0499, 2));
        assert!(!run(0.0499, 1));
    }
}
