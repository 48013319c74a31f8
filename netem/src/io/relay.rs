//! The *relay* driver: a UDP relay with an emulated link in each direction.
//!
//! Clients send to the relay instead of to the target; each gets a socket of its own toward the target,
//! so that the target sees one address per client. All clients share the two links, as they would share
//! one path. Everything happens on one thread.

use std::io;
use std::net::{SocketAddr, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread::JoinHandle;
use std::time::Duration;

use mmt_shared::stats::histogram::Quantiles;
use mmt_shared::time::Time;

use super::capture_file::CaptureWriter;
use super::driver::{Driver, SidesOf};
use super::lateness::Recorder;
use super::record_file::RecordWriter;
use super::{lock, now};
use crate::config::{ConfigError, LinkConfig};
use crate::direction::LinkId;

mod clients;
mod error;
mod origin;
mod pace;
mod port;
mod shared;
mod sockets;
mod standing;
#[cfg(test)]
mod tests;
mod worker;

pub use clients::CLIENT_IDLE;
use clients::Clients;
pub use error::RelayError;
use origin::Origin;
use port::Port;
pub use shared::RelaySnapshot;
pub(super) use shared::Shared;
use worker::Worker;

/// Clients at one time unless [`Extras::clients`] sets another number. One more takes the place of one that does not talk with
/// the target; where all do, its datagrams are dropped and counted. Each holds one descriptor.
pub const CLIENTS: usize = 64;

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
