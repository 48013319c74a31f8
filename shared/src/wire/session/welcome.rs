//! The answer to a hello that is accepted: the model to begin with.

use serde::{Deserialize, Serialize};

use crate::model::contact::Coupling;
use crate::model::geometry::Vec2;
use crate::model::params::{ModelState, ParamsError, WORKSPACE_M, in_range};
use crate::model::settings::ModelSettings;
use crate::model::tool::TOOL_FORCE_N;
use crate::pairing::Token;
use crate::wire::label::Label;
use crate::wire::state::RawState;

/// The slave's answer to a hello that it accepts. Off the wire its state is a [`RawState`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Welcome<S = ModelState> {
    /// How both sides run the local model; the coupling is the hello's.
    pub settings: ModelSettings,
    /// The state that the local model starts from.
    pub state: S,
    /// Where the tool is, m: the HIP starts there.
    pub tool: Vec2,
    /// With no more than this, N, the tool presses on what it touches.
    pub tool_force_max_n: f64,
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
            tool_force_max_n: self.tool_force_max_n,
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
        in_range("tool force", "N", self.tool_force_max_n, TOOL_FORCE_N)?;
        Ok(self.with_state(self.state.accept(asked)?))
    }
}
