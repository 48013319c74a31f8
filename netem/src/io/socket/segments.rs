//! The datagrams in a transmit.

use quinn::udp::Transmit;

/// The datagrams in a transmit: one, or as many as the segment size makes of it.
pub(super) fn segments<'a>(transmit: &Transmit<'a>) -> impl Iterator<Item = &'a [u8]> {
    let contents = transmit.contents;
    let whole = contents.len().max(1);
    let size = transmit.segment_size.unwrap_or(whole).clamp(1, whole);
    // an empty datagram is one datagram too
    let empty = contents.is_empty().then_some(contents);
    contents.chunks(size).chain(empty)
}
