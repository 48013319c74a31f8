//! The counters of a wrapped socket: what the program offered, what really went out, what came in.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use quinn::udp::{RecvMeta, Transmit};
use serde::Serialize;

use super::segments;
use crate::counters::Tally;
use crate::fate::DropCause;
use crate::io::lateness::{Lateness, Recorder};

/// A snapshot of the counters of a socket. Bytes are UDP payload, without UDP and IP headers.
///
/// `offered + duplicated = sent + dropped + in flight`, for datagrams and for bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct SocketCounters {
    /// Datagrams that the program gave to the socket.
    pub offered_datagrams: u64,
    /// Bytes that the program gave to the socket.
    pub offered_bytes: u64,
    /// Second copies that the emulated link lets through.
    pub duplicated: Tally,
    /// Datagrams handed to the real socket, which took them: what a capture on the wire shows.
    pub sent_datagrams: u64,
    /// Bytes handed to the real socket, which took them.
    pub sent_bytes: u64,
    /// Datagrams received.
    pub received_datagrams: u64,
    /// Bytes received.
    pub received_bytes: u64,
    /// Datagrams offered that will never be sent.
    pub dropped: SocketDrops,
}

impl SocketCounters {
    /// Datagrams offered that are neither sent nor dropped yet.
    #[must_use]
    pub fn in_flight(&self) -> u64 {
        self.offered_datagrams
            .saturating_add(self.duplicated.packets)
            .saturating_sub(self.sent_datagrams)
            .saturating_sub(self.dropped.total().packets)
    }
}

/// Datagrams that were offered and never sent, by cause.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct SocketDrops {
    /// Lost on the emulated link ([`DropCause::Loss`], [`DropCause::Outage`]).
    pub loss: Tally,
    /// Larger than the MTU of the emulated link ([`DropCause::Mtu`]).
    pub mtu: Tally,
    /// Dropped by the emulated bottleneck ([`DropCause::Queue`], [`DropCause::Codel`]).
    pub queue: Tally,
    /// More in flight than the emulated link holds ([`DropCause::Limit`]).
    pub limit: Tally,
    /// The real socket stayed full for longer than 10 ms.
    pub blocked: Tally,
    /// The real socket refused the datagram with an error.
    pub failed: Tally,
    /// Still in flight when the socket was dropped.
    pub abandoned: Tally,
}

impl SocketDrops {
    /// All causes together.
    #[must_use]
    pub fn total(&self) -> Tally {
        [
            self.loss,
            self.mtu,
            self.queue,
            self.limit,
            self.blocked,
            self.failed,
            self.abandoned,
        ]
        .into_iter()
        .fold(Tally::default(), Tally::plus)
    }
}

/// The counters of a socket, readable from any thread for as long as anybody holds them.
#[derive(Clone, Debug, Default)]
pub struct SocketMeter(Arc<Counts>);

#[derive(Debug, Default)]
struct Counts {
    offered: Counter,
    sent: Counter,
    received: Counter,
    duplicated: Counter,
    loss: Counter,
    mtu: Counter,
    queue: Counter,
    limit: Counter,
    blocked: Counter,
    failed: Counter,
    abandoned: Counter,
    lateness: Recorder,
}

/// Why a datagram that left the link was not sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Unsent {
    Blocked,
    Failed,
    Abandoned,
}

impl SocketMeter {
    /// The counters now. Each is exact; together they are those of one moment up to datagrams handled
    /// while reading, and never show more sent and dropped than offered.
    #[must_use]
    pub fn snapshot(&self) -> SocketCounters {
        // what follows from an offer is read before the offers
        let (sent, received) = (self.0.sent.read(), self.0.received.read());
        let dropped = SocketDrops {
            loss: self.0.loss.read(),
            mtu: self.0.mtu.read(),
            queue: self.0.queue.read(),
            limit: self.0.limit.read(),
            blocked: self.0.blocked.read(),
            failed: self.0.failed.read(),
            abandoned: self.0.abandoned.read(),
        };
        let (offered, duplicated) = (self.0.offered.read(), self.0.duplicated.read());
        SocketCounters {
            offered_datagrams: offered.packets,
            offered_bytes: offered.bytes,
            duplicated,
            sent_datagrams: sent.packets,
            sent_bytes: sent.bytes,
            received_datagrams: received.packets,
            received_bytes: received.bytes,
            dropped,
        }
    }

    /// How late datagrams left the emulated link; empty without emulation.
    #[must_use]
    pub fn lateness(&self) -> Lateness {
        self.0.lateness.summary()
    }

    pub(super) fn recorder(&self) -> &Recorder {
        &self.0.lateness
    }

    pub(super) fn offered(&self, bytes: usize) {
        self.0.offered.count(bytes);
    }

    pub(super) fn duplicated(&self, bytes: usize) {
        self.0.duplicated.count(bytes);
    }

    pub(super) fn sent(&self, bytes: usize) {
        self.0.sent.count(bytes);
    }

    pub(super) fn dropped(&self, cause: DropCause, bytes: usize) {
        match cause {
            DropCause::Loss | DropCause::Outage => self.0.loss.count(bytes),
            DropCause::Mtu => self.0.mtu.count(bytes),
            DropCause::Queue | DropCause::Codel => self.0.queue.count(bytes),
            DropCause::Limit => self.0.limit.count(bytes),
        }
    }

    pub(super) fn unsent(&self, why: Unsent, bytes: usize) {
        match why {
            Unsent::Blocked => self.0.blocked.count(bytes),
            Unsent::Failed => self.0.failed.count(bytes),
            Unsent::Abandoned => self.0.abandoned.count(bytes),
        }
    }

    /// A transmit that went past the link. One that the socket had no room for stays with the program,
    /// which offers it again: it does not count yet.
    pub(super) fn passed_through(&self, transmit: &Transmit<'_>, sent: &io::Result<()>) {
        if matches!(sent, Err(error) if error.kind() == io::ErrorKind::WouldBlock) {
            return;
        }
        for contents in segments(transmit) {
            self.offered(contents.len());
            match sent {
                Ok(()) => self.sent(contents.len()),
                Err(_) => self.unsent(Unsent::Failed, contents.len()),
            }
        }
    }

    /// Messages received; one message can hold many datagrams of `stride` bytes (GRO).
    pub(super) fn received<'a>(&self, messages: impl Iterator<Item = &'a RecvMeta>) {
        for message in messages {
            let datagrams = message.len.div_ceil(message.stride.max(1)).max(1);
            self.0.received.add(datagrams as u64, message.len as u64);
        }
    }
}

/// A [`Tally`] that one thread writes while another reads.
#[derive(Debug, Default)]
struct Counter {
    packets: AtomicU64,
    bytes: AtomicU64,
}

impl Counter {
    fn count(&self, bytes: usize) {
        self.add(1, bytes as u64);
    }

    fn add(&self, packets: u64, bytes: u64) {
        self.bytes.fetch_add(bytes, Ordering::Release);
        self.packets.fetch_add(packets, Ordering::Release);
    }

    fn read(&self) -> Tally {
        Tally {
            packets: self.packets.load(Ordering::Acquire),
            bytes: self.bytes.load(Ordering::Acquire),
        }
    }
}
