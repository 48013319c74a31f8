//! What a record of a session keeps: messages by their topics, and the file that they make.

#![allow(
    clippy::disallowed_types,
    reason = "the writer of a record hands its bytes to nobody but a file"
)]

use std::io::{self, Write};
use std::sync::{Arc, Mutex};

use mmt_shared::io::record::RecordWriter;
use mmt_shared::record::cdr::CdrWriter;
use mmt_shared::record::messages::{Link, Loop, Message, Packet, Parameters, Reading, Stamp};

/// A message of a record behind its topic.
pub(super) type Topical = (&'static str, Vec<u8>);

/// Collects messages with their topics, and writes them into a record.
pub(super) struct Kept {
    messages: Vec<Topical>,
    out: RecordWriter,
    file: Memory,
}

impl Kept {
    pub(super) fn new() -> Self {
        let file = Memory::default();
        Self {
            messages: Vec::new(),
            out: RecordWriter::create(file.clone()),
            file,
        }
    }

    pub(super) fn put<M: Message>(&mut self, topic: &'static str, message: &M) {
        let mut bytes = CdrWriter::default();
        message.write(bytes.begin());
        self.messages.push((topic, bytes.message().to_vec()));
        self.out
            .put(topic, Stamp(1_700_000_000_000_000_000), message);
    }

    /// What else a record has.
    pub(super) fn put_standing(&mut self) {
        let (stamp, session) = (Stamp(1_700_000_000_123_456_789), 1);
        let packet = |direction: &str, number: u32, fate: &str| Packet {
            stamp: Stamp(stamp.0 + u64::from(number) * 1_000_000),
            session,
            direction: direction.to_owned(),
            number,
            sent_ns: u64::from(number) * 1_000_000,
            bytes: 60,
            kind: "command".to_owned(),
            update: 0,
            cause: String::new(),
            fate: fate.to_owned(),
        };
        self.put("/master/packets", &packet("up", 1, "sent"));
        self.put("/slave/packets", &packet("up", 1, "newest"));
        self.put(
            "/slave/parameters",
            &Parameters {
                stamp,
                session,
                m_kg: 0.7,
                b_ns_per_m: 3.0,
                c_n: 2.0,
                covariance: [f64::NAN; 9],
            },
        );
        let link = Link {
            stamp,
            session,
            rtt_ms: 12.0,
            up_expected: 10,
            up_received: 9,
            down_expected: 5,
            down_received: 5,
        };
        self.put("/master/link", &link);
        let about = Loop {
            stamp,
            session,
            ticks: 1000,
            skipped: 1,
            lateness_mean_us: 12.0,
            lateness_max_us: 99.0,
            missed: 0,
        };
        self.put("/slave/loop", &about);
        self.put(
            "/master/readings",
            &Reading {
                stamp,
                session,
                own_s: 1.5,
                x_m: 0.1,
                y_m: 0.2,
                held: true,
            },
        );
    }

    /// The messages, and the file.
    pub(super) fn finish(self) -> (Vec<Topical>, Vec<u8>) {
        assert_eq!(self.out.finish(), None);
        let bytes = self.file.0.lock().unwrap().clone();
        (self.messages, bytes)
    }
}

/// Where a record goes.
#[derive(Clone, Default)]
struct Memory(Arc<Mutex<Vec<u8>>>);

impl Write for Memory {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().unwrap().extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
