//! Cases together with what they measured, and how figure and tables pick from them.
//!
//! It never runs anything.

use super::{Case, Outcome, Stack};

/// A case and what it measured.
pub(super) type Run<'a> = (&'a Case, &'a Outcome);

/// The runs of one stack.
pub(super) fn of<'a>(runs: &[Run<'a>], stack: Stack) -> Vec<Run<'a>> {
    let runs = runs.iter().filter(|(case, _)| case.stack == stack);
    runs.copied().collect()
}

/// The largest of what some runs measured.
pub(super) fn largest<'a>(
    runs: impl IntoIterator<Item = Run<'a>>,
    of: impl Fn(&Outcome) -> Option<f64>,
) -> Option<f64> {
    let values = runs.into_iter().filter_map(|(_, outcome)| of(outcome));
    values.max_by(f64::total_cmp)
}
