//! The messages, as the two sides think of them.
//!
//! Datagrams: command, with or without the hand's port (master to slave); update, scene, tool (slave to master);
//! heartbeat (both). Stream: hello, welcome, refusal, farewell. "Up" is master to slave, "down" is slave to master.

use serde::{Deserialize, Serialize};

use super::label::Label;
use super::samples::SampleBlock;
use crate::contact::Coupling;
use crate::geometry::{Pose, Vec2};
use crate::pairing::Token;
use crate::params::ModelState;
use crate::settings::ModelSettings;
use crate::time::Time;

/// What every datagram carries besides its own matter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Envelope {
    /// Number of this datagram in its direction, from 1, whatever its type: the receiver counts loss by it.
    pub number: u32,
    /// When it was sent, by the sender's clock.
    pub sent: Time,
    /// The newest datagram that the sender has from the other side; none before the first.
    pub echo: Option<Echo>,
}

/// The answer to a stamp: from it the other side computes the round-trip time without a common clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Echo {
    /// Number of the newest datagram received from the other side.
    pub number: u32,
    /// That datagram's `sent`, by the other side's clock.
    pub sent: Time,
    /// How long it was held before this answer, ns.
    pub held_ns: u64,
    /// How many datagrams have been received from the other side so far.
    pub received: u32,
}

/// A point on the wire's grid of 0.1 µm. The master rounds the device's reading to it before anything
/// else, so that both sides compute with the same bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct HipCounts {
    /// x, 0.1 µm.
    pub x: i32,
    /// y, 0.1 µm.
    pub y: i32,
}

impl HipCounts {
    /// One count, m.
    pub const METRES: f64 = 1e-7;

    /// The grid point nearest to `hip` (m), saturating at ±214 m; a NaN becomes 0.
    #[must_use]
    pub fn nearest(hip: Vec2) -> Self {
        let count = |metres: f64| libm::round(metres / Self::METRES) as i32;
        Self {
            x: count(hip.x),
            y: count(hip.y),
        }
    }

    /// The point, m.
    #[must_use]
    pub fn metres(self) -> Vec2 {
        Vec2::new(
            f64::from(self.x) * Self::METRES,
            f64::from(self.y) * Self::METRES,
        )
    }
}

/// A force on the wire's grid of 0.1 mN.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ForceCounts {
    /// x, 0.1 mN.
    pub x: i32,
    /// y, 0.1 mN.
    pub y: i32,
}

impl ForceCounts {
    /// One count, N.
    pub const NEWTONS: f64 = 1e-4;

    /// The grid point nearest to `force` (N), saturating; a NaN becomes 0.
    #[must_use]
    pub fn nearest(force: Vec2) -> Self {
        let count = |newtons: f64| libm::round(newtons / Self::NEWTONS) as i32;
        Self {
            x: count(force.x),
            y: count(force.y),
        }
    }

    /// The force, N.
    #[must_use]
    pub fn newtons(self) -> Vec2 {
        Vec2::new(
            f64::from(self.x) * Self::NEWTONS,
            f64::from(self.y) * Self::NEWTONS,
        )
    }
}

/// One tick of the master: where the HIP was and the force that the local model rendered for it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HipSample {
    /// The tick's stamp by the master's clock.
    pub stamp: Time,
    /// HIP in the world.
    pub hip: HipCounts,
    /// f_m, the force on the object that the local model computed for this HIP, before the limiter.
    pub force: ForceCounts,
}

/// The master's motion since its last command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Command {
    /// Number of the newest update that the master has accepted, 0 before the first: the
    /// acknowledgement that the shadow needs.
    pub newest_update: u32,
    /// One sample or more.
    pub samples: SampleBlock,
    /// The hand's port, where the hand may feel the tool's force.
    pub port: Option<HandPort>,
}

/// What the hand's port says to the tool's: time-domain passivity control (TDPA) holds each side to what went in at
/// the other (`docs/baselines.md`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct HandPort {
    /// E_in, the energy that went in at the hand so far, J; it only grows.
    pub in_j: f64,
    /// Whether the slave is to say the tool's force every tick.
    pub wants_force: bool,
    /// Whether the tool is to go only as far as the hand has paid for.
    pub passive_tool: bool,
}

/// What the tool feels, where the hand may feel it too.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tool {
    /// Stamp of the HIP sample that the tool was at, by the master's clock: its age is the round trip that the hand
    /// would feel, play-out included.
    pub answers: Time,
    /// f_s, the measured contact force on the object; none where the master has not asked for it.
    pub force: Option<ForceCounts>,
    /// Whether the tool touches the object.
    pub in_contact: bool,
    /// E_in of the tool's port, J; it only grows.
    pub in_j: f64,
    /// Relative force error of the local model over the last half second of contact, 0 to 1.
    pub model_error: f64,
}

/// Why an update was sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Cause {
    /// (12): the force error left the deadband.
    Deadband,
    /// T_update passed since the last update.
    Timer,
    /// Section III-A, case 1: the master touches, the slave does not.
    MasterOnlyContact,
    /// Section III-A, case 2: the slave touches, the master does not.
    SlaveOnlyContact,
    /// The slave lost contact.
    ContactLost,
    /// The scheme sends every sample.
    EverySample,
}

