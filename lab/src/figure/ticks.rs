//! Where the marks of a logarithmic axis stand, and what is written at any mark.

use std::ops::Range;

/// Marks of a logarithmic axis: powers of ten, with 2 and 5 times them if there are few.
pub(super) fn log(range: &Range<f64>) -> Vec<f64> {
    let (first, last) = (
        libm::floor(libm::log10(range.start)) as i32,
        libm::ceil(libm::log10(range.end)) as i32,
    );
    let digits: &[f64] = match last - first {
        0..=2 => &[1.0, 2.0, 5.0],
        3 => &[1.0, 3.0],
        _ => &[1.0],
    };
    let all = (first..=last).flat_map(|k| {
        let power = libm::pow(10.0, f64::from(k));
        digits.iter().map(move |digit| digit * power)
    });
    let shown = range.start * (1.0 - 1e-9)..=range.end * (1.0 + 1e-9);
    all.filter(|mark| shown.contains(mark)).collect()
}

/// A mark nearer to zero than this is zero, give or take a binary fraction.
const DUST: f64 = 5e-10;

/// The shortest way to write a mark without the dust of binary fractions.
pub(super) fn written(value: f64) -> String {
    if value.abs() < DUST {
        return "0".to_owned();
    }
    let digits = (3.0 - libm::floor(libm::log10(value.abs()))).clamp(0.0, 9.0) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logarithmic_marks_are_powers_of_ten_or_a_few_between() {
        let ticks = |low: f64, high: f64| -> Vec<String> {
            log(&(low..high)).into_iter().map(written).collect()
        };
        assert_eq!(ticks(1.0, 100.0), ["1", "2", "5", "10", "20", "50", "100"]);
        assert_eq!(ticks(0.5, 400.0), ["1", "10", "100"]);
    }

    #[test]
    fn a_mark_that_is_nearly_zero_is_written_as_zero() {
        let marks = [0.3 - 0.1 - 0.2, -0.0, 0.2, -1e-3, 1e-8].map(written);
        assert_eq!(marks, ["0", "0", "0.2", "-0.001", "0.00000001"]);
    }
}
