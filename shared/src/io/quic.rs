//! QUIC as mmt uses it: every setting that is not quinn's default, with its reason, and the endpoints.
//!
//! quinn's defaults are made for bulk; at 1 kHz over a long path they deliver seconds-old state. Liveness,
//! loss and ageing are the application's business: nothing here is a watchdog. Sockets are abstract, so that
//! link emulation and counters can sit between QUIC and the host.

use std::io;
use std::sync::Arc;
use std::time::Duration;

use quinn::{
    AckFrequencyConfig, AsyncUdpSocket, ClientConfig, ConnectionIdGenerator, Endpoint,
    EndpointConfig, IdleTimeout, ServerConfig, TokioRuntime, TransportConfig, VarInt,
};
use quinn_proto::HashedConnectionIdGenerator;
use ring::hmac;

use super::congestion::RateCap;
use super::identity::Identity;
use super::tls::{self, PinVerifier, TlsError};

/// What quinn's queues cost for each datagram beyond its payload, bytes (`size_of::<Datagram>()`).
const QUEUE_ENTRY: usize = 32;
/// Of the longest datagrams so many may wait for the congestion window: the newest, and the one before it.
const QUEUED: usize = 2;
/// Received datagrams that may wait for the application, bytes with overhead: the oldest go first.
const RECEIVE_QUEUE: usize = 64 * 1024;
/// Connections that may be in their handshake before they are accepted.
const INCOMING_MAX: usize = 8;
/// What one of them may send before it is accepted, bytes.
const INCOMING_BYTES: u64 = 8 * 1024;
/// Flow control of the one stream, bytes: hello, welcome and farewell are far smaller.
const STREAM_WINDOW: u32 = 64 * 1024;
/// The path is given up after this long without a packet. At 1 s one way a shorter time kills the handshake.
pub const IDLE: Duration = Duration::from_secs(15);

/// How often a connection that carries no datagrams shows QUIC that it lives: three times within [`IDLE`].
const KEEP_ALIVE: Duration = Duration::from_secs(5);

/// What a side declares to QUIC about its traffic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Traffic {
    /// Longest datagram that this side sends, bytes of payload. What may wait for the window is bounded in bytes, by two
    /// of these with quinn's own: more of the shorter ones wait. 0: datagrams go beside QUIC, and it takes none.
    pub datagram_max: usize,
    /// The most that this side ever sends.
    pub rate_cap: RateCap,
}

/// Why there is no endpoint.
#[derive(Debug, thiserror::Error)]
pub enum EndpointError {
    /// TLS could not be set up.
    #[error(transparent)]
    Tls(#[from] TlsError),
    /// The socket failed.
    #[error("the UDP socket failed: {0}")]
    Socket(#[from] io::Error),
}

/// The slave's endpoint. Its reset key and connection-id key come from the identity, so that a slave that
/// was killed and started again resets the old connections at once instead of leaving them to time out.
///
/// Call it inside of a tokio runtime with I/O and time.
///
/// # Errors
/// The identity is unusable or the socket fails.
pub fn server_endpoint(
    socket: Arc<dyn AsyncUdpSocket>,
    identity: &Identity,
    traffic: Traffic,
) -> Result<Endpoint, EndpointError> {
    let mut config = ServerConfig::with_crypto(Arc::new(tls::server(identity)?));
    config.transport_config(Arc::new(transport(traffic)));
    config.max_incoming(INCOMING_MAX);
    config.incoming_buffer_size(INCOMING_BYTES);
    config.incoming_buffer_size_total(INCOMING_BYTES * INCOMING_MAX as u64);
    endpoint(stable_keys(identity), Some(config), socket)
}

/// The master's endpoint.
///
/// Call it inside of a tokio runtime with I/O and time.
///
/// # Errors
/// The socket fails.
pub fn client_endpoint(socket: Arc<dyn AsyncUdpSocket>) -> Result<Endpoint, EndpointError> {
    endpoint(EndpointConfig::default(), None, socket)
}

fn endpoint(
    config: EndpointConfig,
    server: Option<ServerConfig>,
    socket: Arc<dyn AsyncUdpSocket>,
) -> Result<Endpoint, EndpointError> {
    let runtime = Arc::new(TokioRuntime);
    let endpoint = Endpoint::new_with_abstract_socket(config, server, socket, runtime);
    Ok(endpoint?)
}

/// The configuration of one connection attempt.
///
/// # Errors
/// TLS could not be set up.
pub(super) fn client_config(
    verifier: Arc<PinVerifier>,
    traffic: Traffic,
) -> Result<ClientConfig, TlsError> {
    let mut config = ClientConfig::new(Arc::new(tls::client(verifier)?));
    config.transport_config(Arc::new(transport(traffic)));
    Ok(config)
}

/// The transport settings of both sides (docs/transport.md names the measurements behind them).
pub fn transport(traffic: Traffic) -> TransportConfig {
    let carries_datagrams = traffic.datagram_max > 0;
    let mut config = TransportConfig::default();
    config
        // Loss must not stop the flow, nor may the flow fill a queue.
        .congestion_controller_factory(Arc::new(traffic.rate_cap))
        // The newest message wins: no more wait than two of the longest, the oldest goes first.
        .datagram_send_buffer_size(QUEUED * (traffic.datagram_max + QUEUE_ENTRY))
        .datagram_receive_buffer_size(carries_datagrams.then_some(RECEIVE_QUEUE))
        // Reordering is no loss: only what is two round trips late is.
        .packet_threshold(1000)
        .time_threshold(2.0)
        // One acknowledgement for ten packets or 25 ms: else they cost half of all packets.
        .ack_frequency_config(Some(acknowledgements()))
        // Messages are small: nothing to discover, nothing to segment.
        .mtu_discovery_config(None)
        .enable_segmentation_offload(false)
        // A first guess between a room and the other side of the world.
        .initial_rtt(Duration::from_millis(100))
        .max_idle_timeout(Some(idle_timeout()))
        // Heartbeats do that, and we count them.
        .keep_alive_interval((!carries_datagrams).then_some(KEEP_ALIVE))
        // The master opens the one stream.
        .max_concurrent_bidi_streams(VarInt::from_u32(1))
        .max_concurrent_uni_streams(VarInt::from_u32(0))
        .stream_receive_window(VarInt::from_u32(STREAM_WINDOW))
        .receive_window(VarInt::from_u32(STREAM_WINDOW))
        .send_window(u64::from(STREAM_WINDOW));
    config
}

fn acknowledgements() -> AckFrequencyConfig {
    let mut config = AckFrequencyConfig::default();
    config
        .ack_eliciting_threshold(VarInt::from_u32(10))
        .max_ack_delay(Some(Duration::from_millis(25)))
        .reordering_threshold(VarInt::from_u32(0));
    config
}

fn idle_timeout() -> IdleTimeout {
    // 15 000 ms fits a variable-length integer; the fallback is the same value.
    IdleTimeout::try_from(IDLE).unwrap_or_else(|_| VarInt::from_u32(15_000).into())
}

fn stable_keys(identity: &Identity) -> EndpointConfig {
    let reset = hmac::Key::new(hmac::HMAC_SHA256, &identity.derive("mmt stateless reset"));
    let [a, b, c, d, e, f, g, h, ..] = identity.derive("mmt connection id");
    let id_key = u64::from_le_bytes([a, b, c, d, e, f, g, h]);
    let mut config = EndpointConfig::new(Arc::new(reset));
    config.cid_generator(move || -> Box<dyn ConnectionIdGenerator> {
        Box::new(HashedConnectionIdGenerator::from_key(id_key))
    });
    config
}

#[cfg(test)]
mod tests;
