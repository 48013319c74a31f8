//! Raw UDP datagrams beside a QUIC connection, for measurement: what does QUIC cost?
//!
//! Hello, farewell and the end go by QUIC, which repeats them until they are answered. The datagrams share its
//! socket and have neither encryption, nor proof of their sender, nor congestion control: they must never leave
//! loopback unless a person insists.

use std::collections::BTreeMap;
use std::io::{self, IoSliceMut};
use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::task::{Context, Poll};

use bytes::Bytes;
use quinn::udp::{RecvMeta, Transmit};
use quinn::{AsyncUdpSocket, Connection, ConnectionError, SendDatagramError, UdpPoller};
use tokio::sync::broadcast::{self, Receiver, Sender};

/// What stands before each message, bytes: `KIND`, then 4 that the connection's secrets give.
pub const HEADER: usize = 5;
/// The longest packet, bytes of UDP payload: what every IPv6 path carries (RFC 8200, section 5), as in QUIC.
pub const PACKET_MAX: usize = 1200;
/// The first byte. Its second bit is clear, which QUIC sets in nearly every packet (RFC 9000, section 17; RFC 9287).
const KIND: u8 = 1;
/// Messages that may wait to be read: as many small ones as QUIC's queue takes. The oldest go first.
const WAITING_MAX: usize = 512;

type Header = [u8; HEADER];

/// A UDP socket that keeps raw datagrams of known connections to itself and hands everything else to QUIC.
#[derive(Debug)]
pub(super) struct SharedSocket {
    inner: Arc<dyn AsyncUdpSocket>,
    flows: Mutex<BTreeMap<Header, Weak<Flow>>>,
}

/// The raw datagrams of one connection.
#[derive(Debug)]
pub(super) struct Flow {
    socket: Arc<SharedSocket>,
    header: Header,
    arrived: Sender<Bytes>,
    waiting: tokio::sync::Mutex<Receiver<Bytes>>,
    pub(super) sent: AtomicU64,
    pub(super) received: AtomicU64,
}

impl SharedSocket {
    pub(super) fn new(inner: Arc<dyn AsyncUdpSocket>) -> Self {
        let flows = Mutex::default();
        Self { inner, flows }
    }

    /// Nobody can leave them half changed.
    fn flows(&self) -> MutexGuard<'_, BTreeMap<Header, Weak<Flow>>> {
        self.flows.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The raw datagrams beside `quic`. Both sides find the same header: it comes from the handshake's secrets
    /// (RFC 8446, section 7.5).
    pub(super) fn flow(self: &Arc<Self>, quic: &Connection) -> Arc<Flow> {
        let mut header = [KIND; HEADER];
        let (_, tag) = header.split_at_mut(1);
        // fails only for lengths beyond 8 kB
        let _ = quic.export_keying_material(tag, b"mmt raw udp", b"");
        self.add(header)
    }

    fn add(self: &Arc<Self>, header: Header) -> Arc<Flow> {
        let (arrived, waiting) = broadcast::channel(WAITING_MAX);
        let flow = Arc::new(Flow {
            socket: Arc::clone(self),
            header,
            arrived,
            waiting: waiting.into(),
            sent: AtomicU64::new(0),
            received: AtomicU64::new(0),
        });
        let mut flows = self.flows();
        flows.retain(|_, known| known.strong_count() > 0);
        flows.insert(header, Arc::downgrade(&flow));
        flow
    }

    /// Hands a packet to its flow; none if it is QUIC's.
    fn deliver(&self, packet: &[u8]) -> Option<()> {
        let (header, message) = packet.split_first_chunk()?;
        let flow = self.flows().get(header).and_then(Weak::upgrade)?;
        flow.received.fetch_add(1, Ordering::Relaxed);
        // the flow holds a receiver itself
        let _ = flow.arrived.send(Bytes::copy_from_slice(message));
        Some(())
    }

