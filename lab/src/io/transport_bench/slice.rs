//! One slice: when messages are sent, what they hold, and what became of them.

use std::time::Duration;

use mmt_shared::io::spread::Spread;
use mmt_shared::time::Time;

use super::{BenchConfig, BenchError, Flow, SETTLING, SLICE};

/// The shortest message, bytes: its stamp and the number of its slice.
pub const BYTES_MIN: usize = 16;

/// A slice as both sides know it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slice {
    pub(super) number: u64,
    pub(super) flow: Flow,
    pub(super) messages: u32,
    pub(super) bytes: usize,
    period: Duration,
    start: Time,
}

impl Slice {
    pub(super) fn new(number: u64, flow: Flow, config: &BenchConfig, start: Time) -> Self {
        let period = Duration::from_secs(1) / config.rate_hz;
        let messages = SLICE.as_nanos() / period.as_nanos().max(1);
        Self {
            number,
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

    /// When both sides stop listening.
    pub(super) fn end(&self) -> Time {
        self.due(self.messages) + SETTLING
    }

    /// A message that is sent now.
    pub(super) fn message(&self, now: Time) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(self.bytes);
        bytes.extend_from_slice(&now.as_nanos().to_le_bytes());
        bytes.extend_from_slice(&self.number.to_le_bytes());
        bytes.resize(self.bytes, 0);
        bytes
    }

    /// When a message was sent; none if it is of another slice, which it is too late for.
    pub(super) fn sent_at(&self, message: &[u8]) -> Option<Time> {
        let (stamp, rest) = message.split_first_chunk::<8>()?;
        let (number, _) = rest.split_first_chunk::<8>()?;
        let mine = u64::from_le_bytes(*number) == self.number;
        mine.then(|| Time::from_nanos(u64::from_le_bytes(*stamp)))
    }
}

/// What one side did in a slice.
#[derive(Debug)]
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
    pub(super) fn new() -> Self {
        Self {
            sent: 0,
            took: Vec::new(),
            cpu: Duration::ZERO,
            packets: 0,
            bytes: 0,
        }
    }
}

/// What both sides did in a slice.
#[derive(Debug)]
pub(super) struct Turn {
    pub(super) near: Side,
    pub(super) far: Side,
}

/// All turns of a carrier in a flow.
#[derive(Debug)]
pub(super) struct Sum {
    /// Messages that set out.
    pub(super) sent: u64,
    /// Messages that were sent by either side: an answer is one.
    pub(super) carried: u64,
    pub(super) took: Spread,
    pub(super) cpu: Duration,
    pub(super) packets: u64,
    pub(super) bytes: u64,
}

impl Sum {
    pub(super) fn try_new() -> Result<Self, BenchError> {
        Ok(Self {
            sent: 0,
            carried: 0,
            took: Spread::new().map_err(|error| BenchError::Histogram(error.to_string()))?,
            cpu: Duration::ZERO,
            packets: 0,
            bytes: 0,
        })
    }

    pub(super) fn add(&mut self, turn: &Turn) {
        self.sent += turn.near.sent;
        for side in [&turn.near, &turn.far] {
            self.carried += side.sent;
            side.took.iter().for_each(|took| self.took.record(*took));
            self.cpu += side.cpu;
            self.packets += side.packets;
            self.bytes += side.bytes;
        }
    }
}
