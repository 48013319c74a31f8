//! A number against its accepted range: the one check, and the one message.
//!
//! It never changes a number.

/// A number lies outside its accepted range or is not a number.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{name} {value} is outside the accepted range {min} to {max}{}{unit}", space(.unit))]
pub struct OutOfRange {
    /// Which number.
    pub name: &'static str,
    /// What it was.
    pub value: f64,
    /// Least accepted value.
    pub min: f64,
    /// Greatest accepted value.
    pub max: f64,
    /// Unit of all three; empty for a ratio.
    pub unit: &'static str,
}

fn space(unit: &str) -> &str {
    if unit.is_empty() { "" } else { " " }
}

/// A number to check: its name, its unit, its value and its accepted range.
pub type Check = (&'static str, &'static str, f64, (f64, f64));

/// Checks every number.
///
/// # Errors
/// Names the first one that is outside its range or is not a number.
pub fn all_in_range(checks: impl IntoIterator<Item = Check>) -> Result<(), OutOfRange> {
    checks
        .into_iter()
        .try_for_each(|(name, unit, value, range)| in_range(name, unit, value, range))
}

/// Checks that `value` is within `min..=max`.
///
/// # Errors
/// It is not, or it is not a number.
pub fn in_range(
    name: &'static str,
    unit: &'static str,
    value: f64,
    (min, max): (f64, f64),
) -> Result<(), OutOfRange> {
    if (min..=max).contains(&value) {
        return Ok(());
    }
    Err(OutOfRange {
        name,
        value,
        min,
        max,
        unit,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_ends_are_accepted_and_nothing_beyond_them_nor_nan() {
        let mass = |value| in_range("mass", "kg", value, (0.05, 50.0));
        assert_eq!((mass(0.05), mass(50.0)), (Ok(()), Ok(())));
        let error = mass(50.1).unwrap_err();
        assert_eq!(
            error.to_string(),
            "mass 50.1 is outside the accepted range 0.05 to 50 kg"
        );
        let error = in_range("share", "", 1.5, (0.0, 1.0)).unwrap_err();
        assert_eq!(
            error.to_string(),
            "share 1.5 is outside the accepted range 0 to 1"
        );
        for value in [0.0499, f64::NAN, f64::INFINITY] {
            assert!(mass(value).is_err(), "{value}");
        }
    }
}
