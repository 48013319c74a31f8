//! Writes the record of a driver to a file on a thread of its own. A driver must never wait for a disk.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;

use mmt_shared::time::Time;

use super::now;
use crate::record::{Entry, Heading, binary, csv};

/// Packets that may wait for the disk: 3 s at 20 000 packets a second. One more is missed and counted.
const WAITING_MAX: usize = 1 << 16;

/// A record being written.
#[derive(Debug)]
pub struct RecordFile {
    writer: RecordWriter,
    thread: Option<JoinHandle<io::Result<()>>>,
}

/// What puts packets into a record; copies write into the same one.
#[derive(Clone, Debug)]
pub struct RecordWriter {
    /// None: the end of the record.
    sender: SyncSender<Option<Entry>>,
    missed: Arc<AtomicU64>,
    origin: Time,
}

impl RecordWriter {
    /// Hands over a packet, with times of the drivers' clock; never waits.
    pub(super) fn push(&self, entry: Entry) {
        let entry = entry.since(self.origin);
        if self.sender.try_send(Some(entry)).is_err() {
            self.missed.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Packets that the record misses: the disk was too slow, or the record was finished before.
    #[must_use]
    pub fn missed(&self) -> u64 {
        self.missed.load(Ordering::Relaxed)
    }
}

/// The form of a record.
enum Form {
    Csv,
    Binary(binary::Writer),
}

impl RecordFile {
    /// Creates the file, an older one of that name is overwritten. A name that ends in `.csv` makes it
    /// CSV, any other the binary form. The times of the record count from now.
    ///
    /// # Errors
    /// The file cannot be written, or no thread is to be had.
    pub fn create(path: &Path, heading: &Heading) -> io::Result<Self> {
        let text = path.extension().is_some_and(|end| end == "csv");
        let mut file = BufWriter::new(File::create(path)?);
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
        let (sender, receiver) = sync_channel(WAITING_MAX);
        let thread = std::thread::Builder::new()
            .name("netem-record".to_owned())
            .spawn(move || write(file, form, &receiver))?;
        let writer = RecordWriter {
            sender,
            missed: Arc::default(),
            origin: now(),
        };
        Ok(Self {
            writer,
            thread: Some(thread),
        })
    }

    /// For a driver.
    #[must_use]
    pub fn writer(&self) -> RecordWriter {
        self.writer.clone()
    }

    /// Waits until all that was put in so far is written; what comes later is missed. Returns how many
    /// packets the record misses.
    ///
    /// # Errors
    /// Those of the file.
    pub fn finish(mut self) -> io::Result<u64> {
        self.end().map(|()| self.writer.missed())
    }

    fn end(&mut self) -> io::Result<()> {
        // It fails only when the thread has ended with an error, which joining it returns.
        let _ = self.writer.sender.send(None);
        match self.thread.take().map(JoinHandle::join) {
            None => Ok(()),
            Some(Ok(written)) => written,
            Some(Err(_)) => Err(io::Error::other("the thread of the record panicked")),
        }
    }
}

impl Drop for RecordFile {
    fn drop(&mut self) {
        // Whoever wants to know the error calls `finish`.
        let _ = self.end();
    }
}

fn write(
    mut file: BufWriter<File>,
    mut form: Form,
    entries: &Receiver<Option<Entry>>,
) -> io::Result<()> {
    let (mut text, mut bytes) = (String::new(), Vec::new());
    while let Ok(Some(entry)) = entries.recv() {
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
