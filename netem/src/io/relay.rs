//! The *relay* driver: a UDP relay with an emulated link in each direction.
//!
//! Clients send to the relay instead of to the target; each gets a socket of its own toward the target,
//! so that the target sees one address per client. All clients share the two links, as they would share
//! one path. Everything happens on one thread.

use std::io;
use std::net::{SocketAddr, UdpSocket};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

use mmt_shared::io::alarm::Alarm;
use mmt_shared::stats::histogram::Quantiles;
use mmt_shared::time::Time;
use serde::Serialize;

use super::capture_file::CaptureWriter;
use super::driver::{DirectionCounters, Driver, SidesOf};
use super::lateness::{Lateness, Recorder};
use super::record_file::RecordWriter;
use super::{lock, now};
use crate::config::{ConfigError, LinkConfig};
use crate::counters::Tally;
use crate::direction::LinkId;

mod clients;
mod origin;
mod pace;
mod port;
mod sockets;
mod standing;
#[cfg(test)]
mod tests;
mod worker;

use clients::Clients;
use origin::Origin;
use port::Port;
use worker::Worker;

/// Clients at one time unless [`Extras::clients`] sets another number. One more takes the place of one that does not talk with
/// the target; where all do, its datagrams are dropped and counted. Each holds one descriptor.
pub const CLIENTS: usize = 64;
/// A client without a datagram in either direction for this long is forgotten: four times QUIC's own
/// idle timeout in this project.
pub const CLIENT_IDLE: Duration = Duration::from_secs(60);

/// A relay could not be started, or broke.
#[derive(Debug, thiserror::Error)]
pub enum RelayError {
    /// The settings of a link are out of range.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The target is no address to send to.
    #[error("relay target {to}: give the address and the port of a host")]
    Target {
        /// The target given.
        to: SocketAddr,
    },
    /// The relay would send to itself.
    #[error("relay target {to} is the relay's own address: its packets would go round for ever")]
    Loop {
        /// The target given.
        to: SocketAddr,
    },
    /// The address to listen on cannot be had.
    #[error("relay cannot listen on {listen}: {source}")]
    Listen {
        /// The address given.
        listen: SocketAddr,
        /// The system's answer.
        source: io::Error,
    },
    /// The system gave no event descriptor or no thread.
    #[error("no thread for the relay: {0}")]
    Thread(io::Error),
    /// The relay's thread ended by itself.
    #[error("the relay broke off: {0}")]
    Broken(io::Error),
}

/// What the relay did so far. The counts of one snapshot are those of one moment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct RelaySnapshot {
    /// From the clients (masters) to the target (slave).
    pub up: DirectionCounters,
    /// From the target (slave) to the clients (masters).
    pub down: DirectionCounters,
    /// Clients that have a place at the relay now.
    pub clients: u64,
    /// Clients that the relay met since its start.
    pub clients_met: u64,
    /// Clients that had to make room for newer ones: there were as many as there can be, and they did not talk with the target.
    pub clients_displaced: u64,
    /// Datagrams from clients for which nobody had to make room, or without a socket to be had: never offered.
    pub refused: Tally,
    /// Datagrams from clients that the kernel dropped because the relay did not read in time: never offered.
    pub overflows_up: u64,
    /// The same of datagrams from the target.
    pub overflows_down: u64,
    /// Times that the target's host answered that nobody listens there (ICMP port unreachable).
    pub unreachable: u64,
    /// Other errors of receiving.
    pub receive_errors: u64,
    /// Times that a client got a new port toward the target.
    pub rebinds: u64,
    /// Packets that the record misses, because the disk was too slow.
    pub unrecorded: u64,
    /// Packets that the capture misses, because the disk was too slow.
    pub uncaptured: u64,
    /// How late packets left, both directions.
    pub lateness: Lateness,
}

/// What a relay can do besides.
#[derive(Debug, Default)]
pub struct Extras {
    /// Where every packet is recorded.
    pub record: Option<RecordWriter>,
    /// Where every packet is kept, as it came and as it left.
    pub capture: Option<CaptureWriter>,
    /// How often every client gets a new port toward the target, as behind a NAT that forgets: what the
    /// target sends to the old port is lost.
    pub rebind_every: Option<Duration>,
    /// Clients at one time; none: [`CLIENTS`].
    pub clients: Option<usize>,
}

/// What the handle asks of the thread.
#[derive(Debug, Default)]
pub(super) struct Commands {
    pub(super) links: Option<(LinkConfig, LinkConfig)>,
    rebind: bool,
}

/// The relay as such: [`Relay::bind`] starts one.
#[derive(Debug)]
pub struct Relay;

impl Relay {
    /// Starts a relay from `listen` to `to` on a thread of its own. `up` is the link from client (master)
    /// to target (slave), `down` the way back; both draw from `seed`.
    ///
    /// # Errors
    /// Settings out of range, a target that cannot be one, an address in use, no thread to be had.
    pub fn bind(
        listen: SocketAddr,
        to: SocketAddr,
        up: LinkConfig,
        down: LinkConfig,
        seed: u64,
        extras: Extras,
    ) -> Result<RelayHandle, RelayError> {
        let (origin, shared) = (now(), Shared::try_new()?);
        let [up, down] = drivers([up, down], seed, origin, &shared, &extras, Origin::sides)?;
        if to.port() == 0 || to.ip().is_unspecified() {
            return Err(RelayError::Target { to });
        }
        let (port, local) = listen_on(listen).map_err(|source| {
            if listen == to {
                RelayError::Loop { to }
            } else {
                RelayError::Listen { listen, source }
            }
        })?;
        if local == to {
            return Err(RelayError::Loop { to });
        }
        let clients = Clients::try_new(to, extras.clients.unwrap_or(CLIENTS));
        let clients = clients.map_err(RelayError::Thread)?;
        let mut worker = Worker::new((port, local), clients, up, down, shared.clone());
        worker.rebind_every(extras.rebind_every, origin);
        worker.writes_to(extras.record, extras.capture);
        RelayHandle::start("netem-relay", Some(local), shared, move || worker.run())
    }
}

