//! What a record keeps, and what becomes of it when a disk is full, stands still, or is cut off.

use crate::record::messages::Stamp;
use std::fs::OpenOptions;
use std::os::unix::fs::OpenOptionsExt;
use std::path::PathBuf;

use super::*;
use crate::io::loop_thread::Frame;
use crate::io::schedule::Tick;
use crate::record::PROGRAM;
use crate::record::messages::{Arrival, Loop, Message, Packet};

/// An end that counts.
struct Counting;

impl Topics for Counting {
    const SIDE: Side = Side::Slave;
    type Given = ();
    type Done = u64;

    fn ticked(about: &TickAbout, _: &Ticked<(), u64>, out: &mut RecordWriter) {
        let message = Loop {
            stamp: about.stamp,
            session: about.session,
            ticks: about.index,
            skipped: 0,
            lateness_mean_us: 0.0,
            lateness_max_us: 0.0,
            missed: about.digest,
        };
        out.put("/slave/ticks", about.stamp, &message);
    }

    fn standard(_: Stamp, _: &u64, _: &mut RecordWriter) {}
}

fn session() -> Session {
    Session {
        stamp: Stamp(0),
        session: 0,
        program: PROGRAM.to_owned(),
        began_ns: 5,
        opening: vec![1, 2, 3],
        setting: "{}".to_owned(),
        configuration: "{}".to_owned(),
    }
}

fn ticked(n: u64) -> Ticked<(), u64> {
    Ticked {
        tick: Tick {
            index: n,
            deadline: Time::from_millis(n),
            skipped: 0,
            lateness: Duration::from_nanos(n),
        },
        given: (),
        sent: Time::from_millis(n),
        done: n,
    }
}

/// A record of so many ticks, each with a datagram each way.
fn record(path: &Path, ticks: u64) -> RecordOutcome {
    let recorder = Recorder::create(path).unwrap();
    let wall = Wall::of(Stamp(1_000), Time::ZERO);
    let mut sink = recorder.begin::<Counting>(wall, session());
    for n in 0..ticks {
        sink.arrived(&Frame::new(Time::from_millis(n), b"in"));
        sink.ticked(ticked(n));
        sink.sent(Time::from_millis(n), b"out");
    }
    recorder.finish()
}

/// Topic and bytes of each message, and how the file ended.
fn messages(path: &Path) -> (Vec<(String, Vec<u8>)>, Ended) {
    let mut found = Vec::new();
    let ended = read::<RecordError>(path, |topic, message| {
        found.push((topic.to_owned(), message.to_vec()));
        Ok(())
    });
    (found, ended.unwrap())
}

fn place() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    (folder, path)
}

#[test]
fn what_a_loop_leaves_is_read_back_in_its_order_and_gives_the_same_bytes_each_time() {
    let (folder, path) = place();
    assert_eq!(record(&path, 10), RecordOutcome::default());
    let (found, ended) = messages(&path);
    assert_eq!(ended, Ended::Whole);
    assert_eq!(found.len(), 1 + 4 * 10);
    let (topic, first) = found.first().unwrap();
    let first = Session::read(first).unwrap();
    assert_eq!((topic.as_str(), first.session), ("/slave/session", 1));
    assert_eq!(
        first.stamp,
        Stamp(1_005),
        "5 ns after the wall clock's moment"
    );
    let arrivals = found.iter().filter(|(topic, _)| topic == "/slave/arrivals");
    let arrivals: Vec<_> = arrivals
        .map(|(_, message)| Arrival::read(message).unwrap())
        .collect();
    let indices: Vec<u64> = arrivals.iter().map(|arrival| arrival.index).collect();
    assert_eq!(indices, (0..20).step_by(2).collect::<Vec<_>>());
    assert!(arrivals.iter().all(|arrival| arrival.datagram == b"in"));
    let packets = found.iter().filter(|(topic, _)| topic == "/slave/packets");
    let fates: Vec<String> = packets
        .map(|(_, message)| Packet::read(message).unwrap().fate)
        .collect();
    assert_eq!(fates.get(..2).unwrap(), ["malformed", "sent"]);
    let again = folder.path().join("b.mcap");
    record(&again, 10);
    assert_eq!(std::fs::read(path).unwrap(), std::fs::read(again).unwrap());
}

#[test]
fn a_record_that_is_cut_off_anywhere_reads_up_to_there_and_a_changed_byte_is_seen() {
    let (_folder, path) = place();
    record(&path, 1000);
    let whole = std::fs::read(&path).unwrap();
    let (all, _) = messages(&path);
    for part in [0.1, 0.5, 0.9] {
        let cut = (whole.len() as f64 * part) as usize;
        std::fs::write(&path, whole.get(..cut).unwrap()).unwrap();
        let (found, ended) = messages(&path);
        assert_eq!(ended, Ended::CutOff);
        assert!(found.len() > (all.len() as f64 * part * 0.5) as usize);
        assert_eq!(found, all.get(..found.len()).unwrap());
    }
    let mut changed = whole.clone();
    let middle = changed.len() / 3;
    changed[middle] ^= 1;
    std::fs::write(&path, changed).unwrap();
    assert!(read::<RecordError>(&path, |_, _| Ok(())).is_err());
    std::fs::write(&path, b"0 1 2").unwrap();
    assert!(!is_record(&path).unwrap());
    std::fs::write(&path, whole).unwrap();
    assert!(is_record(&path).unwrap());
}

