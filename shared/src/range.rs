//! A number against its accepted range: the one check, and the one way to say what was wrong.
//!
//! It never changes a number.

/// A number lies outside its accepted range or is not a number.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{name} {value} is outside the accepted range {min} to {max} {unit}")]
pub struct OutOfRange {
    /// Which number.
    pub name: &'static str,
    /// What it was.
    pub value: f64,
    /// Least accepted value.
    pub min: f64,
    /// Greatest accepted value.
    pub max: f64,
    /// Unit of all three.
    pub unit: &'static str,
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
        for value in [0.0499, f64::NAN, f64::INFINITY] {
            assert!(mass(value).is_err(), "{value}");
        }
    }
}
