//! The host: an endpoint, the acceptor, and one session after the other.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, UdpSocket};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use mmt_netem::io::socket::EmulatedSocket;
use mmt_netem::link::LinkId;
use mmt_shared::io::clock::Clock;
use mmt_shared::io::congestion::RateCap;
use mmt_shared::io::identity_file::TokenList;
use mmt_shared::io::quic::Traffic;
use mmt_shared::io::socket;
use mmt_shared::io::transport::{CLOSE_FINISHED, Endpoint, Listener};
use mmt_shared::io::wish::{Wish, asked_to_stop};
use mmt_shared::model::contact::Coupling;
use mmt_shared::pairing::{Address, Host, Pairing};
use nix::ifaddrs::{InterfaceAddress, getifaddrs};
use nix::net::if_::InterfaceFlags;
use tokio::sync::{mpsc, watch};
use tokio::time::timeout;

use super::acceptor::{Acceptor, Admitted, Refusals};
use super::context::{Context, SlaveHostError};
use super::observers::{self, Observers};
use super::session;
use super::{PROGRAM, SlaveLive, SlaveOptions, SlaveReport};
use crate::slave::Slave;

/// Updates are the longest datagrams of a slave, 196 bytes at most, and what the tool feels takes 92: at one of each
/// per tick, with QUIC's 30 bytes each, heartbeats and acknowledgements they stay below 400 kB/s.
const TRAFFIC: Traffic = Traffic {
    datagram_max: 200,
    rate_cap: RateCap {
        bytes_per_s: 400_000,
    },
};
/// k_p of the default device, N/m: the configuration is tried with it before anybody connects.
const TRIAL_STIFFNESS: f64 = 1000.0;
/// How long the last packets of closed connections may take.
const CLOSING: Duration = Duration::from_secs(1);

/// A slave that listens. One session at a time; others are refused meanwhile.
pub struct SlaveHost {
    endpoint: Endpoint,
    address: SocketAddr,
    pairing: Pairing,
    pub(super) tokens: TokenList,
    pub(super) context: Context,
    once: bool,
}

impl SlaveHost {
    /// Listens. Call it inside of a tokio runtime with I/O and time.
    ///
    /// # Errors
    /// The configuration is not accepted, the address cannot be listened on, the identity is unusable or has no token of an
    /// operator.
    pub fn bind(options: SlaveOptions) -> Result<Self, SlaveHostError> {
        options.transport.permit(options.listen)?;
        let trial = Slave::try_new(&options.config, Coupling::for_stiffness(TRIAL_STIFFNESS))?;
        let scheme = options.config.trigger.scheme.to_string();
        let clock = Clock::start();
        let (observers, emergency) = (options.observers, options.emergency.clone());
        let welcome = trial.welcome(observers::NO_RESUME, &scheme, PROGRAM);
        let observers = Observers::new(observers, clock, emergency, welcome);
        let own = options.identity.tokens().of_operator();
        let own = own.ok_or(SlaveHostError::NoOperator)?.token;
        let unusable = |source| SlaveHostError::Socket {
            address: options.listen,
            source,
        };
        let inner = socket::for_quic(socket::bind(options.listen)?).map_err(unusable)?;
        let netem = options.netem.to_string();
        let (seed, extras) = (options.netem_seed, options.netem_extras);
        let emulated = EmulatedSocket::try_new(inner, options.netem, seed, LinkId::DOWN, extras)?;
        let meter = emulated.meter();
        let socket = Arc::new(emulated);
        let endpoint = Endpoint::of_slave(options.transport, socket, &options.identity, TRAFFIC)?;
        let address = endpoint.local_addr().map_err(unusable)?;
        let pairing = Pairing {
            address: Address {
                host: host_of(address.ip()),
                port: address.port(),
            },
            pin: options.identity.pin(),
            token: own,
        };
        let context = Context {
            clock,
            config: options.config,
            listen: address.to_string(),
            transport: options.transport,
            netem,
            meter,
            listener: Arc::new(Listener::new(endpoint.clone())),
            refusals: Arc::new(Refusals::default()),
            truth: Mutex::new(options.truth),
            record: options.record,
            emergency: options.emergency,
            plant: options.plant,
            observers: Arc::new(observers),
        };
        Ok(Self {
            endpoint,
            address,
            pairing,
            tokens: TokenList::of(&options.identity),
            context,
            once: options.once,
        })
    }

    /// Where it listens, with the port that the system chose if it was asked to.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// What a master needs. Without `host` it names the address listened on; if that is a wildcard, the
    /// address that this machine reaches the world with, or loopback if it reaches none.
    pub fn pairing(&self, host: Option<Host>) -> Pairing {
        let mut pairing = self.pairing.clone();
        if let Some(host) = host {
            pairing.address.host = host;
        }
        pairing
    }

