//! Where the marks of an axis stand and what is written at them.

use std::ops::Range;

/// Marks of a linear axis: multiples of 1, 2 or 5 times a power of ten, five to ten of them.
pub(super) fn linear(range: &Range<f64>) -> Vec<f64> {
    let span = range.end - range.start;
    // written so that NaN gives none
    if !(span > 0.0 && span.is_finite()) {
        return Vec::new();
    }
    let power = libm::pow(10.0, libm::floor(libm::log10(span / 5.0)));
    let step = [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|digit| digit * power)
        .find(|step| span / step <= 8.0)
        .unwrap_or(power * 10.0);
    let first = libm::ceil(range.start / step - 1e-9) as i64;
    let last = libm::floor(range.end / step + 1e-9) as i64;
    (first..=last).map(|k| k as f64 * step).collect()
}

/// Marks of a logarithmic axis, as logarithms: powers of ten, with 2 and 5 times them if there are few.
pub(super) fn log(range: &Range<f64>) -> Vec<f64> {
    let (first, last) = (
        libm::floor(range.start) as i32,
        libm::ceil(range.end) as i32,
    );
    let digits: &[f64] = match last - first {
        0..=2 => &[1.0, 2.0, 5.0],
        3 => &[1.0, 3.0],
        _ => &[1.0],
    };
    let all = (first..=last).flat_map(|k| {
        digits
            .iter()
            .map(move |digit| f64::from(k) + libm::log10(*digit))
    });
    all.filter(|tick| *tick >= range.start - 1e-9 && *tick <= range.end + 1e-9)
        .collect()
}

/// The shortest way to write a mark without the dust of binary fractions.
pub(super) fn written(value: f64) -> String {
    if value == 0.0 {
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
    fn linear_marks_are_round_and_cover_the_axis() {
        let ticks: Vec<String> = linear(&(0.0..0.62)).into_iter().map(written).collect();
        assert_eq!(ticks, ["0", "0.1", "0.2", "0.3", "0.4", "0.5", "0.6"]);
        assert_eq!(linear(&(0.0..400.0)).len(), 9);
        assert!(linear(&(1.0..1.0)).is_empty());
        assert!(linear(&(0.0..f64::NAN)).is_empty());
    }

    #[test]
    fn logarithmic_marks_are_powers_of_ten_or_a_few_between() {
        let ticks = |low: f64, high: f64| -> Vec<String> {
            let range = libm::log10(low)..libm::log10(high);
            log(&range)
                .into_iter()
                .map(|t| written(libm::pow(10.0, t)))
                .collect()
        };
        assert_eq!(ticks(1.0, 100.0), ["1", "2", "5", "10", "20", "50", "100"]);
        assert_eq!(ticks(0.5, 400.0), ["1", "10", "100"]);
    }
}
