//! The whole state of a box, every number checked: what an update carries.

use super::{
    ANGLE_RAD, FACE_OFFSET_M, ModelParams, ParamsError, SPEED_M_PER_S, TURN_RATE_RAD_PER_S,
    WORKSPACE_M, in_range, least_stable_inertia,
};
use crate::model::contact::Coupling;
use crate::model::geometry::{BoxFootprint, Face, Pose, Twist};

/// All that the master needs to render the object: parameters, footprint, pose and velocity, every number checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModelState {
    params: ModelParams,
    footprint: BoxFootprint,
    pose: Pose,
    twist: Twist,
}

/// What [`ModelState::try_new`] accepts: least and greatest value.
const COORDINATE_M: (f64, f64) = (-WORKSPACE_M, WORKSPACE_M);
const TURN_RAD: (f64, f64) = (-ANGLE_RAD, ANGLE_RAD);
const VELOCITY_M_PER_S: (f64, f64) = (-SPEED_M_PER_S, SPEED_M_PER_S);
const RATE_RAD_PER_S: (f64, f64) = (-TURN_RATE_RAD_PER_S, TURN_RATE_RAD_PER_S);

impl ModelState {
    /// A state whose every number has been checked.
    ///
    /// # Errors
    /// Names the first number that is not finite or outside its range, or the inertia if it is too small to be stable
    /// with these faces under `coupling`.
    pub fn try_new(
        params: ModelParams,
        footprint: BoxFootprint,
        pose: Pose,
        twist: Twist,
        coupling: &Coupling,
    ) -> Result<Self, ParamsError> {
        for face in Face::ALL {
            in_range("face offset", "m", footprint.offset(face), FACE_OFFSET_M)?;
        }
        let least = least_stable_inertia(&footprint, coupling);
        if params.inertia < least {
            return Err(ParamsError::Unstable {
                name: "inertia",
                unit: "kg m^2",
                value: params.inertia,
                least,
            });
        }
        in_range("position x", "m", pose.position.x, COORDINATE_M)?;
        in_range("position y", "m", pose.position.y, COORDINATE_M)?;
        in_range("angle", "rad", pose.angle, TURN_RAD)?;
        in_range("velocity x", "m/s", twist.linear.x, VELOCITY_M_PER_S)?;
        in_range("velocity y", "m/s", twist.linear.y, VELOCITY_M_PER_S)?;
        in_range("turning rate", "rad/s", twist.angular, RATE_RAD_PER_S)?;
        Ok(Self {
            params,
            footprint,
            pose,
            twist,
        })
    }

    /// The state nearest to these numbers that [`ModelState::try_new`] accepts: an object that has left the workspace
    /// is at its edge, and an inertia that is too small for these faces is the least that is stable.
    ///
    /// # Errors
    /// Names the first number that is not a number.
    pub fn nearest(
        params: ModelParams,
        footprint: BoxFootprint,
        pose: Pose,
        twist: Twist,
        coupling: &Coupling,
    ) -> Result<Self, ParamsError> {
        let within = |value: f64, (least, most): (f64, f64)| value.clamp(least, most);
        let BoxFootprint {
            east,
            north,
            west,
            south,
        } = footprint;
        let [east, north, west, south] =
            [east, north, west, south].map(|offset| within(offset, FACE_OFFSET_M));
        let footprint = BoxFootprint {
            east,
            north,
            west,
            south,
        };
        let pose = Pose::new(
            within(pose.position.x, COORDINATE_M),
            within(pose.position.y, COORDINATE_M),
            within(pose.angle, TURN_RAD),
        );
        let twist = Twist::new(
            within(twist.linear.x, VELOCITY_M_PER_S),
            within(twist.linear.y, VELOCITY_M_PER_S),
            within(twist.angular, RATE_RAD_PER_S),
        );
        let params = params.steadied(&footprint, coupling);
        Self::try_new(params, footprint, pose, twist, coupling)
    }

    /// The impedance.
    pub const fn params(&self) -> ModelParams {
        self.params
    }

    /// One distance from the reference point to each face.
    pub const fn footprint(&self) -> BoxFootprint {
        self.footprint
    }

    /// `world_from_object`.
    pub const fn pose(&self) -> Pose {
        self.pose
    }

    /// Velocity of the reference point and turning rate.
    pub const fn twist(&self) -> Twist {
        self.twist
    }
}
