//! What stands under a key of a report: a number that is finite or absent, or counts by name.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Counts by name; every known name is there, with 0 if it never happened.
pub type Counts = BTreeMap<String, u64>;

/// Counts by name.
pub fn named<'a>(counts: impl IntoIterator<Item = (&'a str, u64)>) -> Counts {
    let counts = counts.into_iter();
    counts.map(|(name, n)| (name.to_owned(), n)).collect()
}

/// A finite number, or none. NaN and infinity become none on the way in, so no report can hold them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "Option<f64>", into = "Option<f64>")]
pub struct Number(Option<f64>);

impl Number {
    /// No number: it has no meaning in this run.
    pub const ABSENT: Self = Self(None);

    /// The number, if there is one.
    pub fn get(self) -> Option<f64> {
        self.0
    }

    /// The number scaled, for another unit.
    #[must_use]
    pub fn times(self, factor: f64) -> Self {
        self.0.map(|value| value * factor).into()
    }

    /// `amount / duration`, absent when the duration is not positive.
    pub fn rate(amount: f64, duration_s: f64) -> Self {
        (duration_s > 0.0).then(|| amount / duration_s).into()
    }
}

impl From<f64> for Number {
    fn from(value: f64) -> Self {
        Self(value.is_finite().then_some(value))
    }
}

impl From<Option<f64>> for Number {
    fn from(value: Option<f64>) -> Self {
        Self(value.filter(|value| value.is_finite()))
    }
}

impl From<Number> for Option<f64> {
    fn from(number: Number) -> Self {
        number.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_finite_numbers_get_in_by_any_road() {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!(Number::from(bad), Number::ABSENT);
            assert_eq!(Number::from(Some(bad)), Number::ABSENT);
            assert_eq!(Number::from(1.0).times(bad), Number::ABSENT);
            assert_eq!(Number::rate(bad, 1.0), Number::ABSENT);
        }
        assert_eq!(Number::from(0.0).get(), Some(0.0));
        assert_eq!(Number::from(f64::MAX).times(2.0), Number::ABSENT);
    }

    #[test]
    fn a_rate_over_no_time_is_absent() {
        assert_eq!(Number::rate(30.0, 20.0).get(), Some(1.5));
        for no_time in [0.0, -1.0, f64::NAN] {
            assert_eq!(Number::rate(3.0, no_time), Number::ABSENT);
        }
    }
}
