//! What values have in common: their mean, their spread, their median and their quantiles, each computed here only.
//!
//! Of values that are at hand. `histogram` has the quantiles of what fills while the system runs.

/// `sum / n`; none where n is 0.
#[must_use]
pub fn mean_of_sum(sum: f64, n: u64) -> Option<f64> {
    (n > 0).then(|| sum / n as f64)
}

/// The mean; none without values.
#[must_use]
pub fn mean(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    // a sum begins with minus zero, as that of the standard library
    let add = |(sum, n), value| (sum + value, n + 1);
    let (sum, n) = values.into_iter().fold((-0.0, 0), add);
    mean_of_sum(sum, n)
}

/// The standard deviation about the mean of all there are (their number divides, not one less); none without values.
#[must_use]
pub fn standard_deviation(values: &[f64]) -> Option<f64> {
    let about = mean(values.iter().copied())?;
    rms(values.iter().map(|value| value - about))
}

/// The root of the mean square; none without values.
#[must_use]
pub fn rms(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    mean(values.into_iter().map(|value| value * value)).map(f64::sqrt)
}

/// The median; none without values.
#[must_use]
pub fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_by(f64::total_cmp);
    let upper = *values.get(values.len() / 2)?;
    let lower = *values.get((values.len() - 1) / 2)?;
    Some(f64::midpoint(lower, upper))
}

/// The quantile by nearest rank: the least of rising values that a share (0 to 1) of all does not exceed; of none of them
/// the least. None without values.
#[must_use]
pub fn quantile<T: Copy>(sorted: &[T], share: f64) -> Option<T> {
    let rank = (share * sorted.len() as f64).ceil() as usize;
    sorted.get(rank.clamp(1, sorted.len().max(1)) - 1).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_values_there_is_none_of_them() {
        assert_eq!((mean([]), median([]), rms([])), (None, None, None));
        assert_eq!((mean_of_sum(1.0, 0), standard_deviation(&[])), (None, None));
        assert_eq!(quantile::<f64>(&[], 0.5), None);
    }

    #[test]
    fn mean_and_spread_of_a_hand_computed_case() {
        let values = [2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0];
        assert_eq!(mean(values), Some(5.0));
        assert_eq!(standard_deviation(&values), Some(2.0));
        assert_eq!(rms([3.0, -3.0]), Some(3.0));
    }

    /// What is frozen to the bit was summed by the standard library.
    #[test]
    fn a_mean_has_the_bits_of_the_sum_of_the_standard_library() {
        let values: Vec<f64> = (1..1000).map(|k| 1.0 / f64::from(k)).collect();
        let expected = values.iter().sum::<f64>() / 999.0;
        let found = mean(values.iter().copied()).unwrap();
        assert_eq!(found.to_bits(), expected.to_bits());
    }

    #[test]
    fn the_median_of_an_even_number_is_the_middle() {
        assert_eq!(median([4.0, 1.0, 3.0, 2.0]), Some(2.5));
        assert_eq!(median([4.0, 1.0, 3.0]), Some(3.0));
    }

    #[test]
    fn a_quantile_is_the_least_value_that_the_share_does_not_exceed() {
        let hundred: Vec<u32> = (1..=100).collect();
        let of = |share| quantile(&hundred, share);
        assert_eq!(
            (of(0.0), of(0.5), of(0.99), of(1.0)),
            (Some(1), Some(50), Some(99), Some(100))
        );
        assert_eq!(quantile(&[7, 8, 9], 0.5), Some(8));
        // by whole numbers: no share is rounded over a value
        for n in 1..2000_usize {
            let ranks: Vec<usize> = (1..=n).collect();
            for percent in [50, 99] {
                let share = percent as f64 / 100.0;
                let rank = (n * percent).div_ceil(100);
                assert_eq!(quantile(&ranks, share), Some(rank), "{percent} of {n}");
            }
        }
    }
}
