//! The file of the path that a session met: claimed before the session begins, written after its report.

use std::fs::File;
use std::io::Write as _;
use std::path::Path;
use std::sync::PoisonError;

use mmt_client::io::SharedPath;
use mmt_netem::trace::mmt::{is_path, path_text};
use mmt_shared::io::output_file;

use crate::failure::Failure;

/// What an older path stays in until the session is over.
pub(super) struct PathFile {
    file: File,
    shown: String,
}

impl PathFile {
    /// The file, if anybody wants one.
    ///
    /// # Errors
    /// It cannot be written.
    pub(super) fn claim(path: Option<&Path>) -> Result<Option<Self>, Failure> {
        let Some(path) = path else { return Ok(None) };
        let shown = path.display().to_string();
        let file = output_file::claim(path, is_path).map_err(|error| {
            Failure::usage(format!("cannot write the path {shown}: {error}"))
                .remedy("give --record-path a name that is free, or that of an older path, in a folder that is there")
        })?;
        Ok(Some(Self { file, shown }))
    }

    /// Writes the path that the session met, to be met again as a trace.
    ///
    /// # Errors
    /// There is none, or the file cannot be written.
    pub(super) fn keep(mut self, path: &SharedPath) -> Result<(), Failure> {
        let shown = &self.shown;
        let met = path.lock().unwrap_or_else(PoisonError::into_inner).path();
        let path = met.map_err(|why| Failure::failed(format!("no path for {shown}: {why}")))?;
        let text = path_text(path.samples());
        let emptied = output_file::empty(&self.file);
        let written = emptied.and_then(|()| self.file.write_all(text.as_bytes()));
        written.map_err(|error| {
            Failure::failed(format!("cannot write the path {shown}: {error}"))
                .remedy("see whether the disk is full")
        })
    }
}
