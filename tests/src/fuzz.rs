//! Fuzz targets: one for each decoder and file reader, and one for the state machine of a session.
//!
//! A target is a function of bytes that decodes them and asserts what must hold of whatever it accepts; that nothing panics is
//! the least of it. The same functions are run by the ordinary test `tests/fuzz.rs` and by `.ci/fuzz` at length. None
//! of them reads a clock or a file: an input that failed once fails again.
#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::panic,
    reason = "a target fails by panicking"
)]

use std::fmt::{self, Display, Write as _};

mod config;
mod device;
mod drive;
mod inputs;
mod link;
mod mutate;
mod numbers;
mod page;
mod plug;
mod record;
mod session;
mod text;
mod wire;

pub use drive::{Failure, Plan, Ran, Watch, drive, shown};
pub use mutate::Mutator;

/// What a target made of an input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Outcome {
    /// Whether the decoder took it.
    pub accepted: bool,
    /// What sort of thing it was, or why it was refused: an input with a mark that no other had is mutated further.
    pub mark: u64,
}

impl Outcome {
    /// It was taken; `sort` tells sorts of inputs apart.
    #[must_use]
    pub fn taken(sort: u64) -> Self {
        Self {
            accepted: true,
            mark: sort.wrapping_mul(2),
        }
    }

    /// It was refused for this reason; what stands between quotes in it does not count.
    #[must_use]
    pub fn refused(why: &dyn Display) -> Self {
        Self {
            accepted: false,
            mark: mark(why) | 1,
        }
    }

    /// What becomes of a result whose value was judged already.
    fn of<T>(result: Result<T, impl Display>) -> Self {
        match result {
            Ok(_) => Self::taken(0),
            Err(why) => Self::refused(&why),
        }
    }
}

/// Hashes the letters of a text outside of quotes, the first 64 of them, without memory.
struct Letters {
    hash: u64,
    left: u32,
    quoted: bool,
}

impl fmt::Write for Letters {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for byte in text.bytes() {
            if matches!(byte, b'"' | b'`' | b'\'') {
                self.quoted = !self.quoted;
            }
            if !self.quoted && byte.is_ascii_alphabetic() {
                if self.left == 0 {
                    return Ok(());
                }
                self.left -= 1;
                // FNV-1a
                self.hash = (self.hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
            }
        }
        Ok(())
    }
}

fn mark(why: &dyn Display) -> u64 {
    let mut letters = Letters {
        hash: 0xcbf2_9ce4_8422_2325,
        left: 64,
        quoted: false,
    };
    // hashing cannot fail, and what fails to show itself has no letters
    let _ = write!(letters, "{why}");
    letters.hash
}

/// A fuzz target.
#[derive(Clone, Copy)]
pub struct Target {
    /// Its name, also that of its folder in `tests/fuzz/corpus`.
    pub name: &'static str,
    /// What it decodes.
    pub about: &'static str,
    /// Decodes and judges an input.
    ///
    /// It panics where a promise does not hold.
    pub run: fn(&[u8]) -> Outcome,
    /// Inputs to begin with.
    pub seeds: fn() -> Vec<Vec<u8>>,
    /// Words that its inputs are made of.
    pub words: &'static [&'static str],
    /// The longest input, bytes.
    pub longest: usize,
    /// Its share of the inputs of all decoders, in thousandths; 0 of the session, which is counted by itself.
    pub share: u32,
    /// Memory that it may take at once beyond 64 times the length of its input, kB.
    pub room_kb: u64,
}

/// A target with the usual bounds.
const fn target(
    name: &'static str,
    about: &'static str,
    run: fn(&[u8]) -> Outcome,
    seeds: fn() -> Vec<Vec<u8>>,
) -> Target {
    Target {
        name,
        about,
        run,
        seeds,
        words: &[],
        longest: 1100,
        share: 40,
        room_kb: 1024,
    }
}

impl Target {
    const fn words(mut self, words: &'static [&'static str]) -> Self {
        self.words = words;
        self
    }

    const fn longest(mut self, longest: usize) -> Self {
        self.longest = longest;
        self
    }

    const fn share(mut self, share: u32) -> Self {
        self.share = share;
        self
    }

    const fn room_kb(mut self, room_kb: u64) -> Self {
        self.room_kb = room_kb;
        self
    }

    /// The target of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        TARGETS.iter().find(|target| target.name == name).copied()
    }

    /// Whether its inputs are sequences of operations on a session, not bytes of a decoder.
    #[must_use]
    pub fn is_session(&self) -> bool {
        self.share == 0
    }
}

