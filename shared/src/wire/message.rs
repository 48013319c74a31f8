//! The messages, as the two sides think of them.
//!
//! Datagrams: command, with or without the hand's port (master to slave); update, scene, tool (slave to master);
//! heartbeat (both). Stream: hello, welcome, refusal, farewell. "Up" is master to slave, "down" is slave to master.

use serde::{Deserialize, Serialize};

use super::label::Label;
use super::samples::SampleBlock;
use crate::model::contact::Coupling;
use crate::model::geometry::Vec2;
use crate::model::params::ModelState;
use crate::model::settings::ModelSettings;
use crate::model::tool::HandPort;
use crate::pairing::Token;
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
    /// The tool's force, with time-domain passivity control.
    Tdpa,
}

impl Architecture {
    /// All of them, in the order of their numbers on the wire.
    pub const ALL: [Self; 2] = [Self::Mmt, Self::Tdpa];

    /// Name in options and reports.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Mmt => "mmt",
            Self::Tdpa => "tdpa",
        }
    }

    /// Whether the hand feels the tool's force, so that the two ports exchange their energies.
    #[must_use]
    pub const fn feels_tool(self) -> bool {
        matches!(self, Self::Tdpa)
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
