//! Which of the tried values an architecture is run with at a delay: by the tuning seeds alone.

use super::choices::Choice;
use super::grid_point::GridPoint;
use super::limits::BREAKS_MAX;
use crate::architecture::DelayRow;
use crate::experiment::grid;

/// A value at a point with the rows of its seeds.
pub(super) type Tried = grid::Group<Choice, DelayRow>;

/// Mean relative error over the seeds; none if a run has none, since nothing was touched in it.
pub(super) fn error(tried: &Tried) -> Option<f64> {
    let all = tried.values(|row| row.relative_error).count() == tried.runs.len();
    tried.mean(|row| row.relative_error).filter(|_| all)
}

/// Whether contact is kept, by the median over the seeds; a run that completed no push counts as broken.
pub(super) fn keeps_contact(tried: &Tried) -> bool {
    let breaks = tried.median(|row| Some(row.breaks_per_push.unwrap_or(f64::MAX)));
    breaks.is_some_and(|breaks| breaks <= BREAKS_MAX)
}

/// The value with the least relative error among those that keep contact, among all where none does.
pub(super) fn best(tried: &[Tried], point: GridPoint) -> Option<Choice> {
    let worth = |tried: &&Tried| {
        let error = error(tried).unwrap_or(f64::MAX);
        (!keeps_contact(tried), error)
    };
    let here = tried.iter().filter(|tried| tried.case.point == point);
    let best = here.min_by(|a, b| {
        let ((a_broken, a), (b_broken, b)) = (worth(a), worth(b));
        a_broken.cmp(&b_broken).then(a.total_cmp(&b))
    });
    best.map(|best| best.case)
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::architecture::{self, ComparedArchitecture};

    #[test]
    fn the_least_error_is_chosen_among_the_values_that_keep_contact() {
        let point = GridPoint::plain(ComparedArchitecture::TDPA, 0);
        let world = point.world().unwrap();
        let row = architecture::run(
            ComparedArchitecture::TDPA,
            &world,
            Duration::from_millis(10),
        )
        .unwrap();
        let tried = |value: f64, error: Option<f64>, breaks: Option<f64>| Tried {
            case: Choice { point, value },
            runs: vec![DelayRow {
                relative_error: error,
                breaks_per_push: breaks,
                ..row
            }],
        };
        let broken = tried(1.0, Some(0.1), Some(2.5));
        let kept = tried(2.0, Some(0.3), Some(1.0));
        let worse = tried(3.0, Some(0.4), Some(1.0));
        let untouched = tried(4.0, None, None);
        let value = |tried: &[&Tried]| {
            let tried: Vec<Tried> = tried.iter().map(|tried| (*tried).clone()).collect();
            best(&tried, point).unwrap().value
        };
        assert_eq!(value(&[&broken, &worse, &kept, &untouched]), 2.0);
        assert_eq!(value(&[&untouched, &broken]), 1.0);
        let elsewhere = GridPoint::plain(ComparedArchitecture::TDPA, 5);
        assert_eq!(best(&[kept], elsewhere), None);
    }
}
