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

mod config;
mod device;
mod drive;
mod inputs;
mod link;
mod mutate;
mod numbers;
mod outcome;
mod page;
mod plug;
mod record;
mod session;
mod target;
mod text;
mod wire;

pub use drive::{Failure, Plan, Ran, Watch, drive, shown};
pub use mutate::Mutator;
pub use outcome::Outcome;
pub use target::Target;
use target::target;

impl Target {
    /// The target of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        TARGETS.iter().find(|target| target.name == name).copied()
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
