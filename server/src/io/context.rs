//! What every session needs of its host, and why a host fails.

use std::io;
use std::net::SocketAddr;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use mmt_netem::io::socket::{SocketMeter, WrapError};
use mmt_shared::io::clock::Clock;
use mmt_shared::io::emergency::EmergencyStop;
use mmt_shared::io::loop_thread::LoopHandle;
use mmt_shared::io::quic::EndpointError;
use mmt_shared::io::record::Recorder;
use mmt_shared::io::socket::BindError;
use mmt_shared::io::transport::{Insecure, Listener, Transport};
use mmt_shared::io::truth::TruthSender;

use super::SlaveConfiguration;
use super::acceptor::Refusals;
use super::observers::Observers;
use super::plant_link::PlantHost;
use crate::slave::{SlaveConfig, SlaveError};

/// Why a slave host could not start or go on.
#[derive(Debug, thiserror::Error)]
pub enum SlaveHostError {
    /// Raw UDP beyond this host, and nobody insists.
    #[error(transparent)]
    Insecure(#[from] Insecure),
    /// The port is taken or the address is not this host's.
    #[error("cannot listen: {0}")]
    Bind(#[from] BindError),
    /// The socket cannot be used.
    #[error("cannot listen on {address}: {source}")]
    Socket {
        /// Where.
        address: SocketAddr,
        /// The system's error.
        source: io::Error,
    },
    /// The emulated network cannot be made.
    #[error("cannot emulate the network: {0}")]
    Netem(#[from] WrapError),
    /// QUIC cannot start.
    #[error("cannot start QUIC: {0}")]
    Endpoint(#[from] EndpointError),
    /// Nobody could operate it.
    #[error("the identity has no token of an operator")]
    NoOperator,
    /// The configuration's numbers are not accepted.
    #[error("the slave's configuration: {0}")]
    Slave(#[from] SlaveError),
    /// The 1 kHz thread cannot start.
    #[error("cannot start the 1 kHz thread: {0}; see the limits on threads and descriptors")]
    Thread(#[from] io::Error),
    /// The 1 kHz thread panicked: a bug.
    #[error("the slave's 1 kHz thread panicked: please report this with what was printed above")]
    Panicked,
    /// A tick of the 1 kHz thread did not end; the tool stands, because nothing else moves it.
    #[error(
        "the slave's 1 kHz thread has hung: the tool stands and the process ends; please report this with what was \
         printed above"
    )]
    Hung,
}

impl SlaveHostError {
    /// Why a loop left nothing that it ended with.
    pub(super) fn of_loop<S: Send, T>(of: &LoopHandle<S, T>) -> Self {
        if of.has_hung() {
            Self::Hung
        } else {
            Self::Panicked
        }
    }
}

/// What every session needs of its host.
pub(super) struct Context {
    pub(super) clock: Clock,
    pub(super) config: SlaveConfig,
    pub(super) listen: String,
    pub(super) transport: Transport,
    pub(super) netem: String,
    pub(super) meter: SocketMeter,
    pub(super) listener: Arc<Listener>,
    pub(super) refusals: Arc<Refusals>,
    /// Until a session has taken it.
    pub(super) truth: Mutex<Option<TruthSender>>,
    pub(super) record: Option<Recorder>,
    pub(super) emergency: EmergencyStop,
    pub(super) plant: Option<PlantHost>,
    pub(super) observers: Arc<Observers>,
}

impl Context {
    /// The true pose's way to a master of this process; for the first session that asks.
    pub(super) fn take_truth(&self) -> Option<TruthSender> {
        let mut truth = self.truth.lock().unwrap_or_else(PoisonError::into_inner);
        truth.take()
    }

    /// Who and what was turned away since the host was started, by name.
    pub(super) fn refusals(&self) -> [(&'static str, u64); 12] {
        let read = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        let refusals = &self.refusals;
        [
            ("masters_busy", read(&refusals.busy)),
            ("masters_wrong_token", read(&refusals.wrong_token)),
            ("masters_bad_hello", read(&refusals.bad_hello)),
            ("masters_ending", read(&refusals.ending)),
            ("masters_wrong_role", read(&refusals.wrong_role)),
            ("observers_full", read(&refusals.observers_full)),
            ("masters_no_hello", read(&refusals.no_hello)),
            ("masters_crowded", read(&refusals.crowded)),
            ("handshakes_failed", read(&refusals.handshake)),
            ("handshakes_panicked", read(&refusals.panicked)),
            ("handshakes_unreadable", self.listener.unreadable()),
            (
                "observer_commands_refused",
                self.observers.commands_refused(),
            ),
        ]
    }

    pub(super) fn configuration(&self, slave: &SlaveConfig) -> SlaveConfiguration {
        SlaveConfiguration {
            listen: self.listen.clone(),
            transport: self.transport.name(),
            slave: slave.clone(),
            netem: self.netem.clone(),
        }
    }
}
