//! The slave's core: one tick from the HIP sample to the update.
//!
//! Play-out, environment, sensing, pose and parameters, shadow, trigger. Pure: the time is an argument,
//! the seed comes with the configuration, and what it returns is all that it does. The shadow is the
//! master's own local model, driven by the same samples, with every update applied when it is sent.

use mmt_shared::contact::Coupling;
use mmt_shared::geometry::{BoxFootprint, Pose, Twist, Vec2};
use mmt_shared::local_model::LocalModel;
use mmt_shared::metrics::ForceMetrics;
use mmt_shared::params::{ModelParams, ModelState, ParamsError};
use mmt_shared::settings::{Mode, ModelSettings};
use mmt_shared::time::{TICK_S, Time};
use mmt_shared::wire::{Cause, HipSample, Scene, Update};
use serde::{Deserialize, Serialize};

use crate::environment::{Environment, EnvironmentConfig, EnvironmentError};
use crate::estimator::{Estimate, Estimator, EstimatorConfig, Measured};
use crate::playout::{PlayoutBuffer, PlayoutConfig};
use crate::pose_observer::{ObserverConfig, PoseObserver};
use crate::sensing::{Sensing, SensingConfig};
use crate::trigger::{ContactDetector, Trigger, TriggerConfig, TriggerInput};

/// What the local model starts from before anything is known of the object.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StartModel {
    /// m, kg.
    pub mass_kg: f64,
    /// b, N s/m.
    pub damping_ns_per_m: f64,
    /// c, N.
    pub friction_n: f64,
    /// Side l of the model, m.
    pub side_m: f64,
}

impl Default for StartModel {
    /// Wrong on purpose, so that the estimator has something to do; the side is the paper's (IV-A).
    fn default() -> Self {
        Self { mass_kg: 0.4, damping_ns_per_m: 0.0, friction_n: 1.0, side_m: 0.40 }
    }
}
