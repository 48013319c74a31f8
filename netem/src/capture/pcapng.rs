//! What a link did to each packet, as pcapng (draft-ietf-opsawg-pcapng): the packet as it came and as it left, its fate as
//! a comment.
//!
//! Blocks are in little endian, times in ns since 1970, packets begin with their IP header.

use std::net::SocketAddr;
use std::time::Duration;

use mmt_shared::time::Time;

use super::frame::udp;
use crate::packet::flip_bit;
use crate::record::{End, Entry, Heading};

/// Packets that begin with their IP header (`LINKTYPE_RAW`).
const RAW_IP: u16 = 101;
const SECTION: u32 = 0x0a0d_0d0a;
const INTERFACE: u32 = 1;
const PACKET: u32 = 6;
const END: u16 = 0;
const COMMENT: u16 = 1;
const NAME: u16 = 2;
const RESOLUTION: u16 = 9;
const APPLICATION: u16 = 4;
/// 10^-9 s.
const NANOSECONDS: u8 = 9;

/// The interfaces in their order: each side of each direction.
const INTERFACES: [&str; 4] = ["up in", "up out", "down in", "down out"];

/// Between which addresses a datagram goes before and behind the link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sides {
    /// Where it comes from and where it was sent to.
    pub came: [SocketAddr; 2],
    /// The same of what leaves.
    pub leaves: [SocketAddr; 2],
    /// DSCP and ECN in the traffic class with which it came.
    pub class: u8,
}

impl Sides {
    /// The same for an answer: it comes from where the other one goes to.
    #[must_use]
    pub fn turned(self) -> Self {
        let turned = |[from, to]: [SocketAddr; 2]| [to, from];
        Self {
            came: turned(self.leaves),
            leaves: turned(self.came),
            ..self
        }
    }
}

/// What became of a packet, with the packet.
#[derive(Clone, Debug)]
pub struct Event {
    /// Its fate.
    pub entry: Entry,
    /// The bit that was turned over.
    pub corrupted_bit: Option<u64>,
    /// Whether it left marked as having met congestion.
    pub marked: bool,
    /// Its addresses; none: it has its IP header itself.
    pub sides: Option<Sides>,
    /// The packet as it left.
    pub contents: Vec<u8>,
}

/// A packet block.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Block {
    /// When it was seen, on the clock of the records.
    pub at: Time,
    bytes: Vec<u8>,
}

/// Makes blocks.
#[derive(Clone, Copy, Debug)]
pub struct Writer {
    /// The time since 1970 at the zero of the records' clock.
    epoch: Duration,
}

/// Whether bytes begin as a capture does.
#[must_use]
pub fn is_capture(head: &[u8]) -> bool {
    head.starts_with(&SECTION.to_le_bytes())
}

impl Writer {
    /// `epoch`: the time since 1970 at [`Time::ZERO`].
    #[must_use]
    pub fn new(epoch: Duration) -> Self {
        Self { epoch }
    }

    /// The bytes before the first packet.
    #[must_use]
    pub fn heading(heading: &Heading) -> Vec<u8> {
        let Heading { seed, up, down } = heading;
        let comment = format!("seed {seed}, up: {up}, down: {down}");
        let mut section = 0x1a2b_3c4d_u32.to_le_bytes().to_vec();
        // version 1.0, a section of unknown length
        section.extend([1, 0, 0, 0]);
        section.extend([0xff; 8]);
        option(&mut section, COMMENT, comment.as_bytes());
        let version = concat!("mmt netem ", env!("CARGO_PKG_VERSION"));
        option(&mut section, APPLICATION, version.as_bytes());
        option(&mut section, END, &[]);
        let mut bytes = block(SECTION, &section);
        for name in INTERFACES {
            let mut interface = RAW_IP.to_le_bytes().to_vec();
            // reserved; no limit of length
            interface.extend([0; 6]);
            option(&mut interface, NAME, name.as_bytes());
            option(&mut interface, RESOLUTION, &[NANOSECONDS]);
            option(&mut interface, END, &[]);
            bytes.extend(block(INTERFACE, &interface));
        }
        bytes
    }

