//! The capture of a driver as a pcapng file: both sides of every packet, in the order of their times.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;
use std::time::{Duration, SystemTime};

use mmt_shared::io::output_file;
use mmt_shared::time::Time;

use super::file_thread::{FileThread, Queue};
use super::now;
use crate::capture::{Event, Writer, is_capture};
use crate::record::Heading;

/// Packets that may wait for the disk: 0.8 s at 20 000 packets a second. One more is missed and counted.
const WAITING_MAX: usize = 1 << 14;
/// A packet is written when its fate is known; so long the file waits for one that came before what it has. Behind a
/// longer delay the order of the file is not that of the times.
const HOLD: Duration = Duration::from_secs(2);
/// The most blocks that wait so.
const HELD_MAX: usize = 1 << 17;

/// A capture being written.
#[derive(Debug)]
pub struct CaptureFile(FileThread<Event>);

/// What puts packets into a capture; copies write into the same one.
#[derive(Clone, Debug)]
pub struct CaptureWriter(Queue<Event>);

impl CaptureWriter {
    /// Hands over a packet, with times of the drivers' clock; never waits.
    pub(super) fn push(&self, event: Event) {
        self.0.push(event);
    }

    /// Packets that the capture misses: the disk was too slow or full, or the capture was finished before.
    #[must_use]
    pub fn missed(&self) -> u64 {
        self.0.missed()
    }
}

impl CaptureFile {
    /// Creates the file, an older capture of that name is overwritten.
    ///
    /// # Errors
    /// The file cannot be written, something else is in it or writes it, or no thread is to be had.
    pub fn create(path: &Path, heading: &Heading) -> io::Result<Self> {
        let mut file = BufWriter::new(output_file::create(path, is_capture)?);
        file.write_all(&Writer::heading(heading))?;
        file.flush()?;
        let today = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
        let booted = now().saturating_since(Time::ZERO);
        let writer = Writer::new(today.unwrap_or_default().saturating_sub(booted));
        let write = move |events: &mut dyn Iterator<Item = Event>| write(file, writer, events);
        FileThread::start("netem-capture", WAITING_MAX, write).map(Self)
    }

    /// For a driver.
    #[must_use]
    pub fn writer(&self) -> CaptureWriter {
        CaptureWriter(self.0.queue())
    }

    /// Waits until all that was put in so far is written; what comes later is missed. Returns how many
    /// packets the capture misses.
    ///
    /// # Errors
    /// Those of the file.
    pub fn finish(self) -> io::Result<u64> {
        self.0.finish()
    }
}

fn write(
    mut file: BufWriter<File>,
    writer: Writer,
    events: &mut dyn Iterator<Item = Event>,
) -> io::Result<()> {
    let (mut held, mut newest) = (BinaryHeap::new(), Time::ZERO);
    for event in events {
        for block in writer.blocks(event) {
            newest = block.at.max(newest);
            held.push(Reverse(block));
        }
        let old = |at: Time| newest.saturating_since(at) > HOLD;
        while held.len() > HELD_MAX || held.peek().is_some_and(|Reverse(next)| old(next.at)) {
            let Some(Reverse(block)) = held.pop() else {
                break;
            };
            file.write_all(block.bytes())?;
        }
    }
    while let Some(Reverse(block)) = held.pop() {
        file.write_all(block.bytes())?;
    }
    file.flush()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capture::read;
    use crate::direction::Direction;
    use crate::record::{End, Entry};

    fn event(number: u64, came_ms: u64, took_ms: u64) -> Event {
        let offered = Time::from_millis(came_ms);
        let due = Time::from_millis(came_ms + took_ms);
        Event {
            entry: Entry {
                direction: Direction::Up,
                number,
                offered,
                bytes: 100,
                backlog: 0,
                end: End::Sent {
                    due,
                    sent: due,
                    copy: false,
                    corrupted: false,
                },
            },
            corrupted_bit: None,
            marked: false,
            sides: None,
            contents: vec![0x45; 100],
        }
    }

    #[test]
    fn packets_stand_in_the_order_of_their_times_whatever_their_delays() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("c.pcapng");
        let capture = CaptureFile::create(&path, &Heading::default()).unwrap();
        let writer = capture.writer();
        // by the time of leaving, as a driver has them
        let mut events: Vec<Event> = (0..5000_u64)
            .map(|n| event(n, n, 1500 - (n % 15) * 100))
            .collect();
        events.sort_by_key(|event| event.entry.offered);
        events.into_iter().for_each(|event| writer.push(event));
        assert_eq!(capture.finish().unwrap(), 0);
        let bytes = std::fs::read(&path).unwrap();
        let frames = read(&bytes).unwrap();
        assert_eq!(frames.len(), 10_000);
        assert!(frames.is_sorted_by_key(|frame| frame.at_ns));
    }

    #[test]
    fn a_full_disk_is_an_error_and_what_it_costs_is_counted() {
        let capture = CaptureFile::create(Path::new("/dev/full"), &Heading::default());
        assert_eq!(capture.unwrap_err().kind(), io::ErrorKind::StorageFull);
        let full = || Err(io::Error::from(io::ErrorKind::StorageFull));
        let capture = CaptureFile(FileThread::start("full", 4, move |_| full()).unwrap());
        let writer = capture.writer();
        (0..1000).for_each(|n| writer.push(event(n, n, 1)));
        assert!(writer.missed() >= 996, "{}", writer.missed());
        let error = capture.finish().unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::StorageFull);
    }
}
