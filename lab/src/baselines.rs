//! Bilateral control, in which force itself crosses the network: the architectures that mmt is compared with.
//!
//! Here are the cores of both sides and the laws that they share; time-domain passivity control, which a session can
//! use as well, is `mmt_shared::passivity`. Pure. Where each law comes from: `docs/baselines.md`.

mod arm;
mod deadband;
pub mod master;
pub mod message;
pub mod slave;
mod tuning;
mod wave;

pub use tuning::Tuning;

use serde::{Deserialize, Serialize};

/// A bilateral architecture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Baseline {
    /// The tool goes where the hand went, the hand gets the force that the tool met.
    PositionForce,
    /// The same, the hand's own motion damped at the hand.
    DampedPositionForce,
    /// Position–force, a force sent only when it is perceptibly another than the last one sent.
    DeadbandForce,
    /// Position–force, its energy watched and paid at both ports.
    Tdpa,
    /// The same, with the deadband on the force.
    TdpaDeadband,
    /// Wave variables in place of position and force.
    Waves,
}

impl Baseline {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::PositionForce,
        Self::DampedPositionForce,
        Self::DeadbandForce,
        Self::Tdpa,
        Self::TdpaDeadband,
        Self::Waves,
    ];

    /// Whether forces pass a perceptual deadband.
    #[must_use]
    pub const fn has_deadband(self) -> bool {
        matches!(self, Self::DeadbandForce | Self::TdpaDeadband)
    }

    /// Name in tables and arguments.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::PositionForce => "position-force",
            Self::DampedPositionForce => "damped-position-force",
            Self::DeadbandForce => "deadband-force",
            Self::Tdpa => "tdpa",
            Self::TdpaDeadband => "tdpa-deadband",
            Self::Waves => "waves",
        }
    }
}