    /// Takes the raw datagrams out of a buffer, which may hold several packets of one sender (GRO).
    fn filter(&self, buffer: &mut [u8], meta: &mut RecvMeta) {
        let (mut start, mut kept) = (0, 0);
        while start < meta.len {
            let end = (start + meta.stride.max(1)).min(meta.len);
            let packet = buffer.get(start..end).unwrap_or_default();
            if self.deliver(packet).is_none() {
                buffer.copy_within(start..end, kept);
                kept += end - start;
            }
            start = end;
        }
        meta.len = kept;
    }
}

impl AsyncUdpSocket for SharedSocket {
    fn create_io_poller(self: Arc<Self>) -> Pin<Box<dyn UdpPoller>> {
        Arc::clone(&self.inner).create_io_poller()
    }

    fn try_send(&self, transmit: &Transmit<'_>) -> io::Result<()> {
        self.inner.try_send(transmit)
    }

    fn poll_recv(
        &self,
        context: &mut Context<'_>,
        buffers: &mut [IoSliceMut<'_>],
        meta: &mut [RecvMeta],
    ) -> Poll<io::Result<usize>> {
        let received = self.inner.poll_recv(context, buffers, meta);
        if let Poll::Ready(Ok(messages)) = received {
            let filled = buffers.iter_mut().zip(meta).take(messages);
            filled.for_each(|(buffer, meta)| self.filter(buffer, meta));
        }
        received
    }

    fn local_addr(&self) -> io::Result<SocketAddr> {
        self.inner.local_addr()
    }

    fn max_receive_segments(&self) -> usize {
        self.inner.max_receive_segments()
    }
}

impl Flow {
    /// Sends a datagram to where `quic` goes, now or never: what the socket has no room for counts as taken and is
    /// lost.
    pub(super) fn send(&self, quic: &Connection, message: &[u8]) -> Result<(), SendDatagramError> {
        if let Some(why) = quic.close_reason() {
            return Err(SendDatagramError::ConnectionLost(why));
        }
        if message.len() > PACKET_MAX - HEADER {
            return Err(SendDatagramError::TooLarge);
        }
        let taken = self.socket.try_send(&Transmit {
            destination: quic.remote_address(),
            ecn: None,
            contents: &[&self.header, message].concat(),
            segment_size: None,
            src_ip: None,
        });
        self.sent.fetch_add(taken.is_ok().into(), Ordering::Relaxed);
        Ok(())
    }

    /// The next datagram; an error once `quic` is over and none waits any more. Cancel-safe.
    pub(super) async fn read(&self, quic: &Connection) -> Result<Bytes, ConnectionError> {
        let mut waiting = self.waiting.lock().await;
        loop {
            tokio::select! {
                biased;
                received = waiting.recv() => {
                    // an error is the number of the oldest that were dropped
                    if let Ok(message) = received {
                        return Ok(message);
                    }
                }
                why = quic.closed() => return Err(why),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::tests::open;

    #[tokio::test]
    async fn of_several_packets_in_a_buffer_quic_keeps_its_own_in_order() {
        let socket = Arc::new(SharedSocket::new(open()));
        let flow = socket.add([KIND, 2, 3, 4, 5]);
        let packets = [
            "quic-1",
            "\u{1}\u{2}\u{3}\u{4}\u{5}a",
            "quic-2",
            "\u{1}\u{2}\u{3}\u{4}\u{6}b",
            "end",
        ];
        let mut buffer = packets.concat().into_bytes();
        let mut meta = RecvMeta {
            len: buffer.len(),
            stride: 6,
            ..RecvMeta::default()
        };
        socket.filter(&mut buffer, &mut meta);
        // an unknown connection's is QUIC's to drop
        let left = &buffer[..meta.len];
        assert_eq!(left, b"quic-1quic-2\x01\x02\x03\x04\x06bend");
        assert_eq!(flow.received.load(Ordering::Relaxed), 1);
        assert_eq!(flow.waiting.lock().await.try_recv().unwrap(), "a");
        drop(flow);
        assert_eq!(socket.deliver(&[KIND, 2, 3, 4, 5, 6]), None);
    }
}