impl Cause {
    /// All causes, in the order of their numbers on the wire.
    pub const ALL: [Self; 6] = [
        Self::Deadband,
        Self::Timer,
        Self::MasterOnlyContact,
        Self::SlaveOnlyContact,
        Self::ContactLost,
        Self::EverySample,
    ];

    /// Its number on the wire and its place in [`Cause::ALL`].
    #[must_use]
    pub const fn number(self) -> usize {
        self as usize
    }

    /// The name used in reports, files and on screens.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Deadband => "deadband",
            Self::Timer => "timer",
            Self::MasterOnlyContact => "master_only_contact",
            Self::SlaveOnlyContact => "slave_only_contact",
            Self::ContactLost => "contact_lost",
            Self::EverySample => "every_sample",
        }
    }
}

/// What an update says: the whole state at one HIP sample, so that it supersedes all earlier ones.
///
/// Off the wire comes a [`RawUpdate`](super::RawUpdate); only its `accept` makes one of these.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Update {
    /// Number of the update, from 1, strictly increasing.
    pub sequence: u32,
    /// Why it was sent.
    pub cause: Cause,
    /// Stamp of the HIP sample that it answers, by the master's clock.
    pub answers: Time,
    /// Number of the newest command that the slave has seen.
    pub newest_command: u32,
    /// Whether the slave's tool touches the object.
    pub slave_in_contact: bool,
    /// Parameters, footprint, pose and velocity of the object at that sample.
    pub state: ModelState,
}

/// What a viewer sees of the remote scene between updates; the model never uses it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Scene {
    /// Stamp of the HIP sample that the slave was at, by the master's clock.
    pub answers: Time,
    /// The object as the slave sees it.
    pub object: Pose,
    /// The tool, m.
    pub tool: Vec2,
    /// Measured contact force f_s on the object, N.
    pub force: Vec2,
}

/// What a master wants to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Role {
    /// Moves the tool; one at a time.
    Operator,
}

/// Which architecture the master's hand feels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Architecture {
    /// Model-mediated teleoperation: the local model's force.
    #[default]
    Mmt,
    /// The tool's force, with time-domain passivity control, as soon as it comes.
    Tdpa,
    /// The one of the two that the measured path and the model's error speak for.
    Auto,
}

impl Architecture {
    /// All of them, in the order of their numbers on the wire.
    pub const ALL: [Self; 3] = [Self::Mmt, Self::Tdpa, Self::Auto];

    /// Name in options and reports.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Mmt => "mmt",
            Self::Tdpa => "tdpa",
            Self::Auto => "auto",
        }
    }

    /// Whether the hand may feel the tool's force, so that the two ports have to hear of each other.
    #[must_use]
    pub const fn feels_tool(self) -> bool {
        matches!(self, Self::Tdpa | Self::Auto)
    }
}

/// The most scenes that a master may ask for, 1/s: no eye sees more.
pub const SCENE_HZ_MAX: u8 = 60;

/// First message on the stream, master to slave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hello {
    /// The secret of the pairing string.
    pub token: Token,
    /// What the master wants to be.
    pub role: Role,
    /// k_p and k_d of the master's device profile.
    pub coupling: Coupling,
    /// Samples that the master puts in a command, 1 to [`SAMPLES_MAX`](super::SAMPLES_MAX); one while it feels the tool.
    pub samples_per_command: u8,
    /// What the hand feels.
    pub architecture: Architecture,
    /// Scenes that the master wants to see, 1/s: 0, nobody looks, to [`SCENE_HZ_MAX`].
    pub scene_hz: u8,
    /// Where the HIP is at the start, m.
    pub hip: Vec2,
    /// Name and version of the program, for the other side's log.
    pub program: Label,
}

/// The slave's yes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Welcome {
    /// How both sides run the local model; the coupling is the hello's.
    pub settings: ModelSettings,
    /// The state that the local model starts from.
    pub state: ModelState,
    /// Name of the update scheme, for the screen.
    pub scheme: Label,
    /// Name and version of the program, for the other side's log.
    pub program: Label,
}

/// Why a slave said no.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Refusal {
    /// Another master operates this slave.
    Busy,
    /// The token is not this slave's.
    WrongToken,
    /// The hello's numbers are out of range.
    BadHello,
    /// The slave is ending.
    Ending,
}

/// Why a session ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Ending {
    /// The duration was over or the operator's trace had ended.
    Finished,
    /// A person or the system asked for it.
    Interrupted,
    /// An error on the sending side.
    Failed,
}

/// The last message of a side: why it ends, and what it counted.
///
/// The slave's carries [`SlaveTotals`](super::SlaveTotals), the master's
/// [`MasterTotals`](super::MasterTotals), so that each can print the whole report.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Farewell<T> {
    /// Why the sender ends.
    pub ending: Ending,
    /// What the sender counted.
    pub totals: T,
}
