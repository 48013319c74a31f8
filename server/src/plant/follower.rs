//! Where the tool of somebody else's plant is sent: after the slave's tool, within the limits of that plant.

use mmt_shared::model::geometry::Vec2;
use mmt_shared::time::TICK_S;

use crate::motion_limits::{Goal, MotionLimits};

/// Where the tool is sent.
#[derive(Clone, Copy, Debug)]
pub(super) struct Follower {
    limits: MotionLimits,
    /// Place (m) and velocity (m/s); none before it is placed.
    at: Option<(Vec2, Vec2)>,
}

impl Follower {
    pub(super) fn new(limits: MotionLimits) -> Self {
        Self { limits, at: None }
    }

    /// No tool is sent faster, m/s.
    pub(super) fn speed_max_m_per_s(&self) -> f64 {
        self.limits.speed_m_per_s
    }

    /// At rest at a place, m.
    pub(super) fn place(&mut self, tool: Vec2) {
        self.at = Some((tool, Vec2::zeros()));
    }

    /// One tick towards `tool` (m), which moves at `velocity` (m/s): place and velocity.
    pub(super) fn step(&mut self, tool: Vec2, velocity: Vec2) -> (Vec2, Vec2) {
        let (place, before) = self.at.unwrap_or((tool, velocity));
        let way = tool - place;
        let way = self.limits.way(before, Goal { way, velocity }, TICK_S);
        let now = (place + way, way / TICK_S);
        self.at = Some(now);
        now
    }
}
