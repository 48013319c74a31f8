//! The settings of the bottleneck: how fast it sends, what may wait before it.

use std::sync::Arc;
use std::time::Duration;

use crate::trace::mahimahi::Opportunities;

/// The highest rate, 1 Tbit/s.
pub const RATE_MAX_BIT_S: u64 = 1_000_000_000_000;

/// How fast the bottleneck sends.
#[derive(Clone, Debug, PartialEq)]
pub struct Rate {
    /// When it sends how much.
    pub service: Service,
    /// What a packet weighs on the wire.
    pub framing: Framing,
}

/// When a bottleneck sends how much.
#[derive(Clone, Debug, PartialEq)]
pub enum Service {
    /// Always the same, 1 bit/s to [`RATE_MAX_BIT_S`].
    Constant {
        /// Bits per second.
        bits_per_second: u64,
    },
    /// At the times of a trace, 1500 bytes each time.
    Opportunities(Arc<Opportunities>),
}

/// What a packet weighs on the wire beyond its own bytes, as in `tc netem`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Framing {
    /// Bytes added to each packet; negative: taken away.
    pub overhead: i32,
    /// Bytes of a cell; 0: no cells. The last cell of a packet is filled up.
    pub cell: u32,
    /// Bytes added to each cell.
    pub cell_overhead: i32,
}

/// The most that one packet weighs, bytes: beyond any UDP datagram, and bounds the work per packet.
const WEIGHT_MAX: u64 = 1 << 20;

impl Framing {
    /// What a packet of `bytes` bytes weighs, bytes, from 0 to 1 MiB.
    #[must_use]
    pub fn weight(&self, bytes: usize) -> u64 {
        let bytes = i64::try_from(bytes).unwrap_or(i64::MAX);
        let framed = bytes.saturating_add(self.overhead.into()).max(0);
        let cell = i64::from(self.cell);
        let weight = if cell == 0 {
            framed
        } else {
            let cells = framed.saturating_add(cell - 1) / cell;
            let filled = cell.saturating_add(self.cell_overhead.into()).max(0);
            cells.saturating_mul(filled)
        };
        u64::try_from(weight).unwrap_or(0).min(WEIGHT_MAX)
    }
}

/// What may wait before the bottleneck. Without any of these only the link's own limit holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Queue {
    /// Bytes on the wire, waiting and being sent.
    pub bytes: Option<u64>,
    /// Packets, waiting and being sent.
    pub packets: Option<u32>,
    /// How long a packet would wait before its own sending begins.
    pub wait: Option<Duration>,
    /// Whether a packet that finds no room drives out those that have waited longest, instead of being
    /// dropped itself.
    pub drop_head: bool,
    /// Active queue management on top of the limits.
    pub codel: Option<Codel>,
}

/// Controlled delay (RFC 8289).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Codel {
    /// The wait that is accepted for longer than an interval.
    pub target: Duration,
    /// The time over which the wait must have fallen below the target once.
    pub interval: Duration,
}

impl Default for Codel {
    /// 5 ms and 100 ms (RFC 8289, sections 4.3 and 4.4).
    fn default() -> Self {
        Self {
            target: Duration::from_millis(5),
            interval: Duration::from_millis(100),
        }
    }
}