    /// The blocks of a packet: as it came, unless it is a copy, and as it left, if it did.
    #[must_use]
    pub fn blocks(&self, mut event: Event) -> Vec<Block> {
        let (name, entry) = (event.entry.direction.name(), event.entry);
        let (number, mut blocks) = (entry.number, Vec::new());
        let interface = match entry.direction {
            crate::Direction::Up => 0,
            crate::Direction::Down => 2,
        };
        let (fate, is_copy) = fate(&event);
        if let End::Sent { sent, .. } = entry.end {
            let frame = frame(&event, |sides| sides.leaves, event.marked);
            let comment = format!("{name} {number}: {fate}");
            blocks.push(self.block(sent, interface + 1, &frame, &comment));
        }
        if !is_copy {
            if let Some(bit) = event.corrupted_bit {
                flip_bit(&mut event.contents, bit);
            }
            let frame = frame(&event, |sides| sides.came, false);
            let comment = format!("{name} {number}: {fate}");
            blocks.push(self.block(entry.offered, interface, &frame, &comment));
        }
        blocks
    }

    fn block(&self, at: Time, interface: u32, frame: &[u8], comment: &str) -> Block {
        let since_epoch = self.epoch + at.saturating_since(Time::ZERO);
        let nanos = u64::try_from(since_epoch.as_nanos()).unwrap_or(u64::MAX);
        let length = u32::try_from(frame.len()).unwrap_or(u32::MAX);
        let (high, low) = ((nanos >> 32) as u32, nanos as u32);
        let mut body = Vec::with_capacity(frame.len() + comment.len() + 64);
        for word in [interface, high, low, length, length] {
            body.extend(word.to_le_bytes());
        }
        padded(&mut body, frame);
        option(&mut body, COMMENT, comment.as_bytes());
        option(&mut body, END, &[]);
        let bytes = block(PACKET, &body);
        Block { at, bytes }
    }
}

impl Block {
    /// As it stands in the file.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }
}

/// The packet with its headers on one side of the link.
fn frame(event: &Event, side: fn(&Sides) -> [SocketAddr; 2], marked: bool) -> Vec<u8> {
    let Some(sides) = &event.sides else {
        return event.contents.clone();
    };
    let class = if marked { sides.class | 3 } else { sides.class };
    udp(side(sides), class, &event.contents)
}

/// The fate in words, and whether it is that of a copy.
fn fate(event: &Event) -> (String, bool) {
    let ms = |time: Duration| time.as_secs_f64() * 1e3;
    let entry = &event.entry;
    match entry.end {
        End::Dropped(cause) => (format!("lost ({})", cause.name()), false),
        End::Unsent => ("not sent (socket)".to_owned(), false),
        End::Sent {
            due, sent, copy, ..
        } => {
            let delay = ms(sent.saturating_since(entry.offered));
            let late = ms(sent.saturating_since(due));
            let mut fate = format!("delayed {delay:.6} ms, of that {late:.6} ms by the host");
            if copy {
                fate.push_str(", a copy");
            }
            if let Some(bit) = event.corrupted_bit {
                fate.push_str(&format!(", corrupted (bit {bit})"));
            }
            if event.marked {
                fate.push_str(", marked (ECN)");
            }
            (fate, copy)
        }
    }
}

fn block(kind: u32, body: &[u8]) -> Vec<u8> {
    let length = u32::try_from(body.len() + 12).unwrap_or(u32::MAX);
    let mut bytes = kind.to_le_bytes().to_vec();
    bytes.extend(length.to_le_bytes());
    bytes.extend(body);
    bytes.extend(length.to_le_bytes());
    bytes
}

fn option(bytes: &mut Vec<u8>, code: u16, value: &[u8]) {
    let value = value.get(..usize::from(u16::MAX)).unwrap_or(value);
    bytes.extend(code.to_le_bytes());
    bytes.extend((value.len() as u16).to_le_bytes());
    padded(bytes, value);
}

/// Adds bytes, and zeros up to a multiple of four.
fn padded(bytes: &mut Vec<u8>, value: &[u8]) {
    bytes.extend(value);
    bytes.resize(bytes.len().next_multiple_of(4), 0);
}
