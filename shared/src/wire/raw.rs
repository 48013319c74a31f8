//! Numbers as they came off the wire, and the only road from them to the model.
//!
//! `accept` checks ranges and stability (`ModelParams::try_new`, `ModelState::try_new`) and yields the
//! message proper. The numbers themselves are private: nothing else can take them.

use serde::{Deserialize, Serialize};

use super::error::{FieldError, demand, finite};
use super::label::Label;
use super::message::{Architecture, Hello, Role, SCENE_HZ_MAX, Welcome};
use super::samples::SAMPLES_MAX;
use crate::model::contact::Coupling;
use crate::model::geometry::{BoxFootprint, Pose, Twist, Vec2};
use crate::model::params::{ModelParams, ModelState, ParamsError, WORKSPACE_M, in_range};
use crate::model::settings::{ModelSettings, Smoothing, checked_coupling};
use crate::model::tool::Scene;
use crate::model::update::{Cause, Update};
use crate::pairing::Token;
use crate::time::Time;

/// A model's state as it lies on the wire: fifteen numbers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct RawState {
    /// m, b, c, I, e.
    params: [f64; 5],
    /// East, north, west, south.
    offsets: [f64; 4],
    /// x, y, theta.
    pose: [f64; 3],
    /// v_x, v_y, omega.
    twist: [f64; 3],
}

impl RawState {
    fn of(state: &ModelState) -> Self {
        let BoxFootprint {
            east,
            north,
            west,
            south,
        } = state.footprint;
        let (v, omega) = (state.twist.linear, state.twist.angular);
        Self {
            params: state.params.to_array(),
            offsets: [east, north, west, south],
            pose: [
                state.pose.position.x,
                state.pose.position.y,
                state.pose.angle,
            ],
            twist: [v.x, v.y, omega],
        }
    }

    fn check(&self) -> Result<(), FieldError> {
        let [m, b, c, inertia, e] = self.params;
        let [east, north, west, south] = self.offsets;
        let [x, y, angle] = self.pose;
        let [v_x, v_y, omega] = self.twist;
        for (field, value) in [
            ("mass", m),
            ("damping", b),
            ("friction", c),
            ("inertia", inertia),
            ("friction torque", e),
            ("east face offset", east),
            ("north face offset", north),
            ("west face offset", west),
            ("south face offset", south),
            ("position x", x),
            ("position y", y),
            ("angle", angle),
            ("velocity x", v_x),
            ("velocity y", v_y),
            ("turning rate", omega),
        ] {
            finite(field, value)?;
        }
        Ok(())
    }

    fn accept(&self, coupling: &Coupling) -> Result<ModelState, ParamsError> {
        let [m, b, c, inertia, e] = self.params;
        let [east, north, west, south] = self.offsets;
        let [x, y, angle] = self.pose;
        let [v_x, v_y, omega] = self.twist;
        let footprint = BoxFootprint {
            east,
            north,
            west,
            south,
        };
        ModelState::try_new(
            ModelParams::try_new(m, b, c, inertia, e, coupling)?,
            footprint,
            Pose::new(x, y, angle),
            Twist::new(v_x, v_y, omega),
        )
    }
}

/// An update off the wire: decoded, finite, not yet accepted.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RawUpdate {
    sequence: u32,
    cause: Cause,
    answers: Time,
    newest_command: u32,
    slave_in_contact: bool,
    state: RawState,
}

impl RawUpdate {
    pub(super) fn of(update: &Update) -> Self {
        Self {
            sequence: update.sequence,
            cause: update.cause,
            answers: update.answers,
            newest_command: update.newest_command,
            slave_in_contact: update.slave_in_contact,
            state: RawState::of(&update.state),
        }
    }

    /// Number of the update, for the sequence window, which decides before the numbers are looked at.
    #[must_use]
    pub fn sequence(&self) -> u32 {
        self.sequence
    }

    pub(super) fn check(&self) -> Result<(), FieldError> {
        demand(self.sequence > 0, "sequence", "must be 1 or more")?;
        self.state.check()
    }

    /// The update, if its numbers are accepted as parameters and state of a model under `coupling`.
    ///
    /// # Errors
    /// Names the first number that is out of its range or below the stability bound.
    pub fn accept(&self, coupling: &Coupling) -> Result<Update, ParamsError> {
        Ok(Update {
            sequence: self.sequence,
            cause: self.cause,
            answers: self.answers,
            newest_command: self.newest_command,
            slave_in_contact: self.slave_in_contact,
            state: self.state.accept(coupling)?,
        })
    }
}

/// A scene as it lies on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct RawScene {
    answers: Time,
    object: [f64; 3],
    tool: [f64; 2],
    force: [f64; 2],
}

impl RawScene {
    pub(super) fn of(scene: &Scene) -> Self {
        let Pose { position, angle } = scene.object;
        Self {
            answers: scene.answers,
            object: [position.x, position.y, angle],
            tool: scene.tool.into(),
            force: scene.force.into(),
        }
    }

