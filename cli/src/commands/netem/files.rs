//! The files that packets are written to while a relay or a shell runs: begun before it, and ended with what went wrong.

use std::fmt::Display;
use std::path::Path;

use mmt_netem::io::capture_file::CaptureFile;
use mmt_netem::io::record_file::RecordFile;
use mmt_netem::io::relay::Extras;
use mmt_netem::record::Heading;

use crate::args::NetemFileArguments;
use crate::failure::Failure;

/// A record and a capture, where they are wanted.
pub(super) struct Files {
    record: Option<RecordFile>,
    capture: Option<CaptureFile>,
}

impl Files {
    /// Begins those that are asked for.
    ///
    /// # Errors
    /// One cannot be written.
    pub(super) fn begin(wanted: &NetemFileArguments, heading: &Heading) -> Result<Self, Failure> {
        let record = wanted.record.as_ref();
        let record = record.map(|path| record_file(path, heading));
        let capture = wanted.pcap.as_ref().map(|path| {
            let begun = CaptureFile::create(path, heading);
            begun.map_err(|error| cannot_write("capture", path, error))
        });
        Ok(Self {
            record: record.transpose()?,
            capture: capture.transpose()?,
        })
    }

    /// Where a relay or a tunnel writes what it sees.
    pub(super) fn extras(&self) -> Extras {
        Extras {
            record: self.record.as_ref().map(RecordFile::writer),
            capture: self.capture.as_ref().map(CaptureFile::writer),
            ..Extras::default()
        }
    }

    /// Ends them.
    ///
    /// # Errors
    /// One does not hold all that it should.
    pub(super) fn finish(self) -> Result<(), Failure> {
        let record = self.record.map(RecordFile::finish).transpose();
        let capture = self.capture.map(CaptureFile::finish).transpose();
        record.map_err(|error| Failure::failed(format!("the record: {error}")))?;
        capture.map_err(|error| Failure::failed(format!("the capture: {error}")))?;
        Ok(())
    }
}

/// A record to be written.
///
/// # Errors
/// It cannot be.
pub(super) fn record_file(path: &Path, heading: &Heading) -> Result<RecordFile, Failure> {
    let begun = RecordFile::create(path, heading);
    begun.map_err(|error| cannot_write("record", path, error))
}

fn cannot_write(what: &str, path: &Path, error: impl Display) -> Failure {
    let what = format!("cannot write the {what} {}: {error}", path.display());
    Failure::usage(what).remedy(
        "give a name that is free, or that of an older file of its kind, in a folder that is there",
    )
}
