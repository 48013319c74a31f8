//! The transports of mmt, each end on its own thread and runtime, with sockets that count.

use std::future::Future;
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::time::{Duration, Instant};

use bytes::Bytes;
use mmt_netem::io::socket::{EmulatedSocket, SocketMeter};
use mmt_netem::{LinkConfig, LinkId};
use mmt_shared::io::clock::{Clock, thread_cpu_time};
use mmt_shared::io::congestion::RateCap;
use mmt_shared::io::identity::Identity;
use mmt_shared::io::quic::{Traffic, client_config, client_endpoint_on, server_endpoint_on};
use mmt_shared::io::raw_udp;
use mmt_shared::io::runtime::{PollRuntime, until};
use mmt_shared::io::socket::bind;
use mmt_shared::io::tls::PinVerifier;
use mmt_shared::io::transport::{Connection, Endpoint};
use mmt_shared::time::Time;
use quinn::{Runtime, TokioRuntime};

use super::cores::Places;
use super::slice::{Side, Slice, Turn};
use super::{BenchConfig, BenchError, Carrier, Flow};

/// Name given to the TLS library, which wants one; it is not sent.
const SERVER_NAME: &str = "mmt";
/// For both sides to meet.
const MEETING: Duration = Duration::from_secs(10);
/// What QUIC adds to a message, bytes.
const QUIC_OVERHEAD: usize = 30;

/// Both ends, connected.
pub(super) struct Carried {
    near: End,
    far: End,
}

/// One end: its runtime, its connection, its counters.
struct End {
    executor: Executor,
    clock: Clock,
    meter: SocketMeter,
    connection: Connection,
    /// Whether it answers in a round trip.
    is_far: bool,
    /// Lives as long as the connection.
    _endpoint: Endpoint,
}

/// Who drives an end.
enum Executor {
    Poll(PollRuntime),
    Tokio(tokio::runtime::Runtime),
}

impl Executor {
    fn try_new(carrier: Carrier) -> Result<Self, BenchError> {
        Ok(match carrier {
            Carrier::QuicTokio => {
                let mut builder = tokio::runtime::Builder::new_current_thread();
                Self::Tokio(builder.enable_all().build()?)
            }
            _ => Self::Poll(PollRuntime::try_new()?),
        })
    }

    fn handle(&self) -> Arc<dyn Runtime> {
        match self {
            Self::Poll(runtime) => Arc::new(runtime.handle()),
            Self::Tokio(_) => Arc::new(TokioRuntime),
        }
    }

    fn block_on<T>(
        &self,
        future: impl Future<Output = Result<T, BenchError>>,
    ) -> Result<T, BenchError> {
        match self {
            Self::Poll(runtime) => runtime.block_on(future)?,
            Self::Tokio(runtime) => runtime.block_on(future),
        }
    }
}

/// An end that is not connected yet.
struct Begun {
    executor: Executor,
    meter: SocketMeter,
    endpoint: Endpoint,
}

impl Begun {
    /// `identity` for the far end, which is connected to.
    fn try_new(
        carrier: Carrier,
        identity: Option<&Identity>,
        traffic: Traffic,
    ) -> Result<Self, BenchError> {
        let executor = Executor::try_new(carrier)?;
        let runtime = executor.handle();
        // tokio's sockets and tasks are made inside of it
        let inside = match &executor {
            Executor::Tokio(runtime) => Some(runtime.enter()),
            Executor::Poll(_) => None,
        };
        let plain = runtime.wrap_udp_socket(bind((Ipv4Addr::LOCALHOST, 0).into())?)?;
        let counted = EmulatedSocket::try_new(plain, LinkConfig::default(), 0, LinkId::UP)?;
        let meter = counted.meter();
        let socket = Arc::new(counted);
        let endpoint = match (carrier, identity) {
            (Carrier::RawUdp, identity) => {
                let endpoint = raw_udp::Endpoint::new(socket, runtime, identity.is_some());
                Endpoint::RawUdp(Arc::new(endpoint))
            }
            (_, Some(identity)) => {
                Endpoint::Quic(server_endpoint_on(runtime, socket, identity, traffic)?)
            }
            (_, None) => Endpoint::Quic(client_endpoint_on(runtime, socket)?),
        };
        drop(inside);
        Ok(Self {
            executor,
            meter,
            endpoint,
        })
    }

    fn connected(
        self,
        clock: Clock,
        is_far: bool,
        connecting: impl Future<Output = Result<Connection, BenchError>>,
    ) -> Result<End, BenchError> {
        let runtime = self.executor.handle();
        let deadline = Instant::now() + MEETING;
        let connection = self.executor.block_on(async {
            let met = until(&*runtime, Some(deadline), connecting).await;
            met.ok_or(BenchError::Handshake)?
        })?;
        Ok(End {
            executor: self.executor,
            clock,
            meter: self.meter,
            connection,
            is_far,
            _endpoint: self.endpoint,
        })
    }
}

