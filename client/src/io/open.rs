//! From a pairing string to a session, an operator's or an observer's: look up, connect, hello, welcome.

use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr};
use std::sync::Arc;
use std::time::Duration;

use mmt_netem::io::socket::{EmulatedSocket, SocketExtras, SocketMeter};
use mmt_netem::{LinkConfig, LinkId};
use mmt_shared::io::congestion::RateCap;
use mmt_shared::io::connect::{ConnectError, in_order};
use mmt_shared::io::farewell::FAREWELL_WAIT;
use mmt_shared::io::quic::Traffic;
use mmt_shared::io::socket;
use mmt_shared::io::stream::{read_frame, write_message};
use mmt_shared::io::transport::{
    CLOSE_FINISHED, Connection, Endpoint, RecvStream, SendStream, Transport, WriteError,
};
use mmt_shared::model::architecture::Architecture;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::pairing::Pairing;
use mmt_shared::wire::{
    Claim, DATAGRAM_MAX, Hello, Label, Refusal, Role, STREAM_MESSAGE_MAX, Side, StreamMessage,
    Welcome,
};
use tokio::time::timeout;

use super::options::MasterOptions;
use super::{MasterHostError, ResumeFile};
use crate::commands::CommandConfig;

/// How the program names itself to the slave.
pub(super) const PROGRAM: &str = concat!("mmt ", env!("CARGO_PKG_VERSION"));

/// How long the host waits, for what.
#[derive(Clone, Copy, Debug)]
pub(super) struct Timeouts {
    /// For a name to be looked up.
    pub(super) lookup: Duration,
    /// For a handshake.
    pub(super) connect: Duration,
    /// For the hello to be taken, and for its answer.
    pub(super) welcome: Duration,
    /// For the slave's farewell, beyond the round trip.
    pub(super) farewell: Duration,
    /// For the last packets.
    pub(super) idle: Duration,
}

/// Three round trips of 2 s and a lost packet for all that opens a session; what ends one must not keep
/// a person waiting (1 s, docs/protocol.md section 2).
pub(super) const TIMEOUTS: Timeouts = Timeouts {
    lookup: Duration::from_secs(10),
    connect: Duration::from_secs(10),
    welcome: Duration::from_secs(10),
    farewell: FAREWELL_WAIT,
    idle: Duration::from_secs(1),
};

/// A connection, with all that is below it.
#[derive(Debug)]
pub(super) struct Connected {
    pub(super) endpoint: Endpoint,
    pub(super) connection: Connection,
    pub(super) meter: SocketMeter,
    pub(super) address: SocketAddr,
}

impl Connected {
    /// Closes with a reason for people, and waits until that has gone out, at most `limit`.
    pub(super) async fn close(&self, reason: &str, limit: Duration) {
        self.connection.close(CLOSE_FINISHED, reason.as_bytes());
        // it takes three more round trips; nobody needs to wait longer for them
        let _ = timeout(limit, self.endpoint.wait_idle()).await;
    }
}

/// A session that the slave has welcomed.
#[derive(Debug)]
pub(super) struct Opened {
    pub(super) connected: Connected,
    pub(super) send: SendStream,
    pub(super) receive: RecvStream,
    pub(super) welcome: Welcome,
}

/// What a session is opened with.
#[derive(Clone, Debug)]
pub(super) struct Opening {
    pub(super) pairing: Pairing,
    pub(super) transport: Transport,
    /// Emulated network on what leaves here, its seed, its record and control.
    pub(super) netem: LinkConfig,
    pub(super) netem_seed: u64,
    pub(super) netem_extras: SocketExtras,
    /// What leaves here at the most.
    pub(super) traffic: Traffic,
    pub(super) hello: Hello,
}

impl Opening {
    /// An operator's that starts at `hip`, m.
    pub(super) fn of_operator(options: &MasterOptions, hip: Vec2) -> Self {
        Self {
            pairing: options.pairing.clone(),
            transport: options.transport,
            netem: options.netem.clone(),
            netem_seed: options.netem_seed,
            netem_extras: options.netem_extras.clone(),
            traffic: traffic(&options.commands, options.architecture),
            hello: hello(options, hip),
        }
    }
}

/// Opens a session.
pub(super) async fn open(
    opening: &Opening,
    timeouts: &Timeouts,
) -> Result<Opened, MasterHostError> {
    let addresses = look_up(&opening.pairing, timeouts.lookup).await?;
    let mut first_error = None;
    for address in addresses {
        match open_at(opening, address, timeouts).await {
            Ok(opened) => return Ok(opened),
            // a name can have an address that leads nowhere: the next may be the one
            Err(error) if leads_nowhere(&error) => {
                first_error.get_or_insert(error);
            }
            Err(error) => return Err(error),
        }
    }
    Err(first_error.unwrap_or_else(|| MasterHostError::NoAddress {
        address: opening.pairing.address.to_string(),
    }))
}

async fn look_up(pairing: &Pairing, limit: Duration) -> Result<Vec<SocketAddr>, MasterHostError> {
    let address = pairing.address.to_string();
    let found = timeout(limit, tokio::net::lookup_host(address.clone())).await;
    let found = match found {
        Ok(Ok(found)) => found,
        Ok(Err(source)) => return Err(MasterHostError::Lookup { address, source }),
        Err(_) => return Err(MasterHostError::LookupSlow { address, limit }),
    };
    Ok(in_order(found))
}