/// The links up and down of a driver; times count from `origin`.
pub(super) fn drivers<A: Clone>(
    [up, down]: [LinkConfig; 2],
    seed: u64,
    origin: Time,
    shared: &Shared,
    extras: &Extras,
    sides: SidesOf<A>,
) -> Result<[Driver<A>; 2], ConfigError> {
    let driver = |config, id, delays: &Arc<Recorder>| {
        let (record, lateness) = (extras.record.clone(), Arc::clone(&shared.lateness));
        let driver = Driver::try_new(config, seed, id, origin, record, lateness)?;
        let driver = driver.timed(Arc::clone(delays));
        Ok(driver.captured(extras.capture.clone(), sides))
    };
    let [of_up, of_down] = &shared.delays;
    Ok([
        driver(up, LinkId::UP, of_up)?,
        driver(down, LinkId::DOWN, of_down)?,
    ])
}

fn listen_on(listen: SocketAddr) -> io::Result<(Port, SocketAddr)> {
    let socket = UdpSocket::bind(listen)?;
    let local = socket.local_addr()?;
    Ok((Port::try_new(socket)?, local))
}

/// A running relay or tunnel. Dropping it stops it; packets in flight are lost.
#[derive(Debug)]
pub struct RelayHandle {
    /// None: it listens on no address.
    local: Option<SocketAddr>,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<io::Result<()>>>,
}

/// What the relay's thread and its handle share.
#[derive(Debug)]
pub(super) struct Shared {
    pub(super) alarm: Alarm,
    pub(super) stopping: AtomicBool,
    pub(super) commands: Mutex<Commands>,
    /// The counts as of the thread's last round, without the lateness.
    pub(super) board: Mutex<RelaySnapshot>,
    lateness: Arc<Recorder>,
    /// Delays up and down since somebody last asked.
    delays: [Arc<Recorder>; 2],
}

impl Shared {
    pub(super) fn try_new() -> Result<Arc<Self>, RelayError> {
        Ok(Arc::new(Self {
            alarm: Alarm::try_new().map_err(RelayError::Thread)?,
            stopping: AtomicBool::new(false),
            commands: Mutex::default(),
            board: Mutex::default(),
            lateness: Arc::default(),
            delays: Default::default(),
        }))
    }
}

impl RelayHandle {
    /// Starts the thread.
    pub(super) fn start(
        name: &str,
        local: Option<SocketAddr>,
        shared: Arc<Shared>,
        run: impl FnOnce() -> io::Result<()> + Send + 'static,
    ) -> Result<Self, RelayError> {
        let thread = std::thread::Builder::new().name(name.to_owned()).spawn(run);
        Ok(Self {
            local,
            shared,
            thread: Some(thread.map_err(RelayError::Thread)?),
        })
    }

    /// The address that the relay listens on, with the port that the system chose if none was given; 0.0.0.0:0 of a
    /// tunnel.
    #[must_use]
    pub fn local_addr(&self) -> SocketAddr {
        let none = SocketAddr::from(([0; 4], 0));
        self.local.unwrap_or(none)
    }

    /// What the relay did so far.
    #[must_use]
    pub fn snapshot(&self) -> RelaySnapshot {
        RelaySnapshot {
            lateness: self.shared.lateness.summary(),
            ..*lock(&self.shared.board)
        }
    }

    /// Delays, up and down, of what was sent on since the last call: from its arrival here to its departure.
    #[must_use]
    pub fn take_delays(&self) -> [Quantiles; 2] {
        let [up, down] = &self.shared.delays;
        [up.take(), down.take()]
    }

    /// New settings for both directions from now on ([`crate::Link::reconfigure`]).
    ///
    /// # Errors
    /// A setting out of its range; the old settings stay.
    pub fn reconfigure(&self, up: LinkConfig, down: LinkConfig) -> Result<(), ConfigError> {
        up.check()?;
        down.check()?;
        lock(&self.shared.commands).links = Some((up, down));
        self.shared.alarm.ring();
        Ok(())
    }

    /// Gives every client a new port toward the target, once, now.
    pub fn rebind(&self) {
        lock(&self.shared.commands).rebind = true;
        self.shared.alarm.ring();
    }

    /// Whether the relay is at work; false after an error that [`Self::stop`] returns.
    #[must_use]
    pub fn is_running(&self) -> bool {
        self.thread
            .as_ref()
            .is_some_and(|thread| !thread.is_finished())
    }

    /// Stops the relay and returns what it did. Packets in flight are lost and show as such.
    ///
    /// # Errors
    /// The error by which the relay had ended before.
    pub fn stop(mut self) -> Result<RelaySnapshot, RelayError> {
        self.end().map_err(RelayError::Broken)?;
        Ok(self.snapshot())
    }

    fn end(&mut self) -> io::Result<()> {
        self.shared.stopping.store(true, Ordering::Release);
        self.shared.alarm.ring();
        match self.thread.take().map(JoinHandle::join) {
            None => Ok(()),
            Some(Ok(result)) => result,
            Some(Err(_)) => Err(io::Error::other("its thread panicked")),
        }
    }
}

impl Drop for RelayHandle {
    fn drop(&mut self) {
        // Whoever wants to know the error calls `stop`.
        let _ = self.end();
    }
}
