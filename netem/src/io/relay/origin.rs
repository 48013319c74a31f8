//! Whose a datagram on a link of the relay is.

use quinn::udp::EcnCodepoint;

use super::port::Received;
use crate::capture::Sides;
use crate::io::driver::Datagram;

/// Whose datagram it is, and its DSCP in the place that it has in the traffic class.
#[derive(Clone, Debug)]
pub(super) struct Origin {
    pub(super) number: u64,
    pub(super) dscp: u8,
    /// Where it was sent and goes; kept for a capture only.
    pub(super) sides: Option<Box<Sides>>,
}

impl Origin {
    pub(super) fn sides(&self) -> Option<Sides> {
        self.sides.as_deref().copied()
    }
}

/// A datagram of this client, for the link.
pub(super) fn datagram(number: u64, received: &Received<'_>) -> Datagram<Origin> {
    Datagram {
        address: Origin {
            number,
            dscp: received.class & !3,
            sides: None,
        },
        ecn: EcnCodepoint::from_bits(received.class & 3),
        contents: received.contents.to_owned(),
    }
}