    /// Serves masters until `stop` ends the run or its sender is gone, or, with `once`, until the first session
    /// is over. The report is that of the last session, none if there was none.
    ///
    /// # Errors
    /// The 1 kHz thread panicked, which the session's master has learnt, or could not be started, which
    /// closes the connection.
    pub async fn run(
        self,
        mut stop: watch::Receiver<Wish>,
        live: Arc<watch::Sender<SlaveLive>>,
    ) -> Result<Option<SlaveReport>, SlaveHostError> {
        let (tokens, refusals) = (self.tokens.clone(), Arc::clone(&self.context.refusals));
        let observers = Arc::clone(&self.context.observers);
        let (acceptor, masters) = Acceptor::new(tokens, observers, refusals, stop.clone());
        let listener = Arc::clone(&self.context.listener);
        let (served, ()) = tokio::join!(
            async {
                let served = self.serve(masters, &mut stop, &live).await;
                let wish = *stop.borrow();
                self.context.observers.end(wish).await;
                self.endpoint.close(CLOSE_FINISHED, b"the slave has ended");
                served
            },
            acceptor.run(listener),
        );
        live.send_replace(SlaveLive::default());
        // Whoever does not answer is left alone.
        let _ = timeout(CLOSING, self.endpoint.wait_idle()).await;
        served
    }

    async fn serve(
        &self,
        mut masters: mpsc::Receiver<Admitted>,
        stop: &mut watch::Receiver<Wish>,
        live: &watch::Sender<SlaveLive>,
    ) -> Result<Option<SlaveReport>, SlaveHostError> {
        let (mut last, mut memory) = (None, None);
        let mut socket_before = self.context.meter.snapshot();
        loop {
            let admitted = tokio::select! {
                biased;
                _ = asked_to_stop(stop) => return Ok(last),
                admitted = masters.recv() => admitted,
            };
            let Some(admitted) = admitted else {
                return Ok(last);
            };
            let (context, earlier) = (&self.context, memory.as_ref());
            let served =
                session::serve(context, admitted, earlier, socket_before, stop, live).await?;
            socket_before = self.context.meter.snapshot();
            live.send_replace(SlaveLive::default());
            context.observers.session_over();
            let Some(served) = served else {
                continue;
            };
            (last, memory) = (Some(served.report), Some(served.memory));
            if self.once && !served.taken_over {
                return Ok(last);
            }
        }
    }
}

fn host_of(address: IpAddr) -> Host {
    let address = address.to_canonical();
    match if address.is_unspecified() {
        address_for_others().unwrap_or(Ipv4Addr::LOCALHOST.into())
    } else {
        address
    } {
        IpAddr::V4(address) => Host::V4(address),
        IpAddr::V6(address) => Host::V6(address),
    }
}

/// The address by which other hosts reach this one: the one that it would use towards the world, without a route there
/// that of an interface. No packet is sent to find out. None if this host has no interface for others.
pub fn address_for_others() -> Option<IpAddr> {
    // Documentation addresses (RFC 5737, RFC 3849): routed like any other, and nobody's.
    let v4 = local_address_towards((Ipv4Addr::UNSPECIFIED, 0), (Ipv4Addr::new(192, 0, 2, 1), 9));
    let world = Ipv6Addr::new(0x2001, 0xdb8, 0, 0, 0, 0, 0, 1);
    let v6 = || local_address_towards((Ipv6Addr::UNSPECIFIED, 0), (world, 9));
    v4.or_else(v6).or_else(address_of_an_interface)
}

/// The first address of an interface that is up and for others, IPv4 before IPv6; a link-local IPv6 address, which names no
/// interface, is none.
fn address_of_an_interface() -> Option<IpAddr> {
    let interfaces = getifaddrs().ok()?;
    let up = interfaces.filter(|interface| {
        let flags = interface.flags;
        flags.contains(InterfaceFlags::IFF_UP) && !flags.contains(InterfaceFlags::IFF_LOOPBACK)
    });
    let address = |of: InterfaceAddress| {
        let storage = of.address?;
        let v4 = storage.as_sockaddr_in().map(|v4| IpAddr::V4(v4.ip()));
        let v6 = storage.as_sockaddr_in6().map(|v6| v6.ip());
        v4.or(v6.filter(|v6| !v6.is_unicast_link_local()).map(IpAddr::V6))
    };
    up.filter_map(address).min_by_key(IpAddr::is_ipv6)
}

fn local_address_towards(from: impl Into<SocketAddr>, to: impl Into<SocketAddr>) -> Option<IpAddr> {
    let socket = UdpSocket::bind(from.into()).ok()?;
    socket.connect(to.into()).ok()?;
    socket.local_addr().ok().map(|address| address.ip())
}
