//! How a run is concluded: its report first, then all that went wrong, so that no error costs the report or another error.

use crate::failure::Failure;
use crate::output::note;

/// Shows each of these failures. They were tried in this order, the report's print first.
///
/// # Errors
/// The last of the failures; the others have been shown.
pub(super) fn conclude(
    tried: impl IntoIterator<Item = Result<(), Failure>>,
) -> Result<(), Failure> {
    let mut failures = tried.into_iter().filter_map(Result::err);
    let Some(mut last) = failures.next() else {
        return Ok(());
    };
    for failure in failures {
        note(&last);
        last = failure;
    }
    Err(last)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_is_tried_and_any_failure_is_one() {
        let failed = |what: &str| Err(Failure::failed(what));
        assert_eq!(conclude([Ok(()), Ok(())]), Ok(()));
        assert_eq!(conclude([failed("a"), Ok(())]), failed("a"));
        let mut left = 3;
        let tried = std::iter::from_fn(|| {
            left -= 1;
            (left >= 0).then(|| failed(&left.to_string()))
        });
        assert_eq!(conclude(tried), failed("0"));
        assert_eq!(left, -1);
    }
}
