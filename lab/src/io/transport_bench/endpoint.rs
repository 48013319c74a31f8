//! The transports of mmt, each end on its own thread and tokio runtime, with sockets that count.

use std::net::{Ipv4Addr, UdpSocket};
use std::sync::Arc;
use std::time::{Duration, Instant};

use bytes::Bytes;
use mmt_netem::io::socket::{EmulatedSocket, SocketExtras, SocketMeter};
use mmt_netem::{LinkConfig, LinkId};
use mmt_shared::io::clock::{Clock, thread_cpu_time};
use mmt_shared::io::congestion::RateCap;
use mmt_shared::io::identity::Identity;
use mmt_shared::io::quic::Traffic;
use mmt_shared::io::socket::{bind, for_quic};
use mmt_shared::io::transport::{self, Connection, Listener, Transport};
use mmt_shared::time::Time;
use quinn::AsyncUdpSocket;
use tokio::runtime::{Builder, Runtime};
use tokio::time::{timeout, timeout_at};

use super::config::{BenchConfig, BenchError};
use super::cores::Placement;
use super::slice::{Flow, Side, Slice};
use crate::io::failure::Failure;

/// For both sides to connect.
const CONNECT_MAX: Duration = Duration::from_secs(10);
/// What QUIC adds to a message, bytes.
const QUIC_OVERHEAD: usize = 30;

/// Both ends, connected.
pub(super) struct EndpointPair {
    pub(super) near: Endpoint,
    pub(super) far: Endpoint,
}

/// One end: its runtime, its connection, its counters.
pub(super) struct Endpoint {
    runtime: Runtime,
    meter: SocketMeter,
    connection: Connection,
    /// Whether it sends messages of its own; the other end answers in a round trip.
    is_near: bool,
    /// Lives as long as the connection.
    _endpoint: transport::Endpoint,
}

impl EndpointPair {
    pub(super) fn try_new(
        transport: Transport,
        config: &BenchConfig,
        placement: &Placement,
    ) -> Result<Self, BenchError> {
        let bytes_per_s = 2 * u64::from(config.rate_hz) * (config.bytes + QUIC_OVERHEAD) as u64;
        let traffic = Traffic {
            datagram_max: config.bytes,
            rate_cap: RateCap { bytes_per_s },
        };
        let any = (Ipv4Addr::LOCALHOST, 0).into();
        let (near, far) = (
            bind(any).map_err(Failure::from)?,
            bind(any).map_err(Failure::from)?,
        );
        let address = far.local_addr().map_err(Failure::from)?;
        let identity = Identity::ephemeral().map_err(Failure::from)?;
        let connect = async |socket| {
            let endpoint = transport::Endpoint::of_master(transport, socket)?;
            let connecting = endpoint.connect(address, identity.pin(), traffic, CONNECT_MAX);
            let connection = connecting.await?;
            Ok((endpoint, connection))
        };
        let accept = async |socket| {
            let endpoint = transport::Endpoint::of_slave(transport, socket, &identity, traffic)?;
            let listener = Listener::new(endpoint.clone());
            let handshake = timeout(CONNECT_MAX, listener.next()).await?;
            let connection = handshake.ok_or("the endpoint is closed")?.finish().await?;
            Ok((endpoint, connection))
        };
        let (near, far) = placement.run(
            || Endpoint::try_new(near, true, connect),
            || Endpoint::try_new(far, false, accept),
        )?;
        Ok(Self { near, far })
    }
}

impl Endpoint {
    fn try_new(
        socket: UdpSocket,
        is_near: bool,
        open: impl AsyncFnOnce(
            Arc<dyn AsyncUdpSocket>,
        ) -> Result<(transport::Endpoint, Connection), Failure>,
    ) -> Result<Self, Failure> {
        let runtime = Builder::new_current_thread().enable_all().build()?;
        let opened = runtime.block_on(async {
            // it emulates nothing: it counts
            let link = LinkConfig::default();
            let socket = EmulatedSocket::try_new(
                for_quic(socket)?,
                link,
                0,
                LinkId::UP,
                SocketExtras::default(),
            )?;
            let meter = socket.meter();
            Ok::<_, Failure>((meter, open(Arc::new(socket)).await?))
        });
        let (meter, (endpoint, connection)) = opened?;
        Ok(Self {
            runtime,
            meter,
            connection,
            is_near,
            _endpoint: endpoint,
        })
    }

    /// The near end sends its messages at their times; both deal with what comes until the slice is over.
    pub(super) fn run(&self, slice: &Slice, clock: Clock) -> Result<Side, Failure> {
        let mut side = Side::default();
        let (before, cpu) = (self.meter.snapshot(), thread_cpu_time());
        self.runtime.block_on(async {
            let own = if self.is_near { slice.messages } else { 0 };
            for k in 0..own {
                self.receive(slice, slice.due(k), clock, &mut side).await?;
                self.send(slice.message(clock.now()).into(), &mut side)
                    .await?;
            }
            self.receive(slice, slice.end(), clock, &mut side).await
        })?;
        side.cpu = thread_cpu_time().saturating_sub(cpu);
        let after = self.meter.snapshot();
        side.packets = after.outgoing.sent.packets - before.outgoing.sent.packets;
        side.bytes = after.outgoing.sent.bytes - before.outgoing.sent.bytes;
        Ok(side)
    }

    /// Deals with what comes until `end`.
    async fn receive(
        &self,
        slice: &Slice,
        end: Time,
        clock: Clock,
        side: &mut Side,
    ) -> Result<(), Failure> {
        let deadline = Instant::now() + end.saturating_since(clock.now());
        let receiving = async {
            loop {
                let message = self.connection.read_datagram().await?;
                if slice.flow == Flow::RoundTrip && !self.is_near {
                    if slice.sent_at(&message).is_some() {
                        self.send(message, side).await?;
                    }
                } else {
                    side.note(slice, &message, clock.now());
                }
            }
        };
        match timeout_at(deadline.into(), receiving).await {
            Ok(failed) => failed,
            Err(_) => Ok(()),
        }
    }

    async fn send(&self, message: Bytes, side: &mut Side) -> Result<(), Failure> {
        self.connection.send_datagram(message)?;
        side.sent += 1;
        // the connection's own task has its turn, so that no two messages share a packet
        tokio::task::yield_now().await;
        Ok(())
    }
}