    pub(super) fn check(&self) -> Result<(), FieldError> {
        let finite_all = |field, values: &[f64]| {
            let mut values = values.iter();
            values.try_for_each(|&value| finite(field, value))
        };
        finite_all("object", &self.object)?;
        finite_all("tool", &self.tool)?;
        finite_all("force", &self.force)
    }

    pub(super) fn scene(&self) -> Scene {
        let [x, y, angle] = self.object;
        Scene {
            answers: self.answers,
            object: Pose::new(x, y, angle),
            tool: Vec2::from(self.tool),
            force: Vec2::from(self.force),
        }
    }
}

/// A hello off the wire: decoded, finite, not yet accepted.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RawHello {
    token: Token,
    role: Role,
    coupling: [f64; 2],
    samples_per_command: u8,
    architecture: Architecture,
    scene_hz: u8,
    hip: [f64; 2],
    program: Label,
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
        /// What the hello says.
        samples: u8,
    },
    /// More scenes than anybody sees.
    #[error("{hz} scenes a second are more than the accepted {SCENE_HZ_MAX}")]
    SceneRate {
        /// What the hello says, 1/s.
        hz: u8,
    },
}

impl RawHello {
    pub(super) fn of(hello: &Hello) -> Self {
        let Coupling {
            stiffness_n_per_m,
            damping_ns_per_m,
        } = hello.coupling;
        Self {
            token: hello.token,
            role: hello.role,
            coupling: [stiffness_n_per_m, damping_ns_per_m],
            samples_per_command: hello.samples_per_command,
            architecture: hello.architecture,
            scene_hz: hello.scene_hz,
            hip: hello.hip.into(),
            program: hello.program,
        }
    }

    /// The token, to be judged before anything else.
    #[must_use]
    pub fn token(&self) -> &Token {
        &self.token
    }

    pub(super) fn check(&self) -> Result<(), FieldError> {
        let [k_p, k_d] = self.coupling;
        finite("stiffness", k_p)?;
        finite("contact damping", k_d)?;
        let mut hip = self.hip.into_iter();
        hip.try_for_each(|value| finite("hip", value))
    }

    /// The hello, if its numbers are in their ranges.
    ///
    /// # Errors
    /// Names the first number that is not.
    pub fn accept(&self) -> Result<Hello, HelloError> {
        let [stiffness_n_per_m, damping_ns_per_m] = self.coupling;
        let coupling = checked_coupling(&Coupling {
            stiffness_n_per_m,
            damping_ns_per_m,
        })?;
        let samples = self.samples_per_command;
        if samples == 0 || usize::from(samples) > SAMPLES_MAX {
            return Err(HelloError::SamplesPerCommand { samples });
        }
        if self.scene_hz > SCENE_HZ_MAX {
            return Err(HelloError::SceneRate { hz: self.scene_hz });
        }
        let [x, y] = self.hip;
        in_range("hip x", "m", x, (-WORKSPACE_M, WORKSPACE_M))?;
        in_range("hip y", "m", y, (-WORKSPACE_M, WORKSPACE_M))?;
        Ok(Hello {
            token: self.token,
            role: self.role,
            coupling,
            samples_per_command: samples,
            architecture: self.architecture,
            scene_hz: self.scene_hz,
            hip: Vec2::new(x, y),
            program: self.program,
        })
    }
}

/// A welcome off the wire: decoded, finite, not yet accepted.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RawWelcome {
    settings: ModelSettings,
    state: RawState,
    scheme: Label,
    program: Label,
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

impl RawWelcome {
    pub(super) fn of(welcome: &Welcome) -> Self {
        Self {
            settings: welcome.settings,
            state: RawState::of(&welcome.state),
            scheme: welcome.scheme,
            program: welcome.program,
        }
    }

    pub(super) fn check(&self) -> Result<(), FieldError> {
        let coupling = &self.settings.coupling;
        finite("stiffness", coupling.stiffness_n_per_m)?;
        finite("contact damping", coupling.damping_ns_per_m)?;
        match self.settings.smoothing {
            Smoothing::PerPacket { lambda } => finite("lambda", lambda)?,
            Smoothing::InTime { tau_s } => finite("tau", tau_s)?,
        }
        self.state.check()
    }

    /// The welcome, if its numbers are in their ranges and its coupling is the one `asked` for.
    ///
    /// # Errors
    /// Names the first number that is not.
    pub fn accept(&self, asked: &Coupling) -> Result<Welcome, WelcomeError> {
        let settings = self.settings.checked()?;
        if settings.coupling != *asked {
            return Err(WelcomeError::OtherCoupling {
                stiffness: settings.coupling.stiffness_n_per_m,
                damping: settings.coupling.damping_ns_per_m,
            });
        }
        Ok(Welcome {
            settings,
            state: self.state.accept(asked)?,
            scheme: self.scheme,
            program: self.program,
        })
    }
}
