//! The two ends of a run: sockets in memory and quinn's endpoints on them.
//!
//! A socket hands packets to its path at once and is always writable. Every random number that quinn lets be seeded
//! is; what remains random (keys, connection ids) changes bytes, never lengths or times.

use std::collections::VecDeque;
use std::fmt;
use std::io::{self, IoSliceMut};
use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::{Arc, Mutex};
use std::task::{Context, Poll, Waker};

use mmt_shared::io::congestion::RateCap;
use mmt_shared::io::identity::Identity;
use mmt_shared::io::quic::{self, Traffic};
use mmt_shared::io::tls::{self, PinVerifier};
use mmt_shared::rng::Substream;
use quinn::udp::{RecvMeta, Transmit};
use quinn::{
    AsyncUdpSocket, ClientConfig, Endpoint, EndpointConfig, ServerConfig, TransportConfig,
    UdpPoller,
};

use super::executor::{Executor, lock};
use super::path::{Datagram, OneWay};
use crate::io::failure::Failure;
use crate::transport::{Case, Stack};

/// What QUIC adds to a message, bytes (short header, 8-byte connection id, frame, tag).
const QUIC_OVERHEAD: usize = 30;
/// Identities to choose from: in one of 128 the certificate is a byte shorter.
const IDENTITIES: usize = 8;

/// A socket in memory.
pub(super) struct MemorySocket {
    executor: Executor,
    mine: SocketAddr,
    theirs: SocketAddr,
    out: Arc<Mutex<OneWay>>,
    inbox: Mutex<Inbox>,
}

#[derive(Default)]
struct Inbox {
    packets: VecDeque<Datagram>,
    reader: Option<Waker>,
}

impl MemorySocket {
    pub(super) fn new(
        executor: &Executor,
        mine: SocketAddr,
        theirs: SocketAddr,
        out: Arc<Mutex<OneWay>>,
    ) -> Arc<Self> {
        Arc::new(Self {
            executor: executor.clone(),
            mine,
            theirs,
            out,
            inbox: Mutex::default(),
        })
    }

    /// A packet has arrived.
    pub(super) fn deliver(&self, packet: Datagram) {
        let reader = {
            let mut inbox = lock(&self.inbox);
            inbox.packets.push_back(packet);
            inbox.reader.take()
        };
        if let Some(reader) = reader {
            reader.wake();
        }
    }
}

impl fmt::Debug for MemorySocket {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "MemorySocket {}", self.mine)
    }
}

impl AsyncUdpSocket for MemorySocket {
    fn create_io_poller(self: Arc<Self>) -> Pin<Box<dyn UdpPoller>> {
        Box::pin(AlwaysWritable)
    }

    fn try_send(&self, transmit: &Transmit<'_>) -> io::Result<()> {
        let now = self.executor.time();
        lock(&self.out).offer(now, transmit.contents, transmit.ecn);
        Ok(())
    }

    fn poll_recv(
        &self,
        context: &mut Context<'_>,
        buffers: &mut [IoSliceMut<'_>],
        meta: &mut [RecvMeta],
    ) -> Poll<io::Result<usize>> {
        let mut inbox = lock(&self.inbox);
        let (Some(buffer), Some(meta)) = (buffers.first_mut(), meta.first_mut()) else {
            return Poll::Ready(Ok(0));
        };
        let Some(packet) = inbox.packets.pop_front() else {
            inbox.reader = Some(context.waker().clone());
            return Poll::Pending;
        };
        let len = packet.contents.len().min(buffer.len());
        for (to, from) in buffer.iter_mut().zip(&packet.contents) {
            *to = *from;
        }
        *meta = RecvMeta {
            addr: self.theirs,
            len,
            stride: len,
            ecn: packet.ecn,
            ..RecvMeta::default()
        };
        Poll::Ready(Ok(1))
    }

    fn local_addr(&self) -> io::Result<SocketAddr> {
        Ok(self.mine)
    }

    fn may_fragment(&self) -> bool {
        false
    }
}

#[derive(Debug)]
struct AlwaysWritable;

impl UdpPoller for AlwaysWritable {
    fn poll_writable(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Ready(Ok(()))
    }
}

/// The endpoints of a run; the master's connects with `client`.
pub(super) struct Ends {
    pub(super) master: Endpoint,
    pub(super) slave: Endpoint,
    pub(super) client: ClientConfig,
}

/// Both endpoints as `case` sets them, on their sockets.
pub(super) fn ends(
    case: &Case,
    executor: &Executor,
    master: Arc<MemorySocket>,
    slave: Arc<MemorySocket>,
) -> Result<Ends, Failure> {
    let identity = identity()?;
    let transport = Arc::new(transport(case));
    let mut server = ServerConfig::with_crypto(Arc::new(tls::server(&identity)?));
    server.transport_config(Arc::clone(&transport));
    let verifier = Arc::new(PinVerifier::new(identity.pin()));
    let mut client = ClientConfig::new(Arc::new(tls::client(verifier)?));
    client.transport_config(transport);
    let endpoint = |name, server, socket| {
        let runtime = Arc::new(executor.clone());
        Endpoint::new_with_abstract_socket(seeded(case.seed, name), server, socket, runtime)
    };
    Ok(Ends {
        master: endpoint("quinn/master", None, master)?,
        slave: endpoint("quinn/slave", Some(server), slave)?,
        client,
    })
}

/// The settings of quinn: its own, or those that mmt gives it.
fn transport(case: &Case) -> TransportConfig {
    match case.stack {
        Stack::Stock => TransportConfig::default(),
        Stack::Ours => {
            let message = case.flow.bytes;
            let packets_per_s = u64::from(case.flow.rate_hz) + 20;
            quic::transport(Traffic {
                datagram_max: message,
                // as both sides set it: twice what they send
                rate_cap: RateCap {
                    bytes_per_s: 2 * packets_per_s * (message + QUIC_OVERHEAD) as u64,
                },
            })
        }
    }
}

fn seeded(seed: u64, name: &str) -> EndpointConfig {
    let mut stream = Substream::new(seed, name, 0);
    let mut key = [0; 32];
    for chunk in key.chunks_mut(8) {
        chunk.copy_from_slice(&stream.bits().to_le_bytes());
    }
    let mut config = EndpointConfig::default();
    config.rng_seed(Some(key));
    config
}

/// A fresh identity whose certificate has the usual length: a shorter one would move the handshake.
fn identity() -> Result<Identity, Failure> {
    let mut longest = Identity::ephemeral()?;
    for _ in 1..IDENTITIES {
        let next = Identity::ephemeral()?;
        if next.certificate().len() > longest.certificate().len() {
            longest = next;
        }
    }
    Ok(longest)
}
