//! The files that a relay writes while it runs: begun, and ended with what went wrong.

use std::io;
use std::path::Path;

use mmt_netem::io::capture_file::CaptureFile;
use mmt_netem::io::record_file::RecordFile;
use mmt_netem::record::Heading;

use crate::failure::Failure;

/// A record to be written.
///
/// # Errors
/// It cannot be.
pub(super) fn record_file(path: &Path, heading: &Heading) -> Result<RecordFile, Failure> {
    RecordFile::create(path, heading).map_err(|error| {
        let what = format!("cannot write the record {}: {error}", path.display());
        Failure::usage(what).remedy("give a path that can be written")
    })
}

/// A capture to be written.
///
/// # Errors
/// It cannot be.
pub(super) fn capture_file(path: &Path, heading: &Heading) -> Result<CaptureFile, Failure> {
    CaptureFile::create(path, heading).map_err(|error| {
        let what = format!("cannot write the capture {}: {error}", path.display());
        Failure::usage(what).remedy("give a path that can be written")
    })
}

/// Whether what this file should hold was written, if there was one.
///
/// # Errors
/// It was not.
pub(super) fn written(what: &str, finished: Option<io::Result<u64>>) -> Result<(), Failure> {
    let finished = finished.transpose();
    let failed = |error| Failure::failed(format!("the {what}: {error}"));
    finished.map(|_| ()).map_err(failed)
}
