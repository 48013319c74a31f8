//! Reads captures: pcap and pcapng, of any byte order and resolution.

use crate::trace::TraceError;

/// A captured packet.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame<'a> {
    /// When it was seen, ns since 1970 on the clock of its host.
    pub at_ns: i64,
    /// What its bytes begin with (tcpdump.org).
    pub link_type: u16,
    /// Its bytes.
    pub bytes: &'a [u8],
    /// Its comment; empty without one.
    pub comment: &'a str,
}

/// Bytes with the order in which their numbers are written.
#[derive(Clone, Copy)]
struct Numbers<'a> {
    bytes: &'a [u8],
    big: bool,
}

impl<'a> Numbers<'a> {
    fn u16(self, at: usize) -> Option<u16> {
        let bytes = *self.bytes.get(at..)?.first_chunk()?;
        Some(if self.big {
            u16::from_be_bytes(bytes)
        } else {
            u16::from_le_bytes(bytes)
        })
    }

    fn u32(self, at: usize) -> Option<u32> {
        let bytes = *self.bytes.get(at..)?.first_chunk()?;
        Some(if self.big {
            u32::from_be_bytes(bytes)
        } else {
            u32::from_le_bytes(bytes)
        })
    }

    fn length(self, at: usize) -> Option<usize> {
        self.u32(at).and_then(|length| usize::try_from(length).ok())
    }

    /// The value of the first option of this kind from `at` on.
    fn option(self, mut at: usize, kind: u16) -> Option<&'a [u8]> {
        loop {
            let (found, length) = (self.u16(at)?, usize::from(self.u16(at + 2)?));
            if found == kind {
                return self.bytes.get(at + 4..at + 4 + length);
            }
            if found == 0 {
                return None;
            }
            at += 4 + length.next_multiple_of(4);
        }
    }
}

/// Reads a capture: packets in the order of the file.
///
/// # Errors
/// The number of the packet from 1 (0: the heading) in the place of the line, and the reason.
pub fn read(bytes: &[u8]) -> Result<Vec<Frame<'_>>, TraceError> {
    let magic = bytes.first_chunk().copied().map(u32::from_be_bytes);
    match magic {
        Some(0x0a0d_0d0a) => pcapng(bytes),
        Some(0xa1b2_c3d4) => pcap(bytes, true, 1000),
        Some(0xd4c3_b2a1) => pcap(bytes, false, 1000),
        Some(0xa1b2_3c4d) => pcap(bytes, true, 1),
        Some(0x4d3c_b2a1) => pcap(bytes, false, 1),
        _ => Err(TraceError::at(0, "neither pcap nor pcapng")),
    }
}

/// Whole packets only: those of two captures are compared byte by byte.
fn whole(at: usize, captured: usize, original: usize) -> Result<(), TraceError> {
    if captured < original {
        let why =
            "the packet was cut short when it was captured: capture whole ones (tcpdump -s 0)";
        return Err(TraceError::at(at, why));
    }
    Ok(())
}

fn pcap(bytes: &[u8], big: bool, unit_ns: i64) -> Result<Vec<Frame<'_>>, TraceError> {
    let file = Numbers { bytes, big };
    let link_type = file
        .u32(20)
        .ok_or_else(|| TraceError::at(0, "the heading is cut off"))?;
    let (mut frames, mut at) = (Vec::new(), 24);
    // a capture that was broken off ends within a packet
    while let (Some(s), Some(part), Some(captured), Some(original)) = (
        file.u32(at),
        file.u32(at + 4),
        file.length(at + 8),
        file.length(at + 12),
    ) {
        whole(frames.len() + 1, captured, original)?;
        let begin = at + 16;
        let Some(packet) = bytes.get(begin..begin.saturating_add(captured)) else {
            break;
        };
        frames.push(Frame {
            at_ns: i64::from(s) * 1_000_000_000 + i64::from(part) * unit_ns,
            link_type: link_type as u16,
            bytes: packet,
            comment: "",
        });
        at = begin + captured;
    }
    Ok(frames)
}

/// What an interface of a pcapng section gives its packets.
struct Interface {
    link_type: u16,
    /// The resolution of its times as the option has it.
    resolution: u8,
}

impl Interface {
    fn nanos(&self, high: u32, low: u32) -> i64 {
        let units = u128::from(high) << 32 | u128::from(low);
        let power = u32::from(self.resolution & 0x7f);
        let per_s = if self.resolution & 0x80 == 0 {
            10_u128.checked_pow(power)
        } else {
            1_u128.checked_shl(power)
        };
        let per_s = per_s.unwrap_or(u128::MAX).max(1);
        let nanos = units.saturating_mul(1_000_000_000) / per_s;
        i64::try_from(nanos).unwrap_or(i64::MAX)
    }
}

fn pcapng(bytes: &[u8]) -> Result<Vec<Frame<'_>>, TraceError> {
    let (mut frames, mut interfaces) = (Vec::new(), Vec::new());
    let (mut at, mut big) = (0, false);
    while let Some(head) = bytes.get(at..) {
        if head.starts_with(&[0x0a, 0x0d, 0x0d, 0x0a]) {
            big = head.get(8..12) == Some(&[0x1a, 0x2b, 0x3c, 0x4d]);
            interfaces.clear();
        }
        let file = Numbers { bytes: head, big };
        let (Some(kind), Some(length)) = (file.u32(0), file.length(4)) else {
            break;
        };
        let Some(block) = head.get(..length).filter(|_| length >= 12) else {
            break;
        };
        let block = Numbers { bytes: block, big };
        if kind == 1 {
            let resolution = block.option(16, 9).and_then(<[u8]>::first);
            interfaces.push(Interface {
                link_type: block.u16(8).unwrap_or(0),
                resolution: resolution.copied().unwrap_or(6),
            });
        } else if kind == 6 {
            let wrong = || TraceError::at(frames.len() + 1, "the packet is cut off or none");
            let frame = packet(block, &interfaces, frames.len() + 1)?.ok_or_else(wrong)?;
            frames.push(frame);
        }
        at += length;
    }
    Ok(frames)
}

/// The packet of an enhanced packet block.
fn packet<'a>(
    block: Numbers<'a>,
    interfaces: &[Interface],
    number: usize,
) -> Result<Option<Frame<'a>>, TraceError> {
    let (Some(captured), Some(original)) = (block.length(20), block.length(24)) else {
        return Ok(None);
    };
    whole(number, captured, original)?;
    let frame = || {
        let interface = interfaces.get(block.length(8)?)?;
        let end = 28_usize.saturating_add(captured);
        let comment = block.option(end.next_multiple_of(4), 1).unwrap_or_default();
        Some(Frame {
            at_ns: interface.nanos(block.u32(12)?, block.u32(16)?),
            link_type: interface.link_type,
            bytes: block.bytes.get(28..end)?,
            comment: std::str::from_utf8(comment).unwrap_or_default(),
        })
    };
    Ok(frame())
}