#[test]
fn a_full_disk_is_reported_and_stops_nobody() {
    let outcome = record(Path::new("/dev/full"), 100);
    assert_eq!(outcome.missed, 0);
    let error = outcome.error.unwrap().to_string();
    assert!(error.contains("No space left"), "{error}");
}

#[test]
fn a_panic_of_the_thread_that_writes_is_reported_as_one() {
    let (_folder, path) = place();
    let recorder = Recorder::written_by(|_, _, _| panic!("on purpose"), &path).unwrap();
    assert_eq!(recorder.finish().error, Some(RecordFailure::Panicked));
}

#[test]
fn a_disk_that_stands_costs_parts_of_the_record_and_no_time_of_the_loop() {
    let (_folder, path) = place();
    let made = std::process::Command::new("mkfifo").arg(&path).status();
    assert!(made.unwrap().success());
    // somebody who opens the pipe and never reads from it
    let nobody = OpenOptions::new()
        .read(true)
        .custom_flags(libc::O_NONBLOCK)
        .open(&path)
        .unwrap();
    let recorder = Recorder::create(&path).unwrap();
    let wall = Wall::of(Stamp(0), Time::ZERO);
    let mut sink = recorder.begin::<Counting>(wall, session());
    let full = [7; 1000];
    let mut pushed = 0_u64;
    // until nothing more goes into the pipe, the chunk and the ring; no push ever waits
    while recorder.missed.load(Ordering::Relaxed) == 0 && pushed < 1_000_000 {
        sink.sent(Time::ZERO, &full);
        pushed += 1;
    }
    let outcome = recorder.finish();
    assert!(outcome.missed > 0 || outcome.error.is_some(), "{outcome:?}");
    assert_eq!(outcome.error, Some(RecordFailure::Slow));
    drop(nobody);
}

#[test]
fn a_gap_is_seen_in_the_numbers_of_the_inputs() {
    let missed = Arc::new(AtomicU64::new(0));
    let (mut sink, mut entries) = RecordSink::<(), u64>::with_room(2, Arc::clone(&missed));
    sink.ticked(ticked(0));
    sink.ticked(ticked(1));
    // not an input, and yet the digest of the next tick has it
    sink.sent(Time::ZERO, b"out");
    assert_eq!(missed.load(Ordering::Relaxed), 1);
    while entries.pop().is_ok() {}
    sink.ticked(ticked(2));
    let entry = entries.pop().unwrap();
    assert!(matches!(entry, sink::Entry::Ticked { index: 3, .. }));
}

#[test]
fn a_record_that_everybody_has_let_go_is_ended() {
    let (_folder, path) = place();
    let recorder = Recorder::create(&path).unwrap();
    drop(recorder);
    let end = Instant::now() + Duration::from_secs(60);
    while !read::<RecordError>(&path, |_, _| Ok(())).is_ok_and(|ended| ended == Ended::Whole) {
        assert!(Instant::now() < end);
        std::thread::sleep(REST);
    }
}

#[test]
fn a_length_that_only_the_file_has_costs_no_memory_and_no_message() {
    // magic; a schema whose name is 800 MB long; a channel; a message on it
    let record = |kind: u8, body: &[u8]| {
        let length = (body.len() as u64).to_le_bytes();
        [&[kind][..], &length, body].concat()
    };
    let schema = [&[1, 0][..], &800_000_000_u32.to_le_bytes(), b"name"].concat();
    let channel = [&[7, 0, 1, 0, 2, 0, 0, 0][..], b"/a", &[0; 8]].concat();
    let message = [&[7, 0][..], &[0; 20], b"sent"].concat();
    let file = [
        mcap::MAGIC.to_vec(),
        record(3, &schema),
        record(4, &channel),
        record(5, &message),
    ];
    let mut heard = Vec::new();
    let ended = read_from::<RecordError>(file.concat().as_slice(), 1 << 20, |topic, message| {
        heard.push((topic.to_owned(), message.to_vec()));
        Ok(())
    });
    assert_eq!(ended.unwrap(), Ended::CutOff);
    assert_eq!(heard, [("/a".to_owned(), b"sent".to_vec())]);
    // a chunk of one record, whose length is greater than the chunk's
    let inner = [&[5][..], &u64::MAX.to_le_bytes(), &message].concat();
    let length = (inner.len() as u64).to_le_bytes();
    let chunk = [&[0; 16][..], &length, &[0; 8], &length, &inner].concat();
    let file = [mcap::MAGIC.to_vec(), record(6, &chunk)].concat();
    let broken = read_from::<RecordError>(file.as_slice(), 1 << 20, |_, _| Ok(()));
    let broken = broken.unwrap_err().to_string();
    assert!(broken.contains("a chunk in it is malformed"), "{broken}");
    let short = [mcap::MAGIC.to_vec(), record(4, &channel[..9])].concat();
    let broken = read_from::<RecordError>(short.as_slice(), 1 << 20, |_, _| Ok(()));
    let broken = broken.unwrap_err().to_string();
    assert!(broken.contains("a channel in it is malformed"), "{broken}");
}