impl Carried {
    pub(super) fn try_new(
        carrier: Carrier,
        config: &BenchConfig,
        places: &Places,
        clock: Clock,
    ) -> Result<Self, BenchError> {
        let bytes_per_s = 2 * u64::from(config.rate_hz) * (config.bytes + QUIC_OVERHEAD) as u64;
        let traffic = Traffic {
            datagram_max: config.bytes,
            rate_cap: RateCap { bytes_per_s },
        };
        let identity = Identity::ephemeral()?;
        let far = Begun::try_new(carrier, Some(&identity), traffic)?;
        let near = Begun::try_new(carrier, None, traffic)?;
        let address = far.endpoint.local_addr()?;
        let (listening, calling) = (far.endpoint.clone(), near.endpoint.clone());
        let connecting = connect(calling, address, &identity, traffic);
        let (near, far) = places.run(
            || near.connected(clock, false, connecting),
            || far.connected(clock, true, accept(listening)),
        )?;
        Ok(Self { near, far })
    }

    pub(super) fn turn(&mut self, places: &Places, slice: &Slice) -> Result<Turn, BenchError> {
        let (near, far) = (&self.near, &self.far);
        places.turn(|| near.turn(slice, slice.messages), || far.turn(slice, 0))
    }
}

async fn accept(endpoint: Endpoint) -> Result<Connection, BenchError> {
    match endpoint {
        Endpoint::Quic(endpoint) => {
            let incoming = endpoint.accept().await.ok_or(BenchError::Handshake)?;
            Ok(Connection::Quic(incoming.await?))
        }
        Endpoint::RawUdp(endpoint) => {
            let accepted = endpoint.accept().await.ok_or(BenchError::Handshake)?;
            Ok(Connection::RawUdp(accepted))
        }
    }
}

async fn connect(
    endpoint: Endpoint,
    address: SocketAddr,
    identity: &Identity,
    traffic: Traffic,
) -> Result<Connection, BenchError> {
    match endpoint {
        Endpoint::Quic(endpoint) => {
            let verifier = Arc::new(PinVerifier::new(identity.pin()));
            let config = client_config(verifier, traffic)?;
            let connecting = endpoint.connect_with(config, address, SERVER_NAME)?;
            Ok(Connection::Quic(connecting.await?))
        }
        Endpoint::RawUdp(endpoint) => {
            let opened = endpoint.connect(address, MEETING).await?;
            Ok(Connection::RawUdp(opened))
        }
    }
}

impl End {
    /// Sends `messages` of its own at their times and deals with what comes until the slice is over.
    fn turn(&self, slice: &Slice, messages: u32) -> Result<Side, BenchError> {
        let mut side = Side::new();
        let (sockets, cpu) = (self.meter.snapshot(), thread_cpu_time());
        self.executor.block_on(async {
            for k in 0..messages {
                self.listen(slice, slice.due(k), &mut side).await?;
                self.send(slice.message(self.clock.now()).into(), &mut side)
                    .await?;
            }
            self.listen(slice, slice.end(), &mut side).await
        })?;
        side.cpu = thread_cpu_time().saturating_sub(cpu);
        let after = self.meter.snapshot();
        side.packets = after.sent_datagrams - sockets.sent_datagrams;
        side.bytes = after.sent_bytes - sockets.sent_bytes;
        Ok(side)
    }

    /// Deals with what comes until `end`.
    async fn listen(&self, slice: &Slice, end: Time, side: &mut Side) -> Result<(), BenchError> {
        let runtime = self.executor.handle();
        let left = end.saturating_since(self.clock.now());
        let deadline = Some(Instant::now() + left);
        let listening = async {
            loop {
                let message = self.connection.read_datagram().await?;
                match (slice.flow, slice.sent_at(&message)) {
                    // the far end of a round trip has sent nothing of its own
                    (Flow::RoundTrip, Some(_)) if self.is_far => {
                        self.send(message, side).await?;
                    }
                    (_, Some(sent)) => {
                        side.took.push(self.clock.now().saturating_since(sent));
                    }
                    (_, None) => {}
                }
            }
        };
        match until(&*runtime, deadline, listening).await {
            Some(Err(error)) => Err(error),
            Some(Ok(())) | None => Ok(()),
        }
    }

    async fn send(&self, message: Bytes, side: &mut Side) -> Result<(), BenchError> {
        self.connection.send_datagram(message)?;
        side.sent += 1;
        // the connection's own task has its turn, so that no two messages share a packet
        tokio::task::yield_now().await;
        Ok(())
    }
}
