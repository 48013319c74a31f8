//! The force as the observer takes it.

use mmt_shared::model::geometry::Vec2;

/// The force that the observer takes in a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactForce {
    /// As measured, N.
    pub force: Vec2,
    /// The mean of the newest few where they are noisy, N.
    pub steady: Vec2,
    /// Noise per axis as measured, N, where it is more than the default sensor's; else 0.
    pub noise_n: f64,
    /// How much farther the tool is behind the surface than a contact of k_p would let it under this force, m: a tool that gives
    /// on a contact that gives, until its spring is suited to that.
    pub beyond_m: f64,
    /// Whether an obstacle holds the object, which may turn it as well as the push does.
    pub obstacle: bool,
}

impl From<Vec2> for ContactForce {
    fn from(force: Vec2) -> Self {
        Self {
            force,
            steady: force,
            noise_n: 0.0,
            beyond_m: 0.0,
            obstacle: false,
        }
    }
}
