//! One slice: when messages are sent, what they hold, and what became of them.

use std::time::Duration;

use mmt_shared::time::Time;

use super::config::BenchConfig;

/// For how long messages are sent in a slice.
const SLICE: Duration = Duration::from_millis(200);
/// After the last message: what is still on its way, and the last acknowledgement (25 ms), belong to the slice.
const SETTLING: Duration = Duration::from_millis(40);

/// Where messages go.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Flow {
    /// From one side to the other; nothing of the application's comes back.
    OneWay,
    /// To the other side and back, each.
    RoundTrip,
}

impl Flow {
    /// Both.
    pub const ALL: [Self; 2] = [Self::OneWay, Self::RoundTrip];

    /// As tables spell it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::OneWay => "one way",
            Self::RoundTrip => "round trip",
        }
    }
}

/// A slice as both sides know it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slice {
    round: u64,
    pub(super) flow: Flow,
    pub(super) messages: u32,
    bytes: usize,
    period: Duration,
    start: Time,
}

impl Slice {
    /// The slice of a carrier in a flow and a round, whose first message is due at `start`.
    pub(super) fn new(round: u64, flow: Flow, config: &BenchConfig, start: Time) -> Self {
        let period = Duration::from_secs(1) / config.rate_hz;
        let messages = SLICE.as_nanos() / period.as_nanos().max(1);
        Self {
            round,
            flow,
            messages: u32::try_from(messages).unwrap_or(u32::MAX).max(1),
            bytes: config.bytes,
            period,
            start,
        }
    }

    /// When message `k` is sent.
    pub(super) fn due(&self, k: u32) -> Time {
        self.start + self.period * k
    }

    /// When both sides stop receiving.
    pub(super) fn end(&self) -> Time {
        self.due(self.messages) + SETTLING
    }

    /// The slices of one carrier have different numbers.
    fn number(&self) -> u64 {
        2 * self.round + self.flow as u64
    }

    /// A message that is sent now.
    pub(super) fn message(&self, now: Time) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(self.bytes);
        bytes.extend_from_slice(&now.as_nanos().to_le_bytes());
        bytes.extend_from_slice(&self.number().to_le_bytes());
        bytes.resize(self.bytes, 0);
        bytes
    }

    /// When a message was sent; none if it is of another slice, which it is too late for.
    pub(super) fn sent_at(&self, message: &[u8]) -> Option<Time> {
        let (stamp, rest) = message.split_first_chunk::<8>()?;
        let (number, _) = rest.split_first_chunk::<8>()?;
        let is_mine = u64::from_le_bytes(*number) == self.number();
        is_mine.then(|| Time::from_nanos(u64::from_le_bytes(*stamp)))
    }
}

/// What one side did in a slice.
#[derive(Debug, Default)]
pub(super) struct Side {
    /// Messages that it sent.
    pub(super) sent: u64,
    /// Of the messages that ended here: how long they took.
    pub(super) took: Vec<Duration>,
    /// CPU time of its thread.
    pub(super) cpu: Duration,
    /// UDP datagrams that it sent.
    pub(super) packets: u64,
    /// Their payload, bytes.
    pub(super) bytes: u64,
}

impl Side {
    /// Notes a message that ended here at `now`, if it is of this slice.
    pub(super) fn note(&mut self, slice: &Slice, message: &[u8], now: Time) {
        let sent = slice.sent_at(message);
        self.took.extend(sent.map(|at| now.saturating_since(at)));
    }
}

/// What both sides did in a slice.
#[derive(Debug)]
pub(super) struct SliceResult {
    pub(super) near: Side,
    pub(super) far: Side,
}
