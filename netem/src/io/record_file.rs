//! Writes the record of a relay to a file on a thread of its own: the relay never waits for a disk.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;

use crate::record::{Entry, Heading, binary, csv};

/// Packets that may wait for the disk: 3 s at 20 000 packets a second. One more is missed and counted.
const WAITING_MAX: usize = 1 << 16;

/// A record being written.
#[derive(Debug)]
pub struct RecordFile {
    sender: Option<SyncSender<Entry>>,
    thread: Option<JoinHandle<io::Result<()>>>,
    missed: u64,
}

/// The form of a record.
enum Form {
    Csv,
    Binary(binary::Writer),
}

impl RecordFile {
    /// Creates the file, an older one of that name is overwritten. A name that ends in `.csv` makes it
    /// CSV, any other the binary form.
    ///
    /// # Errors
    /// The file cannot be written, or no thread is to be had.
    pub fn create(path: &Path, heading: &Heading) -> io::Result<Self> {
        let text = path.extension().is_some_and(|end| end == "csv");
        let mut file = BufWriter::new(File::create(path)?);
        let mut bytes = Vec::new();
        let form = match text {
            true => {
                bytes.extend_from_slice(csv::heading(heading).as_bytes());
                Form::Csv
            }
            false => {
                let mut writer = binary::Writer::default();
                writer.heading(&mut bytes, heading);
                Form::Binary(writer)
            }
        };
        file.write_all(&bytes)?;
        file.flush()?;
        let (sender, receiver) = sync_channel(WAITING_MAX);
        let thread = std::thread::Builder::new()
            .name("netem-record".to_owned())
            .spawn(move || write(file, form, &receiver))?;
        Ok(Self {
            sender: Some(sender),
            thread: Some(thread),
            missed: 0,
        })
    }

    /// Hands over a packet; never waits.
    pub(crate) fn push(&mut self, entry: Entry) {
        let sender = self.sender.as_ref();
        if sender.is_none_or(|sender| sender.try_send(entry).is_err()) {
            self.missed = self.missed.saturating_add(1);
        }
    }

    /// Packets that the record misses.
    #[must_use]
    pub fn missed(&self) -> u64 {
        self.missed
    }

    /// Waits until all is written.
    ///
    /// # Errors
    /// Those of the file.
    pub fn finish(mut self) -> io::Result<u64> {
        self.end().map(|()| self.missed)
    }

    fn end(&mut self) -> io::Result<()> {
        drop(self.sender.take());
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

fn write(mut file: BufWriter<File>, mut form: Form, entries: &Receiver<Entry>) -> io::Result<()> {
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
