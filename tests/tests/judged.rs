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

/// Writes a record anew, with a bit of each digest of the slave changed; how many there are.
fn with_other_digests(record: &Path) -> u32 {
    let mut messages = Vec::new();
    read(record, |topic, message| -> Result<(), RecordError> {
        messages.push((topic.to_owned(), message.to_vec()));
        Ok(())
    })
    .unwrap();
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