fn leads_nowhere(error: &MasterHostError) -> bool {
    matches!(
        error,
        MasterHostError::Bind(_)
            | MasterHostError::Connect(
                ConnectError::NoAnswer { .. } | ConnectError::Impossible { .. }
            )
    )
}

async fn open_at(
    opening: &Opening,
    address: SocketAddr,
    timeouts: &Timeouts,
) -> Result<Opened, MasterHostError> {
    opening.transport.permit(address)?;
    let local: SocketAddr = match address {
        SocketAddr::V4(_) => (Ipv4Addr::UNSPECIFIED, 0).into(),
        SocketAddr::V6(_) => (Ipv6Addr::UNSPECIFIED, 0).into(),
    };
    let plain = socket::for_quic(socket::bind(local)?).map_err(MasterHostError::Socket)?;
    let (netem, extras) = (opening.netem.clone(), opening.netem_extras.clone());
    let seed = opening.netem_seed;
    let wrapped = EmulatedSocket::try_new(plain, netem, seed, LinkId::UP, extras)?;
    let meter = wrapped.meter();
    let endpoint = Endpoint::of_master(opening.transport, Arc::new(wrapped))?;
    let (pin, traffic) = (opening.pairing.pin, opening.traffic);
    let connection = endpoint
        .connect(address, pin, traffic, timeouts.connect)
        .await?;
    let connected = Connected {
        endpoint,
        connection,
        meter,
        address,
    };
    match greet(&opening.hello, &connected.connection, timeouts.welcome).await {
        Ok((send, receive, welcome)) => Ok(Opened {
            connected,
            send,
            receive,
            welcome,
        }),
        Err(error) => {
            // the slave must not take this master for one that went silent
            connected.close("no session", timeouts.idle).await;
            Err(error)
        }
    }
}

/// What a master sends at the most. A command has up to 70 bytes of its own, 10 for the hand's port and, at any speed
/// of a hand, at most 16 a sample; QUIC adds 30. The cap is twice that, with room for handshake and heartbeats.
fn traffic(commands: &CommandConfig, architecture: Architecture) -> Traffic {
    let own = if architecture.feels_tool() { 80 } else { 70 };
    let datagram_max = (own + 16 * commands.samples_at_most()).min(DATAGRAM_MAX);
    let per_s = 1000_u64.div_ceil(u64::from(commands.samples_per_command.max(1))) + 20;
    Traffic {
        datagram_max,
        rate_cap: RateCap {
            bytes_per_s: 2 * per_s * (datagram_max as u64 + 30),
        },
    }
}

async fn greet(
    hello: &Hello,
    connection: &Connection,
    limit: Duration,
) -> Result<(SendStream, RecvStream, Welcome), MasterHostError> {
    let address = connection.remote_address();
    let unsent = |source| MasterHostError::HelloUnsent { address, source };
    let opened = connection.open_bi().await;
    let (mut send, mut receive) = opened.map_err(|error| unsent(WriteError::from(error).into()))?;
    let written = write_message(&mut send, &StreamMessage::Hello(*hello), limit).await;
    written.map_err(unsent)?;
    let answer = read_frame(&mut receive, STREAM_MESSAGE_MAX, limit).await;
    let answer = answer.map_err(|source| MasterHostError::NoWelcome { address, source })?;
    let welcome = judge(&answer, address, hello)?;
    Ok((send, receive, welcome))
}

fn hello(options: &MasterOptions, hip: Vec2) -> Hello {
    Hello {
        token: options.pairing.token,
        role: Role::Operator,
        claim: claim(options),
        coupling: options.device.coupling(),
        samples_per_command: options.commands.samples_per_command,
        architecture: options.architecture,
        scene_hz: options.scene_hz,
        hip,
        program: Label::clipped(PROGRAM),
    }
}

fn claim(options: &MasterOptions) -> Claim {
    let resume = options.resume.as_ref().and_then(ResumeFile::secret);
    if options.take_over {
        Claim::TakeOver
    } else {
        resume.map_or(Claim::IfFree, Claim::Resume)
    }
}

/// What the slave's answer to the hello comes to.
fn judge(answer: &[u8], address: SocketAddr, hello: &Hello) -> Result<Welcome, MasterHostError> {
    let answer = StreamMessage::decode(answer, Side::Slave)
        .map_err(|source| MasterHostError::Unreadable { address, source })?;
    match answer {
        StreamMessage::Welcome(raw) => raw
            .accept(&hello.coupling)
            .map_err(|source| MasterHostError::Welcome { address, source }),
        StreamMessage::Refused(refusal) => Err(refused(refusal, address, hello)),
        other => Err(MasterHostError::Unexpected {
            address,
            kind: other.kind(),
        }),
    }
}

fn refused(refusal: Refusal, address: SocketAddr, hello: &Hello) -> MasterHostError {
    let observes = hello.role == Role::Observer;
    match refusal {
        Refusal::Busy if observes => MasterHostError::Full { address },
        Refusal::WrongRole if observes => MasterHostError::NoObservers { address },
        Refusal::Busy => MasterHostError::Busy { address },
        Refusal::WrongToken => MasterHostError::WrongToken { address },
        Refusal::BadHello => MasterHostError::BadHello {
            address,
            x: hello.hip.x,
            y: hello.hip.y,
            samples: hello.samples_per_command,
            stiffness_n_per_m: hello.coupling.stiffness_n_per_m,
        },
        Refusal::Ending => MasterHostError::Ending { address },
        Refusal::WrongRole => MasterHostError::WrongRole { address },
    }
}
