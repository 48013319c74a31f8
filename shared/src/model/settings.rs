//! What both sides must agree on before the first sample: how the local model is run.
//!
//! The master renders with these settings and the slave's shadow runs the same model by them, so they
//! travel in the hello (coupling) and the welcome (everything).

use serde::{Deserialize, Serialize};

use crate::model::contact::Coupling;
use crate::model::params::{ParamsError, in_range};

/// Accepted virtual stiffness k_p, N/m: softer is no wall to a hand, stiffer no device of this kind renders.
pub const STIFFNESS_N_PER_M: (f64, f64) = (50.0, 10_000.0);
/// Accepted contact damping k_d, N s/m: five times what 3000 N/m needs.
pub const CONTACT_DAMPING_NS_PER_M: (f64, f64) = (0.0, 100.0);
/// Accepted lambda of (4): a weight.
pub const LAMBDA: (f64, f64) = (0.0, 1.0);
/// Accepted tau, s: one tick to ten seconds.
pub const TAU_S: (f64, f64) = (0.001, 10.0);

/// How ground friction acts in the local model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FrictionLaw {
    /// (5), (11) as printed: explicit, `c·v/|v|` and `e·sign(omega)`, decoupled.
    Sign,
    /// Implicit step with an exact stick test on the ellipsoidal limit surface (Goyal): coupled.
    LimitSurface,
}

/// How received parameters are smoothed on their way into the model.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Smoothing {
    /// (4): once per packet, lambda is the weight of the previous parameters.
    PerPacket {
        /// lambda, 0 to 1.
        lambda: f64,
    },
    /// In time: `p += (target − p)(1 − exp(−T/tau))` every tick.
    InTime {
        /// tau, s.
        tau_s: f64,
    },
}

/// How a received pose becomes the model's pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PoseCorrection {
    /// Section III-A to the letter: set on arrival. Only sound at zero delay; kept for the paper's figures.
    Snap,
    /// Compared at the stamp of the HIP sample that the update answers, and bled in.
    MatchedStamps,
    /// The model is restarted at that sample, the HIP samples since are replayed, and the difference is
    /// bled in.
    Replay,
}

/// The settings of a session's local model.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ModelSettings {
    /// k_p and k_d between HIP and proxy.
    pub coupling: Coupling,
    /// Ground friction in the model.
    pub friction: FrictionLaw,
    /// Parameter smoothing.
    pub smoothing: Smoothing,
    /// Pose correction.
    pub correction: PoseCorrection,
}

impl ModelSettings {
    /// Checks numbers that came from outside.
    ///
    /// # Errors
    /// Names the first number that is not finite or outside its accepted range.
    pub fn checked(&self) -> Result<Self, ParamsError> {
        let coupling = checked_coupling(&self.coupling)?;
        match self.smoothing {
            Smoothing::PerPacket { lambda } => in_range("lambda", "", lambda, LAMBDA)?,
            Smoothing::InTime { tau_s } => in_range("tau", "s", tau_s, TAU_S)?,
        }
        Ok(Self { coupling, ..*self })
    }
}

/// Checks a coupling that came from outside.
///
/// # Errors
/// Names the number that is not finite or outside its accepted range.
pub fn checked_coupling(coupling: &Coupling) -> Result<Coupling, ParamsError> {
    let (k_p, k_d) = (coupling.stiffness_n_per_m, coupling.damping_ns_per_m);
    in_range("stiffness", "N/m", k_p, STIFFNESS_N_PER_M)?;
    in_range("contact damping", "N s/m", k_d, CONTACT_DAMPING_NS_PER_M)?;
    Ok(*coupling)
}

/// The two bundles of choices that a run is made in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// The paper to the letter: Kalman filter and block least squares, `sign(v)`, EMA per packet.
    Paper,
    /// Identically filtered regression, limit surface, smoothing in time, learned face offsets.
    Recommended,
}

impl Mode {
    /// The local model's settings of this mode under a coupling, for a link with delay.
    ///
    /// Smoothing: lambda = 0.5 is the paper's (section II-A); tau = 20 ms is short against a push and
    /// long against a tick.
    pub fn model_settings(self, coupling: Coupling) -> ModelSettings {
        match self {
            Self::Paper => ModelSettings {
                coupling,
                friction: FrictionLaw::Sign,
                smoothing: Smoothing::PerPacket { lambda: 0.5 },
                correction: PoseCorrection::MatchedStamps,
            },
            Self::Recommended => ModelSettings {
                coupling,
                friction: FrictionLaw::LimitSurface,
                smoothing: Smoothing::InTime { tau_s: 0.020 },
                correction: PoseCorrection::Replay,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::COUPLING;

    #[test]
    fn both_modes_are_accepted_at_every_accepted_stiffness() {
        for k_p in [50.0, 1000.0, 3000.0, 10_000.0] {
            for mode in [Mode::Paper, Mode::Recommended] {
                let settings = mode.model_settings(Coupling::for_stiffness(k_p));
                assert_eq!(settings.checked(), Ok(settings));
            }
        }
    }

    #[test]
    fn every_number_that_is_not_finite_or_out_of_range_is_refused() {
        let good = Mode::Recommended.model_settings(COUPLING);
        for bad in [f64::NAN, f64::INFINITY, -1.0, f64::MAX] {
            let mut settings = good;
            settings.coupling.stiffness_n_per_m = bad;
            assert!(settings.checked().is_err());
            settings = good;
            settings.coupling.damping_ns_per_m = bad;
            assert!(settings.checked().is_err());
            for smoothing in [
                Smoothing::PerPacket { lambda: bad },
                Smoothing::InTime { tau_s: bad },
            ] {
                assert!(ModelSettings { smoothing, ..good }.checked().is_err());
            }
        }
    }
}
