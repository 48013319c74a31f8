//! Whatever a test of sessions is about: its sessions are recorded, and one that breaks a promise fails it.

#![allow(clippy::unwrap_used, reason = "a test may panic")]
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "starts a process, reads and writes files"
)]

use std::fs::File;
use std::path::Path;
use std::process::Command;

use mmt_shared::io::record::{RecordError, RecordWriter, read};
use mmt_shared::record::messages::{Arrival, MasterTick, Message, Session, SlaveTick, Stamp};

use crate::harness::in_real_time;
use crate::harness::judge::{Records, judge};
use crate::harness::process::PROGRAM;

#[test]
fn a_session_that_was_not_asked_for_its_record_is_judged_and_a_broken_promise_fails_its_test() {
    in_real_time(|| {
        let mut demo = Command::new(PROGRAM);
        demo.args(["demo", "--duration", "2s", "--json"]);
        let records = Records::of(&mut demo).unwrap();
        let output = demo.output().unwrap();
        assert!(output.status.success(), "{output:?}");
        let [record] = &records.files().unwrap()[..] else {
            unreachable!("one process, one record")
        };
        assert_eq!(judge(record), Ok(()));
        let ticks = with_other_digests(record);
        assert!(ticks > 1000, "{ticks} ticks of the slave");
        let broken = records.judge().unwrap_err();
        assert!(broken.contains("same-bits"), "{broken}");
    });
}

#[test]
fn sessions_of_a_demo_follow_one_another_though_each_has_a_clock_of_its_own() {
    in_real_time(|| {
        let folder = tempfile::tempdir().unwrap();
        let record = folder.path().join("demo.mcap");
        let mut demo = Command::new(PROGRAM);
        demo.args(["demo", "--duration", "2s", "--json", "--record"]);
        assert!(demo.arg(&record).output().unwrap().status.success());
        let messages = messages_of(&record);
        write_twice(&record, &messages, 3_000_000_000);
        assert_eq!(judge(&record), Ok(()));
        write_twice(&record, &messages, 1_000_000_000);
        let broken = judge(&record).unwrap_err();
        assert!(broken.contains("one-operator"), "{broken}");
    });
}

/// Writes a session twice, the second time with stamps that are so much later, ns, and the same times of its own clocks.
fn write_twice(record: &Path, messages: &[(String, Vec<u8>)], later_ns: u64) {
    fn later<M: Message>(
        out: &mut RecordWriter,
        topic: &'static str,
        message: &[u8],
        change: impl Fn(&mut M),
    ) {
        let mut message = M::read(message).unwrap();
        change(&mut message);
        out.put(topic, Stamp::default(), &message);
    }
    let mut out = RecordWriter::create(File::create(record).unwrap());
    for number in 0..2 {
        let by = later_ns * u64::from(number);
        for (topic, message) in messages {
            match &topic[..] {
                "/master/session" => {
                    later(&mut out, "/master/session", message, |of: &mut Session| {
                        of.session += number;
                        of.stamp.0 += by;
                    })
                }
                "/slave/session" => {
                    later(&mut out, "/slave/session", message, |of: &mut Session| {
                        of.session += number;
                        of.stamp.0 += by;
                    })
                }
                "/master/arrivals" => {
                    later(&mut out, "/master/arrivals", message, |of: &mut Arrival| {
                        of.session += number;
                    })
                }
                "/slave/arrivals" => {
                    later(&mut out, "/slave/arrivals", message, |of: &mut Arrival| {
                        of.session += number;
                    })
                }
                "/master/ticks" => {
                    later(&mut out, "/master/ticks", message, |of: &mut MasterTick| {
                        of.session += number;
                    })
                }
                "/slave/ticks" => later(&mut out, "/slave/ticks", message, |of: &mut SlaveTick| {
                    of.session += number;
                    of.stamp.0 += by;
                }),
                _ => {}
            }
        }
    }
    assert_eq!(out.finish(), None);
}

/// All messages of a record, each with its topic.
fn messages_of(record: &Path) -> Vec<(String, Vec<u8>)> {
    let mut messages = Vec::new();
    read(record, |topic, message| -> Result<(), RecordError> {
        messages.push((topic.to_owned(), message.to_vec()));
        Ok(())
    })
    .unwrap();
    messages
}

/// Writes a record anew, with a bit of each digest of the slave changed; how many there are.
fn with_other_digests(record: &Path) -> u32 {
    let messages = messages_of(record);
    let mut out = RecordWriter::create(File::create(record).unwrap());
    let mut ticks = 0;
    for (topic, message) in &messages {
        match &topic[..] {
            "/master/session" => put::<Session>(&mut out, "/master/session", message),
            "/slave/session" => put::<Session>(&mut out, "/slave/session", message),
            "/master/arrivals" => put::<Arrival>(&mut out, "/master/arrivals", message),
            "/slave/arrivals" => put::<Arrival>(&mut out, "/slave/arrivals", message),
            "/master/ticks" => put::<MasterTick>(&mut out, "/master/ticks", message),
            "/slave/ticks" => {
                let mut tick = SlaveTick::read(message).unwrap();
                tick.digest ^= 1;
                out.put("/slave/ticks", Stamp::default(), &tick);
                ticks += 1;
            }
            _ => {}
        }
    }
    assert_eq!(out.finish(), None);
    ticks
}

fn put<M: Message>(out: &mut RecordWriter, topic: &'static str, message: &[u8]) {
    out.put(topic, Stamp::default(), &M::read(message).unwrap());
}
