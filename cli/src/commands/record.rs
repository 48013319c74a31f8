//! The record of a run: opened before the run begins, reported after its report.

use std::path::Path;

use mmt_shared::io::record::{RecordOutcome, Recorder};

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
            .remedy("give --record the path of a file in a folder that is there")
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
        let RecordOutcome { missed, error } = recorder.finish();
        let shown = recorder.path().display();
        if missed > 0 {
            note(format_args!(
                "the record {shown} misses {missed} inputs and events: the disk was too slow"
            ));
        }
        match error {
            None => Ok(()),
            Some(error) => Err(Failure::failed(format!(
                "the record {shown} is not whole: {error}"
            ))
            .remedy("see whether the disk is full; what was written opens up to there")),
        }
    }
}

impl Drop for Record {
    fn drop(&mut self) {
        // a run that failed reports why it failed, not its record
        if let Some(recorder) = self.0.take() {
            recorder.finish();
        }
    }
}
