//! The master as a host on the network: QUIC endpoint and the haptic thread.
//!
//! Nothing is decided here that the master's end could decide.

#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "the shell: clocks, threads and sockets are its business"
)]

pub mod console;
pub mod device;
mod end;
mod error;
pub mod hand_events;
pub mod haptic;
mod observe;
mod open;
mod options;
pub mod record;
mod report;
mod resume;
mod session;
#[cfg(test)]
mod tests;

use mmt_shared::channel::peer::Loss;
use mmt_shared::model::architecture::Architecture;
use mmt_shared::model::geometry::{BoxFootprint, Pose, Vec2};
use mmt_shared::model::tool::Scene;
use mmt_shared::model::update::Cause;
use mmt_shared::report::MasterSession;
use mmt_shared::wire::{Side, ToolState};
use serde::Serialize;

use crate::commands::CommandConfig;
use crate::device::DeviceProfile;
use crate::end::Change;
use crate::failsafe::LinkState;
use crate::operator::pointer::{Driver, Person};
use crate::operator::scripted::ScriptedConfig;

pub use end::SessionEnd;
pub use error::MasterHostError;
pub use observe::{ObserverConfiguration, ObserverOptions, ObserverReport, observe};
pub use options::{MasterOptions, OperatorChoice, SharedPath};
pub use resume::ResumeFile;
pub use session::run;

/// A snapshot of a running master, for a screen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct MasterLive {
    /// Seconds since the session began.
    pub elapsed_s: f64,
    /// The HIP, m.
    pub hip: Vec2,
    /// f_m, N, on the object.
    pub f_m: Vec2,
    /// Force on the hand after the limiter, N.
    pub hand_force: Vec2,
    /// The local model's pose.
    pub model: Pose,
    /// The local model's footprint.
    pub footprint: Option<BoxFootprint>,
    /// m, b, c in use.
    pub params: [f64; 3],
    /// The remote scene as it last came, where somebody wants to see it.
    pub scene: Option<Scene>,
    /// How old it is: the time since the HIP sample that it shows the answer to, s.
    pub scene_age_s: Option<f64>,
    /// Whether the HIP touches the model.
    pub in_contact: bool,
    /// The proxy: the HIP's foot on the face that it touches, m.
    pub proxy: Option<Vec2>,
    /// Whether force may act on the hand.
    pub engaged: bool,
    /// Whose emergency stop is set.
    pub stopped_by: Option<Side>,
    /// What the slave's tool does, by its newest datagram.
    pub tool_state: ToolState,
    /// Whether the limit of its energy holds the tool.
    pub tool_energy_holds: bool,
    /// The person, where one operates.
    pub person: Option<PersonLive>,
    /// What the newest applied update found wrong in the model.
    pub change: Option<Change>,
    /// Updates applied, by cause.
    pub updates_applied: [u64; Cause::ALL.len()],
    /// Pushes completed.
    pub pushes: Option<u64>,
    /// The link.
    pub link: LinkState,
    /// Median round trip, ms.
    pub rtt_ms: Option<f64>,
    /// What of the datagrams that the master sent reached the slave's host.
    pub up: Loss,
    /// What of the slave's datagrams reached this host; what the slave did not send is in what is missing.
    pub down: Loss,
    /// Datagrams that the master itself overtook or could not send.
    pub unsent: u64,
    /// Late wake-ups of the haptic loop so far: p99, µs.
    pub lateness_p99_us: f64,
    /// Ticks skipped.
    pub skipped: u64,
    /// Why the session ended; none while it runs.
    pub ended: Option<SessionEnd>,
}

/// A person at a pointer, for a screen.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PersonLive {
    /// Who moves the HIP.
    pub driver: Driver,
    /// Whether the hand rests.
    pub paused: bool,
}

impl From<&Person> for PersonLive {
    fn from(person: &Person) -> Self {
        Self {
            driver: person.driver(),
            paused: person.is_paused(),
        }
    }
}

/// The configuration as the report shows it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MasterConfiguration {
    /// The slave's address.
    pub slave: String,
    /// What carried the session: `quic` or `udp`.
    pub transport: &'static str,
    /// The device.
    pub device: DeviceProfile,
    /// `scripted`, `scripted or pointer`, `pointer`, `device link`, `device inverse3`, `device 2diy` or the trace's name.
    pub operator: String,
    /// The scripted operator's numbers.
    pub scripted: Option<ScriptedConfig>,
    /// Whose force the hand felt: `mmt` or `tdpa`.
    pub architecture: Architecture,
    /// How commands were made.
    #[serde(flatten)]
    pub commands: CommandConfig,
    /// Emulated network on what the master sends.
    pub netem: String,
}

/// A master host's session.
pub type MasterReport = MasterSession<MasterConfiguration>;
