//! A model's state as it lies on the wire, and the only road from there to the model.
//!
//! The numbers are private: only `accept`, which checks ranges and stability, makes a state of them.

use serde::{Deserialize, Serialize};

use super::error::{FieldError, finite};
use crate::model::contact::Coupling;
use crate::model::geometry::{BoxFootprint, Pose, Twist};
use crate::model::params::{ModelParams, ModelState, ParamsError};
use crate::model::update::Update;

/// A state off the wire: fifteen numbers, not yet accepted.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RawState {
    /// m, b, c, I, e.
    params: [f64; 5],
    /// East, north, west, south.
    footprint: [f64; 4],
    /// x, y, theta.
    pose: [f64; 3],
    /// v_x, v_y, omega.
    twist: [f64; 3],
}

impl From<&ModelState> for RawState {
    fn from(state: &ModelState) -> Self {
        let (footprint, pose, twist) = (state.footprint(), state.pose(), state.twist());
        Self {
            params: state.params().to_array(),
            footprint: [
                footprint.east,
                footprint.north,
                footprint.west,
                footprint.south,
            ],
            pose: [pose.position.x, pose.position.y, pose.angle],
            twist: [twist.linear.x, twist.linear.y, twist.angular],
        }
    }
}

impl RawState {
    pub(super) fn check(&self) -> Result<(), FieldError> {
        finite("params", &self.params)?;
        finite("footprint", &self.footprint)?;
        finite("pose", &self.pose)?;
        finite("twist", &self.twist)
    }

    /// The state, if its numbers are those of a model under `coupling`.
    ///
    /// # Errors
    /// Names the first number that is out of its range or below its stability bound.
    pub fn accept(&self, coupling: &Coupling) -> Result<ModelState, ParamsError> {
        let [m, b, c, inertia, e] = self.params;
        let [east, north, west, south] = self.footprint;
        let [x, y, angle] = self.pose;
        let [v_x, v_y, omega] = self.twist;
        ModelState::try_new(
            ModelParams::try_new(m, b, c, inertia, e, coupling)?,
            BoxFootprint {
                east,
                north,
                west,
                south,
            },
            Pose::new(x, y, angle),
            Twist::new(v_x, v_y, omega),
            coupling,
        )
    }
}

impl From<&Update> for Update<RawState> {
    fn from(update: &Update) -> Self {
        update.with_state(RawState::from(&update.state))
    }
}

impl Update<RawState> {
    /// The update, if its state is accepted.
    ///
    /// # Errors
    /// As [`RawState::accept`].
    pub fn accept(&self, coupling: &Coupling) -> Result<Update, ParamsError> {
        Ok(self.with_state(self.state.accept(coupling)?))
    }
}
