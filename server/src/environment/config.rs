//! What an environment is made of, with the default scenario, and the checks on it.

use mmt_shared::contact::Coupling;
use mmt_shared::geometry::Pose;
use mmt_shared::params::{GRAVITY, ModelParams, ParamsError, WORKSPACE_M};
use serde::{Deserialize, Serialize};

/// Accepted side l, m: the accepted face offsets of the local model, doubled.
const SIDE_M: (f64, f64) = (0.02, 2.0);
/// Accepted friction coefficient mu: rubber on rubber stays below 2.
const FRICTION_COEFFICIENT: (f64, f64) = (0.0, 5.0);
/// Accepted rotational damping, N m s.
const ROTATIONAL_DAMPING_NMS: (f64, f64) = (0.0, 200.0);
/// Accepted gravity, m/s²: up to Jupiter's.
const GRAVITY_M_PER_S2: (f64, f64) = (0.0, 25.0);
/// Accepted contact stiffness `k_p`, N/m: ten times the stiffest device profile.
const STIFFNESS_N_PER_M: (f64, f64) = (1.0, 30_000.0);
/// Accepted contact damping `k_d`, N s/m.
const CONTACT_DAMPING_NS_PER_M: (f64, f64) = (0.0, 300.0);
/// Accepted initial angle, rad.
const ANGLE_RAD: (f64, f64) = (-1000.0, 1000.0);

/// A cube on a plane. The default is the default scenario of the model study.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct EnvironmentConfig {
    /// Side l, m. Default 0.36: the real cube of section IV-A.
    pub side_m: f64,
    /// Mass m, kg. Default 0.7: the real cube's.
    pub mass_kg: f64,
    /// Friction coefficient mu between body and ground. Default 0.3: a study's choice.
    pub friction_coefficient: f64,
    /// Viscous damping b, N s/m. Default 3: a study's choice, so that (1) has something to find.
    pub damping_ns_per_m: f64,
    /// Rotational damping, N m s; none means b l²/6. The local model lacks it on purpose.
    pub rotational_damping_nms: Option<f64>,
    /// Acceleration of gravity g, m/s². Default 9.81.
    pub gravity_m_per_s2: f64,
    /// Where the body rests at the start. Default: the origin.
    pub pose: Pose,
    /// `k_p` and `k_d` of the real contact between tool and surface. Default 1000 N/m, 10 N s/m.
    pub coupling: Coupling,
}

impl Default for EnvironmentConfig {
    fn default() -> Self {
        Self {
            side_m: 0.36,
            mass_kg: 0.7,
            friction_coefficient: 0.3,
            damping_ns_per_m: 3.0,
            rotational_damping_nms: None,
            gravity_m_per_s2: GRAVITY,
            pose: Pose::default(),
            coupling: Coupling::for_stiffness(1000.0),
        }
    }
}

/// Why an environment cannot be made of these numbers.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum EnvironmentError {
    /// A number lies outside its accepted range or is not a number.
    #[error("environment: {name} {value} is outside the accepted range {min} to {max} {unit}")]
    OutOfRange {
        /// Which number.
        name: &'static str,
        /// What it was.
        value: f64,
        /// Least accepted value.
        min: f64,
        /// Greatest accepted value.
        max: f64,
        /// Unit of all three.
        unit: &'static str,
    },
    /// m, b, c, I or e could not be a model's parameters, so that no estimate of them could be right.
    #[error("environment: {0}")]
    Parameters(#[from] ParamsError),
}

impl EnvironmentConfig {
    /// Rotational damping, N m s: as given, else b l²/6.
    pub(super) fn rotational_damping(&self) -> f64 {
        let spread = self.damping_ns_per_m * self.side_m * self.side_m / 6.0;
        self.rotational_damping_nms.unwrap_or(spread)
    }

    /// The real m, b, c, I and e.
    pub(super) fn truth(&self) -> Result<ModelParams, EnvironmentError> {
        let c = self.friction_coefficient * self.mass_kg * self.gravity_m_per_s2;
        Ok(ModelParams::of_square(
            self.mass_kg,
            self.damping_ns_per_m,
            c,
            self.side_m,
            &self.coupling,
        )?)
    }

    pub(super) fn check(&self) -> Result<(), EnvironmentError> {
        let place = (-WORKSPACE_M, WORKSPACE_M);
        let (k_p, k_d) = (
            self.coupling.stiffness_n_per_m,
            self.coupling.damping_ns_per_m,
        );
        let mu = self.friction_coefficient;
        let b_r = self.rotational_damping();
        let g = self.gravity_m_per_s2;
        in_range("side", "m", self.side_m, SIDE_M)?;
        in_range("friction coefficient", "", mu, FRICTION_COEFFICIENT)?;
        in_range("rotational damping", "N m s", b_r, ROTATIONAL_DAMPING_NMS)?;
        in_range("gravity", "m/s^2", g, GRAVITY_M_PER_S2)?;
        in_range("contact stiffness", "N/m", k_p, STIFFNESS_N_PER_M)?;
        in_range("contact damping", "N s/m", k_d, CONTACT_DAMPING_NS_PER_M)?;
        in_range("position x", "m", self.pose.position.x, place)?;
        in_range("position y", "m", self.pose.position.y, place)?;
        in_range("angle", "rad", self.pose.angle, ANGLE_RAD)
    }
}

fn in_range(
    name: &'static str,
    unit: &'static str,
    value: f64,
    (min, max): (f64, f64),
) -> Result<(), EnvironmentError> {
    if (min..=max).contains(&value) {
        return Ok(());
    }
    Err(EnvironmentError::OutOfRange {
        name,
        value,
        min,
        max,
        unit,
    })
}
