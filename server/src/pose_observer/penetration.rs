//! How deep the tool is behind the surface: the force law (6), inverted.

use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::time::TICK_S;

/// Follows the depth of the tool.
#[derive(Clone, Copy, Debug)]
pub(super) struct Penetration {
    coupling: Coupling,
    /// Depth of the tool behind the surface, m.
    pub(super) depth: f64,
    /// The tool in the tick before, m.
    tool_before: Option<Vec2>,
}

impl Penetration {
    pub(super) fn new(coupling: Coupling) -> Self {
        Self {
            coupling,
            depth: 0.0,
            tool_before: None,
        }
    }

    /// The first tick of a contact: what the damper does not explain at the tool's speed is the spring's, of the tick before.
    pub(super) fn begin(&mut self, tool: Vec2, force: Vec2) {
        let size = force.norm();
        let way = tool - self.tool_before.unwrap_or(tool);
        let way = if size > 0.0 {
            (way.dot(&force) / size).max(0.0)
        } else {
            0.0
        };
        let Coupling {
            stiffness_n_per_m: k_p,
            damping_ns_per_m: k_d,
        } = self.coupling;
        self.depth = ((size - k_d * way / TICK_S) / k_p - way).max(0.0);
    }

    /// One tick of contact under a force along the inward normal (N): k_d d(depth)/dt + k_p depth = f, implicit.
    pub(super) fn follow(&mut self, force: f64) {
        let Coupling {
            stiffness_n_per_m: k_p,
            damping_ns_per_m: k_d,
        } = self.coupling;
        self.depth = (k_d * self.depth + force * TICK_S) / (k_d + k_p * TICK_S);
    }

    /// The end of each tick, in contact or not.
    pub(super) fn remember(&mut self, tool: Vec2) {
        self.tool_before = Some(tool);
    }
}
