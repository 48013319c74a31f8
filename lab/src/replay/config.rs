//! How a recording is replayed: thresholds, the scheme, the splits, each default with its reason.

use mmt_shared::model::geometry::Vec2;
use serde::Serialize;

use mmt_server::contact_prediction::Support;

/// How a recording is replayed. The command line checks the ranges; whatever they are, nothing panics.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ReplayConfig {
    /// Delta of (12). Default 0.10: the paper's knee.
    pub deadband: f64,
    /// T_update of the hybrid scheme, s; none is the pure deadband scheme. Default 0.150, the paper's.
    pub t_update_s: Option<f64>,
    /// Least denominator of (12), N. Default 0.3, as in recommended mode.
    pub force_floor_n: f64,
    /// Contact begins at this force, N. Default 0.5: ten times the sensor's noise.
    pub contact_on_n: f64,
    /// Contact ends below this force, N. Default 0.3.
    pub contact_off_n: f64,
    /// Friction believed before the first push, and the centre of the fit's weak prior. Default: 1 N, the
    /// wrong value that every model of this project starts from, an arm of 50 mm (the block under uniform
    /// pressure has 45 mm, under pressure towards its rim more), centred.
    pub start: Support,
    /// Share of the pushes that the held-out prediction is fitted on. Default 0.75.
    pub fitted_share: f64,
    /// Repeats of the held-out prediction, each with its own split. Default 5.
    pub repeats: u32,
    /// Seed of the splits. Default 1.
    pub seed: u64,
}

impl Default for ReplayConfig {
    fn default() -> Self {
        Self {
            deadband: 0.10,
            t_update_s: Some(0.150),
            force_floor_n: 0.3,
            contact_on_n: 0.5,
            contact_off_n: 0.3,
            start: Support {
                friction_n: 1.0,
                arm_m: 0.050,
                centre_m: Vec2::new(0.0, 0.0),
            },
            fitted_share: 0.75,
            repeats: 5,
            seed: 1,
        }
    }
}
