//! A rigid wall that stops bodies and lets the tool pass.

use mmt_shared::model::geometry::{Pose, Vec2, rotate};
use mmt_shared::model::params::WORKSPACE_M;
use mmt_shared::range::{OutOfRange, in_range};
use serde::{Deserialize, Serialize};

use super::outline::Outline;

/// Accepted angle of a wall, rad, and of a body at the start.
pub(super) const ANGLE_RAD: (f64, f64) = (-1000.0, 1000.0);
/// Accepted distance of the wall from the origin, m.
const WALL_M: (f64, f64) = (-2.0 * WORKSPACE_M, 2.0 * WORKSPACE_M);

/// A body whose distance to a wall is smaller than this starts flush, m.
const FLUSH_M: f64 = 1.0 / PER_M;
/// Such distances in a metre.
const PER_M: f64 = 1e9;

/// A wall: all places p with n·p ≥ distance are solid, n = (cos angle, sin angle). The tool passes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Wall {
    /// Distance of the wall's face from the world's origin, m; negative if the origin is inside.
    pub distance_m: f64,
    /// Which way the wall stands, rad from the world's x, counter-clockwise. Default 0: towards +x.
    #[serde(default)]
    pub angle_rad: f64,
}

impl Wall {
    /// Unit vector into the wall.
    pub(super) fn normal(&self) -> Vec2 {
        rotate(self.angle_rad, Vec2::x())
    }

    /// Least distance of an outline to the wall, m; negative if it is inside.
    pub(super) fn clearance(&self, outline: &Outline, pose: &Pose) -> f64 {
        let into = rotate(-pose.angle, self.normal());
        let reach = match outline {
            Outline::Circle(radius) => *radius,
            Outline::Corners(corners) => {
                let depths = corners.as_slice().iter().map(|corner| into.dot(corner));
                depths.fold(f64::MIN, f64::max)
            }
        };
        self.distance_m - self.normal().dot(&pose.position) - reach
    }

    /// Checks the wall, and that a body starts in front of it.
    pub(super) fn check_start(&self, outline: &Outline, pose: &Pose) -> Result<(), OutOfRange> {
        in_range("wall angle", "rad", self.angle_rad, ANGLE_RAD)?;
        in_range("wall distance", "m", self.distance_m, WALL_M)?;
        let least = self.distance_m - self.clearance(outline, pose);
        // a body may start flush: room for rounding
        if self.distance_m >= least - FLUSH_M {
            return Ok(());
        }
        let least = (least * PER_M).round() / PER_M;
        in_range("wall distance", "m", self.distance_m, (least, WALL_M.1))
    }
}
