//! What an estimator is given in a tick.

use mmt_shared::model::geometry::Vec2;
use mmt_shared::model::params::{FACE_OFFSET_M, TURN_RATE_RAD_PER_S};

/// No sensor of this system gives a position beyond this, m.
const POSITION_LIMIT: f64 = 100.0;

/// No sensor of this system gives a force beyond this, N.
const FORCE_LIMIT: f64 = 1e4;

/// What the slave measured in one tick: tool and force of the same instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Where the tool is, or would be if it did not give, world frame, m.
    pub tool: Vec2,
    /// How far it stands back from there by a spring of its own, m; zero where it does not give.
    pub back: Vec2,
    /// f_s, contact force on the object, world frame, N; positive when the tool pushes the object.
    pub force: Vec2,
    /// Noise of the force per axis, N, where it is more than the settings are made for; else 0.
    pub force_noise_n: f64,
    /// Whether the limit of the tool's force keeps the tool from the HIP: what it touches withstands all that it presses with.
    pub held_back: bool,
    /// Inward unit normal of the touched face as the pose observer has it; none when not in contact. It
    /// serves until the direction of the force is known.
    pub normal: Option<Vec2>,
    /// Where the slave sees the object; none: it is taken to be pushed through its centre.
    pub seen: Option<Seen>,
}

impl Measured {
    pub(super) fn is_usable(&self) -> bool {
        // written so that NaN fails
        let within = |v: &Vec2, limit: f64| v.x.abs() <= limit && v.y.abs() <= limit;
        within(&self.tool, POSITION_LIMIT)
            && within(&self.back, POSITION_LIMIT)
            && within(&self.force, FORCE_LIMIT)
            && self.normal.is_none_or(|normal| within(&normal, 1.0))
            && self.seen.is_none_or(|seen| seen.is_usable())
    }
}

/// The object as the slave sees it: of its own observer, never the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// Centre of the object, world frame, m.
    pub centre: Vec2,
    /// Turning rate omega of the touched face or tangent, rad/s, counter-clockwise.
    pub turning: f64,
    /// Turning rate of the object itself, rad/s: another one only where the tangent turns on a curved side.
    pub body_turning: f64,
    /// Side l of the square that (8) and (9) are written for, m.
    pub side: f64,
}

impl Seen {
    /// Whether every number is one that an object of this system can have.
    pub(super) fn is_usable(&self) -> bool {
        // written so that NaN fails
        self.centre.norm() <= POSITION_LIMIT
            && self.turning.abs() <= TURN_RATE_RAD_PER_S
            && self.body_turning.abs() <= TURN_RATE_RAD_PER_S
            && self.side >= 2.0 * FACE_OFFSET_M.0
    }
}
