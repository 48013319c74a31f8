//! The first message of a session: who comes, and with what device.

use serde::{Deserialize, Serialize};

use crate::model::architecture::Architecture;
use crate::model::contact::Coupling;
use crate::model::geometry::Vec2;
use crate::model::params::{ParamsError, WORKSPACE_M, in_range};
use crate::model::settings::checked_coupling;
use crate::pairing::Token;
use crate::wire::label::Label;
use crate::wire::samples::SAMPLES_MAX;

/// What a master asks to be, and what its token permits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// Moves the tool; one at a time.
    Operator,
    /// Sees what the operator's master is sent, and moves nothing.
    Observer,
}

impl Role {
    /// Both, in the order of their numbers on the wire.
    pub const ALL: [Self; 2] = [Self::Operator, Self::Observer];

    /// Name in options, files and messages.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Operator => "operator",
            Self::Observer => "observer",
        }
    }

    /// The role of this name.
    pub fn by_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|role| role.name() == name)
    }

    /// Whether the holder of a token of this role may be what it asks for: who may operate may look on as well.
    pub const fn permits(self, asked: Self) -> bool {
        matches!((self, asked), (Self::Operator, _) | (_, Self::Observer))
    }
}

/// What becomes of another operator that the slave has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Claim {
    /// It stays, and this master is refused.
    #[default]
    IfFree,
    /// It goes: this master is the same one, which was started again. The secret is that of the welcome.
    Resume(Token),
    /// It goes, whoever it is.
    TakeOver,
}

/// The most scenes that a master may ask for, 1/s: no eye sees more.
pub const SCENE_HZ_MAX: u8 = 60;

/// First message on the stream, up. Off the wire its numbers are finite and not yet [accepted](Hello::accept).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hello {
    /// The secret of the pairing string, to be judged before anything else.
    pub token: Token,
    /// What the master asks to be.
    pub role: Role,
    /// What becomes of another operator.
    pub claim: Claim,
    /// k_p and k_d of the master's device profile.
    pub coupling: Coupling,
    /// New samples that the master puts in a command, 1 to [`SAMPLES_MAX`]; one while it feels the tool.
    pub samples_per_command: u8,
    /// What the hand feels.
    pub architecture: Architecture,
    /// Scenes that the master asks for, 1/s: 0, none, to [`SCENE_HZ_MAX`].
    pub scene_hz: u8,
    /// Where the HIP would like to start, m: a simulated tool that is nowhere yet is put there.
    pub hip: Vec2,
    /// Name and version of the program, for the other side's log.
    pub program: Label,
}

/// Why a hello was not accepted: the slave answers `BadHello`.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum HelloError {
    /// A number is out of its range.
    #[error("{0}")]
    Number(#[from] ParamsError),
    /// The number of samples per command is none or more than a command holds.
    #[error("{samples} samples per command are outside the accepted range 1 to {SAMPLES_MAX}")]
    SamplesPerCommand {
        /// What the hello asks for.
        samples: u8,
    },
    /// More scenes than anybody sees.
    #[error("{hz} scenes a second are more than the accepted {SCENE_HZ_MAX}")]
    SceneRate {
        /// What the hello asks for, 1/s.
        hz: u8,
    },
}

impl Hello {
    /// The hello, if its numbers are in their ranges.
    ///
    /// # Errors
    /// Names the first number that is not.
    pub fn accept(self) -> Result<Self, HelloError> {
        checked_coupling(&self.coupling)?;
        let samples = self.samples_per_command;
        if samples == 0 || usize::from(samples) > SAMPLES_MAX {
            return Err(HelloError::SamplesPerCommand { samples });
        }
        if self.scene_hz > SCENE_HZ_MAX {
            return Err(HelloError::SceneRate { hz: self.scene_hz });
        }
        in_range("hip x", "m", self.hip.x, (-WORKSPACE_M, WORKSPACE_M))?;
        in_range("hip y", "m", self.hip.y, (-WORKSPACE_M, WORKSPACE_M))?;
        Ok(self)
    }
}
