//! A HIP sample: where the hand was at a tick and the force that was rendered for it, on the grid of the wire.

use serde::{Deserialize, Serialize};

use crate::model::geometry::Vec2;
use crate::time::Time;

/// A point on the wire's grid of 0.1 µm. The master rounds the device's reading to it before anything
/// else, so that both sides compute with the same bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct HipCounts {
    /// x, 0.1 µm.
    pub x: i32,
    /// y, 0.1 µm.
    pub y: i32,
}

impl HipCounts {
    /// One count, m.
    pub const METRES: f64 = 1e-7;

    /// The grid point nearest to `hip` (m), saturating at ±214 m; a NaN becomes 0.
    pub fn nearest(hip: Vec2) -> Self {
        let count = |metres: f64| libm::round(metres / Self::METRES) as i32;
        Self {
            x: count(hip.x),
            y: count(hip.y),
        }
    }

    /// The point, m.
    pub fn metres(self) -> Vec2 {
        Vec2::new(
            f64::from(self.x) * Self::METRES,
            f64::from(self.y) * Self::METRES,
        )
    }
}

/// A force on the wire's grid of 0.1 mN.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ForceCounts {
    /// x, 0.1 mN.
    pub x: i32,
    /// y, 0.1 mN.
    pub y: i32,
}

impl ForceCounts {
    /// One count, N.
    pub const NEWTONS: f64 = 1e-4;

    /// The grid point nearest to `force` (N), saturating; a NaN becomes 0.
    pub fn nearest(force: Vec2) -> Self {
        let count = |newtons: f64| libm::round(newtons / Self::NEWTONS) as i32;
        Self {
            x: count(force.x),
            y: count(force.y),
        }
    }

    /// The force, N.
    pub fn newtons(self) -> Vec2 {
        Vec2::new(
            f64::from(self.x) * Self::NEWTONS,
            f64::from(self.y) * Self::NEWTONS,
        )
    }
}

/// One tick of the master: where the HIP was and the force that the local model rendered for it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct HipSample {
    /// The tick's stamp by the master's clock.
    pub stamp: Time,
    /// HIP in the world.
    pub hip: HipCounts,
    /// f_m, the force on the object that the local model computed for this HIP, before the limiter.
    pub force: ForceCounts,
}
