//! The record of a run: opened before the run begins, reported after its report.

use std::fmt::Display;
use std::path::Path;

use mmt_shared::io::record::{RecordFailure, RecordOutcome, Recorder};

use crate::failure::Failure;
use crate::output::note;

/// A record of a run, if anybody wants one. However the run ends, what was left for the record is written.
#[derive(Debug)]
pub(super) struct Record(Option<Recorder>);

impl Record {
    /// Opens the file, before anything begins.
    ///
    /// # Errors
    /// It cannot be written.
    pub(super) fn start(path: Option<&Path>) -> Result<Self, Failure> {
        let Some(path) = path else {
            return Ok(Self(None));
        };
        let recorder = Recorder::create(path).map_err(|error| {
            Failure::usage(format!(
                "cannot write the record {}: {error}",
                path.display()
            ))
            .remedy("give --record a name that is free, or that of an older record, in a folder that is there")
        })?;
        Ok(Self(Some(recorder)))
    }

    /// For a host.
    pub(super) fn recorder(&self) -> Option<Recorder> {
        self.0.clone()
    }

    /// Waits until it is written.
    ///
    /// # Errors
    /// It could not be.
    pub(super) fn finish(mut self) -> Result<(), Failure> {
        let Some(recorder) = self.0.take() else {
            return Ok(());
        };
        judge(&recorder.path().display(), &recorder.finish())
    }
}

/// Whether a record is whole.
///
/// # Errors
/// It is not.
fn judge(shown: &impl Display, outcome: &RecordOutcome) -> Result<(), Failure> {
    let RecordOutcome { missed, error } = outcome;
    let panicked = *error == Some(RecordFailure::Panicked);
    if *missed > 0 && !panicked {
        note(format_args!(
            "the record {shown} misses {missed} inputs and events: the disk was too slow"
        ));
    }
    let Some(error) = error else { return Ok(()) };
    let remedy = if panicked {
        "this is a defect of mmt: please report it with what stands above; what was written opens up to there"
    } else {
        "see whether the disk is full; what was written opens up to there"
    };
    let failure = Failure::failed(format!("the record {shown} is not whole: {error}"));
    Err(failure.remedy(remedy))
}

impl Drop for Record {
    fn drop(&mut self) {
        // a run that failed reports why it failed, not its record
        if let Some(recorder) = self.0.take() {
            recorder.finish();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_of_the_thread_that_writes_is_a_defect_and_no_slow_disk() {
        let of = |error| {
            let missed = 3;
            judge(&"a.mcap", &RecordOutcome { missed, error })
        };
        assert_eq!(of(None), Ok(()));
        let shown = |failure| of(Some(failure)).unwrap_err().to_string();
        let panicked = shown(RecordFailure::Panicked);
        assert!(panicked.contains("panicked") && panicked.contains("a defect of mmt"));
        assert!(!panicked.contains("disk"), "{panicked}");
        assert!(shown(RecordFailure::Slow).contains("the disk took more than"));
    }
}
