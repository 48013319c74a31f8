//! The two ports of a run in virtual time: the work of the hand and of the tool, and the budget between them.
//!
//! Judged by the truth, from outside: the force that the hand was given and the true force on the object.

use std::collections::VecDeque;

use mmt_shared::model::geometry::Vec2;
use mmt_shared::time::TICK_S;

use crate::world::{World, WorldTick};

/// What a round trip takes besides the path: packing, play-out, a tick each, s.
pub(crate) const WORKING_S: f64 = 0.05;
/// The tool may give as much more than the hand gave as it takes to press with its limit over the hand's way in a round trip, N.
const PRESS_N: f64 = 15.0;
/// And this share of the hand's work.
const WORK_SHARE: f64 = 0.25;

/// What passed the two ports so far.
pub(crate) struct TwoPorts {
    /// Ways of the HIP of the last round trip, m a tick, and their sum.
    ways: VecDeque<f64>,
    way_m: f64,
    round_trip_ticks: usize,
    hip: Option<Vec2>,
    /// The tool, m, and the force on the object, N, in the last tick.
    tool: Option<(Vec2, Vec2)>,
    /// Work of the tool on the object, J.
    tool_j: f64,
    /// The hand's way in a round trip at its longest, m.
    way_max_m: f64,
    excess_j: f64,
}

impl TwoPorts {
    /// Nothing has passed; the path takes `path_s` (s) there and back.
    pub(crate) fn new(path_s: f64) -> Self {
        Self {
            ways: VecDeque::new(),
            way_m: 0.0,
            round_trip_ticks: ((path_s + WORKING_S) / TICK_S) as usize,
            hip: None,
            tool: None,
            tool_j: 0.0,
            way_max_m: 0.0,
            excess_j: 0.0,
        }
    }

    /// Takes a tick of the world, after it.
    pub(crate) fn take(&mut self, world: &World, tick: &WorldTick) {
        let hip = tick.master.sample.hip.metres();
        let way = self
            .hip
            .replace(hip)
            .map_or(0.0, |before| (hip - before).norm());
        self.ways.push_back(way);
        self.way_m += way;
        while self.ways.len() > self.round_trip_ticks {
            self.way_m -= self.ways.pop_front().unwrap_or_default();
        }
        self.way_max_m = self.way_max_m.max(self.way_m);
        let Some(slave) = &tick.slave else {
            return;
        };
        let now = (slave.tool, slave.true_force);
        let (tool, force) = self.tool.replace(now).unwrap_or(now);
        // trapezoidal rule: a force that comes and goes from tick to tick does no work by that
        self.tool_j += 0.5 * (force + slave.true_force).dot(&(slave.tool - tool));
        let hand_j = world.master().port().energy_j();
        let budget_j = WORK_SHARE * hand_j.max(0.0) + PRESS_N * self.way_max_m;
        self.excess_j = self.excess_j.max(self.tool_j - hand_j - budget_j);
    }

    /// The hand's way in the last round trip, m.
    pub(crate) fn way_m(&self) -> f64 {
        self.way_m
    }

    /// Work of the tool on the object, J.
    #[cfg(test)]
    pub(crate) fn tool_j(&self) -> f64 {
        self.tool_j
    }

    /// The most by which the tool's work exceeded the hand's work and the budget, J; at least 0.
    pub(crate) fn excess_j(&self) -> f64 {
        self.excess_j
    }
}

#[cfg(test)]
mod tests;
