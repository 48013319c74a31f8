//! Messages on the one stream: hello, then welcome or refused, then a farewell from each side.
//!
//! On the stream each stands behind its length (four bytes, little endian): framing is the transport's
//! business, which reads no more than [`STREAM_MESSAGE_MAX`](super::STREAM_MESSAGE_MAX) bytes. Here a
//! message is without that prefix. "Up" is master to slave, "down" is slave to master.

use serde::{Deserialize, Serialize};

use super::body::{read, write};
use super::error::{DecodeError, EncodeError, FieldError, finite};
use super::header::open;
use super::kind::{Channel, Kind, Side};
use super::label::Label;
use super::samples::SAMPLES_MAX;
use super::state::RawState;
use crate::model::contact::Coupling;
use crate::model::geometry::Vec2;
use crate::model::params::{ModelState, ParamsError, WORKSPACE_M, in_range};
use crate::model::settings::{ModelSettings, Smoothing, checked_coupling};
use crate::pairing::Token;

/// What a master wants to be, and what its token lets it be.
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

/// Which architecture the master's hand feels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Architecture {
    /// Model-mediated teleoperation: the local model's force.
    #[default]
    Mmt,
    /// The tool's force, with time-domain passivity control, as soon as it comes.
    Tdpa,
}

impl Architecture {
    /// All of them, in the order of their numbers on the wire.
    pub const ALL: [Self; 2] = [Self::Mmt, Self::Tdpa];

    /// Name in options and reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Mmt => "mmt",
            Self::Tdpa => "tdpa",
        }
    }

    /// Whether the hand feels the tool's force, so that the two ports exchange their energies.
    pub const fn feels_tool(self) -> bool {
        matches!(self, Self::Tdpa)
    }
}

/// The most scenes that a master may ask for, 1/s: no eye sees more.
pub const SCENE_HZ_MAX: u8 = 60;

/// First message on the stream, up. Off the wire its numbers are finite and not yet [accepted](Hello::accept).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hello {
    /// The secret of the pairing string, to be judged before anything else.
    pub token: Token,
    /// What the master wants to be.
    pub role: Role,
    /// What becomes of another operator.
    pub claim: Claim,
    /// k_p and k_d of the master's device profile.
    pub coupling: Coupling,
    /// New samples that the master puts in a command, 1 to [`SAMPLES_MAX`]; one while it feels the tool.
    pub samples_per_command: u8,
    /// What the hand feels.
    pub architecture: Architecture,
    /// Scenes that the master wants, 1/s: 0, none, to [`SCENE_HZ_MAX`].
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

/// The slave's answer to a hello that it accepts. Off the wire its state is a [`RawState`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Welcome<S = ModelState> {
    /// How both sides run the local model; the coupling is the hello's.
    pub settings: ModelSettings,
    /// The state that the local model starts from.
    pub state: S,
    /// Where the tool is, m: the HIP starts there.
    pub tool: Vec2,
    /// With this the same master resumes the session after it was started again.
    pub resume: Token,
    /// Name of the update scheme, for the screen.
    pub scheme: Label,
    /// Name and version of the program, for the other side's log.
    pub program: Label,
}

/// Why a welcome was not accepted: the master ends the session.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum WelcomeError {
    /// A number is out of its range.
    #[error("{0}")]
    Number(#[from] ParamsError),
    /// The slave changed the coupling: the hand's device is not made for it.
    #[error(
        "the slave answers with stiffness {stiffness} N/m and contact damping {damping} N s/m \
         instead of the device's own"
    )]
    OtherCoupling {
        /// k_p in the welcome, N/m.
        stiffness: f64,
        /// k_d in the welcome, N s/m.
        damping: f64,
    },
}

impl<S> Welcome<S> {
    fn with_state<T>(&self, state: T) -> Welcome<T> {
        Welcome {
            settings: self.settings,
            state,
            tool: self.tool,
            resume: self.resume,
            scheme: self.scheme,
            program: self.program,
        }
    }
}

impl From<&Welcome> for Welcome<RawState> {
    fn from(welcome: &Welcome) -> Self {
        welcome.with_state(RawState::from(&welcome.state))
    }
}

