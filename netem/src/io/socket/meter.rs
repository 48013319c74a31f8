//! The counters of a wrapped socket: what the program offered, what really went out, what came in.

use std::io;
use std::net::SocketAddr;
use std::sync::{Arc, Mutex};

use mmt_shared::report::{SessionStats, WireReport};
use quinn::udp::{RecvMeta, Transmit};
use serde::Serialize;

use super::segments::segments;
use crate::counters::Tally;
use crate::io::driver::DirectionCounters;
use crate::io::lateness::{Lateness, Recorder};
use crate::io::lock;

/// A snapshot of the counters of a socket: those of one moment. Bytes are UDP payload, without UDP and IP
/// headers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct SocketCounters {
    /// What the program gave to the socket, and what became of it. Without emulation everything passes a link
    /// that does nothing.
    pub outgoing: DirectionCounters,
    /// Datagrams received.
    pub received: Tally,
}

/// The counters of a socket, readable from any thread for as long as anybody holds them.
#[derive(Clone, Debug, Default)]
pub struct SocketMeter {
    counters: Arc<Mutex<SocketCounters>>,
    lateness: Arc<Recorder>,
}

impl SocketMeter {
    /// The counters now.
    #[must_use]
    pub fn snapshot(&self) -> SocketCounters {
        *lock(&self.counters)
    }

    /// How late datagrams left the emulated link; empty without emulation.
    #[must_use]
    pub fn lateness(&self) -> Lateness {
        self.lateness.summary()
    }

    /// Adds to what an end of a session counted what its socket counted since `before`, in `duration_s` (s) towards `peer`.
    pub fn add_to(
        &self,
        session: &mut SessionStats,
        before: &SocketCounters,
        peer: SocketAddr,
        duration_s: f64,
    ) {
        let now = self.snapshot();
        // IP and UDP headers
        let header_bytes = if peer.ip().to_canonical().is_ipv4() {
            28
        } else {
            48
        };
        let wire = |now: Tally, before: Tally| {
            let datagrams = now.packets.saturating_sub(before.packets);
            let bytes = now.bytes.saturating_sub(before.bytes);
            WireReport::new(datagrams, bytes, header_bytes, duration_s)
        };
        session.wire_sent = wire(now.outgoing.sent, before.outgoing.sent);
        session.wire_received = wire(now.received, before.received);
        session.emulation = self.lateness().report();
        session.add_drops(now.outgoing.drops_since(&before.outgoing));
    }

    pub(super) fn recorder(&self) -> Arc<Recorder> {
        Arc::clone(&self.lateness)
    }

    /// The counters of the emulated link, as they are now.
    pub(super) fn publish(&self, outgoing: DirectionCounters) {
        lock(&self.counters).outgoing = outgoing;
    }

    /// A transmit that went past the link. One that the socket had no room for stays with the program,
    /// which offers it again: it does not count yet.
    pub(super) fn passed_through(&self, transmit: &Transmit<'_>, sent: &io::Result<()>) {
        if matches!(sent, Err(error) if error.kind() == io::ErrorKind::WouldBlock) {
            return;
        }
        let outgoing = &mut lock(&self.counters).outgoing;
        for contents in segments(transmit) {
            outgoing.link.offered.count(contents.len());
            outgoing.link.delivered.count(contents.len());
            match sent {
                Ok(()) => outgoing.sent.count(contents.len()),
                Err(_) => outgoing.failed.count(contents.len()),
            }
        }
    }

    /// Messages received; one message can hold many datagrams of `stride` bytes (GRO).
    pub(super) fn received<'a>(&self, messages: impl Iterator<Item = &'a RecvMeta>) {
        let received = &mut lock(&self.counters).received;
        for message in messages {
            let packets = message.len.div_ceil(message.stride.max(1)).max(1) as u64;
            let bytes = message.len as u64;
            *received = received.plus(Tally { packets, bytes });
        }
    }
}