/// All targets, the session's last.
#[rustfmt::skip]
pub const TARGETS: &[Target] = &[
    target("datagram", "messages in datagrams", wire::datagram, inputs::datagrams).share(200),
    target("stream", "hello, welcome, refusal, farewell", wire::stream, inputs::stream_messages).longest(4200).share(120),
    target("report", "the report in a farewell", wire::report, inputs::reports).words(inputs::REPORT_WORDS).longest(4096).share(10),
    target("device-packet", "packets of a plugged device", plug::device, inputs::device_packets).share(80),
    target("plant-packet", "packets of a plugged plant", plug::plant, inputs::plant_packets).share(80),
    target("inverse3", "frames of an Inverse3", device::inverse3, inputs::inverse3).words(inputs::INVERSE3_WORDS).longest(2048).share(40),
    target("two-diy", "frames of a 2DIY", device::two_diy, inputs::two_diy).share(60),
    target("page", "messages of the console's page", page::page, inputs::pages).words(inputs::PAGE_WORDS).longest(2048).share(50),
    target("pairing", "pairing strings, addresses, pins, tokens", text::pairing, inputs::pairings).words(inputs::PAIRING_WORDS).longest(400).share(60),
    target("words", "schemes, repeats, stretches, shards", text::words, inputs::words).words(inputs::SCHEME_WORDS).longest(80).share(50),
    target("link-words", "networks in words, and what they do to packets", link::words, inputs::link_words).words(inputs::LINK_WORDS).longest(400).share(30).room_kb(4096),
    target("trace", "recorded paths: irtt, ping, LENS, our own", link::trace, inputs::traces).words(inputs::TRACE_WORDS).longest(3000).share(40).room_kb(32 << 10),
    target("opportunities", "traces of mahimahi", link::opportunities, inputs::opportunities).words(inputs::NUMBER_WORDS).longest(400).share(30),
    target("distribution", "tables and measured distributions of delay", link::distribution, inputs::distributions).words(inputs::NUMBER_WORDS).longest(400).share(30),
    target("capture", "pcap and pcapng, and two captures of a path", link::capture, inputs::captures).longest(4096).share(30).room_kb(1024),
    target("packet-record", "records of packets, CSV and binary", link::packet_record, inputs::packet_records).words(inputs::RECORD_WORDS).longest(2048).share(30).room_kb(1024),
    target("pushes", "recorded pushes", text::pushes, inputs::pushes).words(inputs::NUMBER_WORDS).longest(2048).share(30),
    target("path", "tool paths in CSV", text::path, inputs::paths).words(inputs::NUMBER_WORDS).longest(600).share(30),
    target("identity", "identity files", text::identity, inputs::identities).words(inputs::IDENTITY_WORDS).longest(2048).share(4),
    target("message", "messages of a record", record::message, inputs::messages).longest(1500).share(60),
    target("record", "records: MCAP, tables, report", record::file, inputs::records).longest(16_000).share(5).room_kb(64 << 10),
    target("recorded-session", "a recorded session, run again and checked", record::session, inputs::recorded_sessions).words(inputs::SETTING_WORDS).longest(12_000).share(5).room_kb(64 << 10),
    target("config", "configurations, all programs", config::layers, inputs::configs).words(inputs::CONFIG_WORDS).longest(2048).share(10).room_kb(64 << 10),
    target("plan", "plans of sweeps", config::plan, inputs::plans).words(inputs::CONFIG_WORDS).longest(4096).share(10).room_kb(64 << 10),
    target("scene", "scenes", config::scene, inputs::scenes).words(inputs::CONFIG_WORDS).longest(2048).share(20).room_kb(64 << 10),
    target("device-file", "files about a plugged device", config::device, inputs::device_files).words(inputs::DEVICE_WORDS).longest(600).share(10),
    target("sweep-part", "rows of a sweep that are done", config::sweep_part, inputs::sweep_parts).longest(2048).share(8).room_kb(1024),
    target("session", "operations on both ends of a session", session::sequence, session::seeds).longest(168).share(0).room_kb(64 << 10),
];