impl Welcome<RawState> {
    /// The welcome, if its numbers are in their ranges and its coupling is the one `asked` for.
    ///
    /// # Errors
    /// Names the first number that is not.
    pub fn accept(&self, asked: &Coupling) -> Result<Welcome, WelcomeError> {
        let Coupling {
            stiffness_n_per_m: stiffness,
            damping_ns_per_m: damping,
        } = self.settings.checked()?.coupling;
        if self.settings.coupling != *asked {
            return Err(WelcomeError::OtherCoupling { stiffness, damping });
        }
        in_range("tool x", "m", self.tool.x, (-WORKSPACE_M, WORKSPACE_M))?;
        in_range("tool y", "m", self.tool.y, (-WORKSPACE_M, WORKSPACE_M))?;
        Ok(self.with_state(self.state.accept(asked)?))
    }
}

/// Why a slave refused a hello.
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
    /// The token is for another role than the one asked for.
    WrongRole,
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

impl Ending {
    /// Its name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Finished => "finished",
            Self::Interrupted => "interrupted",
            Self::Failed => "failed",
        }
    }
}

/// The last message of a side: why it ends, and what it counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Farewell<'a> {
    /// Why the sender ends.
    pub ending: Ending,
    /// The sender's report, which the wire only carries: JSON, see `docs/protocol.md`.
    pub report: &'a [u8],
}

/// A stream message. Off the wire, numbers that a model would take are not yet accepted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StreamMessage<'a> {
    /// The master asks.
    Hello(Hello),
    /// The slave accepts.
    Welcome(Welcome<RawState>),
    /// The slave refuses.
    Refused(Refusal),
    /// A side ends.
    Farewell(Farewell<'a>),
}

impl<'a> StreamMessage<'a> {
    /// Its type.
    pub const fn kind(&self) -> Kind {
        match self {
            Self::Hello(_) => Kind::Hello,
            Self::Welcome(_) => Kind::Welcome,
            Self::Refused(_) => Kind::Refused,
            Self::Farewell(_) => Kind::Farewell,
        }
    }

    /// Writes it to the front of `out`; returns its length, at most
    /// [`STREAM_MESSAGE_MAX`](super::STREAM_MESSAGE_MAX).
    ///
    /// # Errors
    /// Names the field that breaks a rule, or that `out` is too short; what is in `out` then must not be sent.
    pub fn encode(&self, out: &mut [u8]) -> Result<usize, EncodeError> {
        let kind = self.kind();
        self.check()
            .map_err(|why| EncodeError::Field { kind, why })?;
        match self {
            Self::Hello(hello) => write(kind, false, hello, out),
            Self::Welcome(welcome) => write(kind, false, welcome, out),
            Self::Refused(refusal) => write(kind, false, refusal, out),
            Self::Farewell(farewell) => write(kind, false, farewell, out),
        }
    }

    /// Reads a message that `from` sent on the stream, its length prefix taken off.
    ///
    /// # Errors
    /// Why the bytes are not exactly one message that `from` may send on the stream. The stream must
    /// not be read any further then.
    pub fn decode(message: &'a [u8], from: Side) -> Result<Self, DecodeError> {
        let (kind, _, body) = open(message, from, Channel::Stream)?;
        let message = match kind {
            Kind::Hello => Self::Hello(read(kind, body)?),
            Kind::Welcome => Self::Welcome(read(kind, body)?),
            Kind::Refused => Self::Refused(read(kind, body)?),
            Kind::Farewell => Self::Farewell(read(kind, body)?),
            Kind::Command | Kind::Update | Kind::Scene | Kind::Heartbeat | Kind::Tool => {
                return Err(DecodeError::WrongChannel { kind });
            }
        };
        match message.check() {
            Ok(()) => Ok(message),
            Err(why) => Err(DecodeError::Field { kind, why }),
        }
    }

    /// Every number must be finite: checked before writing and after reading.
    fn check(&self) -> Result<(), FieldError> {
        match self {
            Self::Hello(hello) => {
                check_coupling(&hello.coupling)?;
                finite("hip", hello.hip.as_slice())
            }
            Self::Welcome(welcome) => {
                check_coupling(&welcome.settings.coupling)?;
                match welcome.settings.smoothing {
                    Smoothing::PerPacket { lambda } => finite("lambda", &[lambda])?,
                    Smoothing::InTime { tau_s } => finite("tau_s", &[tau_s])?,
                }
                finite("tool", welcome.tool.as_slice())?;
                welcome.state.check()
            }
            Self::Refused(_) | Self::Farewell(_) => Ok(()),
        }
    }
}

fn check_coupling(coupling: &Coupling) -> Result<(), FieldError> {
    finite("stiffness_n_per_m", &[coupling.stiffness_n_per_m])?;
    finite("damping_ns_per_m", &[coupling.damping_ns_per_m])
}
