//! The messages between the two sides of a bilateral architecture, and their length in bytes.
//!
//! Typed messages for virtual time: they never meet a socket, so there is a size and no encoding. A message must
//! never carry what its architecture does not use: sizes are compared.

use super::Baseline;
use super::wave::WaveSum;
use mmt_shared::model::sample::{ForceCounts, HipSample};
use mmt_shared::time::Time;
use mmt_shared::wire::HEADER_BYTES;

/// Bytes around the payload of one datagram over IPv4: IP 20 (RFC 791), UDP 8 (RFC 768), QUIC's short header 11
/// (flags 1, connection ID 8, packet number 2: RFC 9000, 17.3.1), type and length of the DATAGRAM frame 3 (RFC 9221, 4),
/// authentication tag 16 (RFC 9001, 5.3).
pub const OVERHEAD_BYTES: usize = 20 + 8 + 11 + 3 + 16;

/// A stamp.
const STAMP_BYTES: usize = 8;
/// Two coordinates or two components of a force, four bytes each.
const POINT_BYTES: usize = 8;
/// An energy.
const ENERGY_BYTES: usize = 8;
/// A wave's integral, two numbers, and its energy.
const WAVE_BYTES: usize = 24;

/// From the master, every tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToSlave {
    /// Stamp, HIP, and the force that was displayed for it, which metrics need and nobody obeys.
    pub sample: HipSample,
    /// E_in of the master's port, J; used by TDPA.
    pub in_j: f64,
    /// u so far; used by wave variables.
    pub wave: WaveSum,
}

/// From the slave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToMaster {
    /// The slave's time of sending.
    pub sent: Time,
    /// f_s, N on the object.
    pub force: ForceCounts,
    /// E_in of the slave's port, J; used by TDPA.
    pub in_j: f64,
    /// w so far; used by wave variables.
    pub wave: WaveSum,
}

/// Bytes of one message of an architecture on the wire, all headers included; both directions are alike, since a
/// point is as long as a force. The force for the metrics is not counted.
#[must_use]
pub const fn wire_bytes(baseline: Baseline) -> usize {
    let payload = match baseline {
        Baseline::PositionForce | Baseline::DampedPositionForce | Baseline::DeadbandForce => {
            POINT_BYTES
        }
        Baseline::Tdpa | Baseline::TdpaDeadband => POINT_BYTES + ENERGY_BYTES,
        Baseline::Waves => WAVE_BYTES,
    };
    OVERHEAD_BYTES + HEADER_BYTES + STAMP_BYTES + payload
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_those_of_the_fields_that_are_used() {
        let bytes = Baseline::ALL.map(wire_bytes);
        assert_eq!(bytes, [82, 82, 82, 90, 90, 98]);
    }
}
