//! The record of a driver as a file.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use mmt_shared::io::output_file;
use mmt_shared::time::Time;

use super::file_thread::{FileThread, Queue};
use super::now;
use crate::record::{Entry, Heading, binary, csv, is_record};

/// Packets that may wait for the disk: 3 s at 20 000 packets a second. One more is missed and counted.
const WAITING_MAX: usize = 1 << 16;

/// A record being written.
#[derive(Debug)]
pub struct RecordFile {
    file: FileThread<Entry>,
    origin: Time,
}

/// What puts packets into a record; copies write into the same one.
#[derive(Clone, Debug)]
pub struct RecordWriter {
    queue: Queue<Entry>,
    origin: Time,
}

impl RecordWriter {
    /// Hands over a packet, with times of the drivers' clock; never waits.
    pub(super) fn push(&self, entry: Entry) {
        self.queue.push(entry.since(self.origin));
    }

    /// Packets that the record misses: the disk was too slow, or the record was finished before.
    #[must_use]
    pub fn missed(&self) -> u64 {
        self.queue.missed()
    }
}

/// The form of a record.
enum Form {
    Csv,
    Binary(binary::Writer),
}

impl RecordFile {
    /// Creates the file, an older record of that name is overwritten. A name that ends in `.csv` makes it
    /// CSV, any other the binary form. The times of the record count from now.
    ///
    /// # Errors
    /// The file cannot be written, something else is in it or writes it, or no thread is to be had.
    pub fn create(path: &Path, heading: &Heading) -> io::Result<Self> {
        let text = path.extension().is_some_and(|end| end == "csv");
        let mut file = BufWriter::new(output_file::create(path, is_record)?);
        let mut bytes = Vec::new();
        let form = if text {
            bytes.extend_from_slice(csv::heading(heading).as_bytes());
            Form::Csv
        } else {
            let mut writer = binary::Writer::default();
            writer.heading(&mut bytes, heading);
            Form::Binary(writer)
        };
        file.write_all(&bytes)?;
        file.flush()?;
        let write = move |entries: &mut dyn Iterator<Item = Entry>| write(file, form, entries);
        Ok(Self {
            file: FileThread::start("netem-record", WAITING_MAX, write)?,
            origin: now(),
        })
    }

    /// For a driver.
    #[must_use]
    pub fn writer(&self) -> RecordWriter {
        RecordWriter {
            queue: self.file.queue(),
            origin: self.origin,
        }
    }

    /// Waits until all that was put in so far is written; what comes later is missed. Returns how many
    /// packets the record misses.
    ///
    /// # Errors
    /// Those of the file.
    pub fn finish(self) -> io::Result<u64> {
        self.file.finish()
    }
}

fn write(
    mut file: BufWriter<File>,
    mut form: Form,
    entries: &mut dyn Iterator<Item = Entry>,
) -> io::Result<()> {
    let (mut text, mut bytes) = (String::new(), Vec::new());
    for entry in entries {
        match &mut form {
            Form::Csv => {
                text.clear();
                csv::push(&mut text, &entry);
                file.write_all(text.as_bytes())?;
            }
            Form::Binary(writer) => {
                bytes.clear();
                writer.push(&mut bytes, &entry);
                file.write_all(&bytes)?;
            }
        }
    }
    file.flush()
}
