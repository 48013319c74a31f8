//! What the trigger judges in a sample period.

use mmt_shared::model::geometry::Vec2;
use mmt_shared::model::params::ModelParams;

/// The trigger's input in a sample period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriggerInput {
    /// f_s as measured: the raw sample, or where that is noisy the mean of some ms, N.
    pub f_s: Vec2,
    /// The shadow's force of the same time, N.
    pub f_m: Vec2,
    /// Standard deviation of `f_s` per axis, N, where it is more than the default sensor's; else 0.
    pub noise_n: f64,
    /// Whether the slave's tool touches the object.
    pub slave_in_contact: bool,
    /// Whether the HIP touches the shadow.
    pub shadow_in_contact: bool,
    /// Whether the HIP is where it was a sample before, to the bit: a hand that was let go.
    pub hip_stands: bool,
    /// Whether the object does not move although it is pushed.
    pub sticking: bool,
    /// Speed of the object along the push, m/s.
    pub speed: f64,
    /// Acceleration of the object along the push, m/s².
    pub acceleration: f64,
    /// Standard deviation of the force that the estimate predicts in the present motion, N.
    pub force_deviation: f64,
    /// The parameters that an update would carry now.
    pub params: ModelParams,
    /// Whether friction alone is known to hold the object where the tool is: that is in front of another face than it touched last,
    /// and the object has been moved before.
    pub only_friction_holds: bool,
    /// By how much it would shift the shadow from the pose that this is on its way to, m.
    pub shift: Vec2,
    /// Standard deviation of that per axis, m, where nobody touches the object; else 0.
    pub shift_deviation: f64,
    /// By how much it would turn the shadow from that pose, rad.
    pub turn: f64,
    /// Standard deviation of that, rad.
    pub turn_deviation: f64,
}

impl TriggerInput {
    pub(super) fn both_in_contact(&self) -> bool {
        self.slave_in_contact && self.shadow_in_contact
    }

    /// |f_s − f_m|, N.
    pub(super) fn force_error(&self) -> f64 {
        (self.f_s - self.f_m).norm()
    }
}
