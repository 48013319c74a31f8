//! What both sides must agree on before the first sample: how the local model is run.
//!
//! The master renders with these settings and the slave's shadow runs the same model by them, so they
//! travel in the hello (coupling) and the welcome (everything).

use serde::{Deserialize, Serialize};

use crate::contact::Coupling;

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
    /// Smoothing: lambda = 0.5 is the paper's (section II-A); tau = 20 ms is a study's choice: short
    /// against a push, long against a tick.
    #[must_use]
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
                correction: PoseCorrection::MatchedStamps,
            },
        }
    }
}
