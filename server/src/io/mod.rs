//! The slave as a host on the network: QUIC endpoint, one session at a time, the 1 kHz thread.
//!
//! Nothing is decided here that the slave's end could decide.

#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "the shell: clocks, threads and sockets are its business"
)]

mod acceptor;
mod context;
mod crowd;
mod host;
mod lease;
mod observer_session;
mod observers;
pub mod plant_link;
mod record;
mod session;
mod slave_loop;
#[cfg(test)]
mod tests;
mod welcome;

use std::net::SocketAddr;

use mmt_netem::LinkConfig;
use mmt_netem::io::socket::SocketExtras;
use mmt_shared::channel::peer::Loss;
use mmt_shared::io::emergency::EmergencyStop;
use mmt_shared::io::identity::Identity;
use mmt_shared::io::record::Recorder;
use mmt_shared::io::transport::Transport;
use mmt_shared::io::truth::TruthSender;
use mmt_shared::model::geometry::{BoxFootprint, Pose, Vec2};
use mmt_shared::model::update::Cause;
use mmt_shared::report::SlaveSession;
use mmt_shared::wire::Side;
use serde::Serialize;

use crate::slave::SlaveConfig;

pub use context::SlaveHostError;
pub use host::{SlaveHost, address_for_others};
use plant_link::PlantHost;

/// Name and version of this program, as it gives them to the other side.
const PROGRAM: &str = concat!("mmt ", env!("CARGO_PKG_VERSION"));

/// How a slave host runs.
#[derive(Debug)]
pub struct SlaveOptions {
    /// Where to listen.
    pub listen: SocketAddr,
    /// What carries sessions.
    pub transport: Transport,
    /// Certificate, key and token.
    pub identity: Identity,
    /// The slave of every session.
    pub config: SlaveConfig,
    /// Emulated network on what the slave sends.
    pub netem: LinkConfig,
    /// Seed of the emulated network.
    pub netem_seed: u64,
    /// Record and control of the emulated network.
    pub netem_extras: SocketExtras,
    /// End after the first session.
    pub once: bool,
    /// How many observers may look on at a time.
    pub observers: u8,
    /// Takes the object's true pose to a master of this process, for its report; of the first session only.
    pub truth: Option<TruthSender>,
    /// Where sessions are recorded, if anybody wants that.
    pub record: Option<Recorder>,
    /// The emergency stop of this side; it outlives sessions.
    pub emergency: EmergencyStop,
    /// The plant that is plugged in, where the configuration asks for one.
    pub plant: Option<PlantHost>,
}

/// A snapshot of a running slave, for a screen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct SlaveLive {
    /// Whether a master is connected.
    pub connected: bool,
    /// Seconds since the session began.
    pub elapsed_s: f64,
    /// f_s, N.
    pub f_s: Vec2,
    /// f_m of the shadow, N.
    pub f_shadow: Vec2,
    /// Updates sent, by cause, in the order of [`Cause::ALL`].
    pub updates: [u64; Cause::ALL.len()],
    /// m, b, c as estimated.
    pub estimate: [f64; 3],
    /// The tool, m.
    pub tool: Vec2,
    /// The object's true pose.
    pub truth: Pose,
    /// The object's true footprint.
    pub footprint: Option<BoxFootprint>,
    /// Whose emergency stop is set.
    pub stopped_by: Option<Side>,
    /// Whether the slave is in contact.
    pub in_contact: bool,
    /// Median round trip, ms.
    pub rtt_ms: Option<f64>,
    /// What of the master's datagrams reached this host; what the master did not send is in what is missing.
    pub up: Loss,
    /// Datagrams that the slave itself overtook or could not send.
    pub unsent: u64,
}

/// The configuration as the report shows it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SlaveConfiguration {
    /// Where it listened.
    pub listen: String,
    /// What carries sessions: `quic` or `udp`.
    pub transport: &'static str,
    /// The slave.
    pub slave: SlaveConfig,
    /// Emulated network on what the slave sends.
    pub netem: String,
}

/// A slave host's last session.
pub type SlaveReport = SlaveSession<SlaveConfiguration>;
