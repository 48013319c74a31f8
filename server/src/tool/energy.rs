//! The limit on the energy that the tool gives to the object: what the hand gave, and a budget.
//!
//! The hand of a model that is too light pushes with less force than the tool: the difference comes from the tool's drive.
//! Nobody can know for a round trip, and a little goes wrong in every estimate, so there is a budget:
//! a share of the hand's work, and the limit of the tool's force over the hand's way in a round trip. Beyond it
//! the tool goes on only as the hand's work does. Pure; it must never hold a tool that does not press on anything.

use std::collections::VecDeque;
use std::time::Duration;

use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::range::{OutOfRange, in_range};
use mmt_shared::time::TICK_S;
use serde::{Deserialize, Serialize};

/// What a round trip takes besides the path, s: packing, play-out, a tick at each side.
const WORKING_S: f64 = 0.05;
/// Longest round trip that is allowed for, s.
const ROUND_TRIP_MAX_S: f64 = 4.0;
/// No hand goes farther in a tick, m: a device's reading that jumps is no work.
const WAY_MAX_M: f64 = 0.01;
/// By so much the tool may go to and fro without work, m: a sensor that lags gives a tremor on a stiff contact work that it does
/// not do.
const PLAY_M: f64 = 5e-4;
/// In the budget from the beginning, J: as long as nobody knows the sensor's bias, that holds no free tool.
const START_J: f64 = 0.02;
/// Ticks for which the flags show it after the tool was held.
const SHOWN_TICKS: u32 = 100;
/// Accepted force of a hand, N.
const HAND_FORCE_N: (f64, f64) = (0.1, 1000.0);
/// Accepted share of the hand's work.
const SHARE: (f64, f64) = (0.0, 10.0);

/// How the energy of the tool is bounded.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct EnergyConfig {
    /// Whether the tool is held beyond the budget. Default: yes; in paper mode no, the paper has no such bound.
    pub bounded: bool,
    /// No hand presses with more than this, N: it is credited with no more, and an object that more does not move is held by something
    /// else. Default 8: the largest of the devices' profiles.
    pub hand_force_max_n: f64,
    /// The tool may give as much more than the hand did, as a share of the hand's work. Default 0.25: the error of an ordinary
    /// force sensor's gain, twice, and of an estimate.
    pub share: f64,
}

impl Default for EnergyConfig {
    fn default() -> Self {
        Self {
            bounded: true,
            hand_force_max_n: 8.0,
            share: 0.25,
        }
    }
}

/// Where the master's hand was and what it felt, as far as samples show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandSample {
    /// The HIP, m.
    pub hip: Vec2,
    /// f_m that was rendered there, N on the object.
    pub force: Vec2,
}

/// The tool's place less a play, by which it may tremble without work.
#[derive(Clone, Copy, Debug)]
struct Trail {
    /// It follows the tool at [`PLAY_M`], m.
    place: Vec2,
    /// Last force on the object, N.
    force: Vec2,
}

impl Trail {
    /// The tool is at `place` (m) with this force on the object (N); the work since the last place, J.
    fn follow(&mut self, place: Vec2, force: Vec2) -> f64 {
        let behind = place - self.place;
        let way = behind * (1.0 - PLAY_M / behind.norm().max(PLAY_M));
        self.place += way;
        // trapezoidal rule
        let mean = (std::mem::replace(&mut self.force, force) + force) * 0.5;
        mean.dot(&way)
    }
}

/// Both ports' work, and the bound on the difference.
#[derive(Clone, Debug)]
pub struct ToolEnergy {
    config: EnergyConfig,
    /// The limit of the tool's force, N.
    force_max_n: f64,
    /// k_p, N/m: the contact stores f²/(2 k_p) at most, unless it is softer.
    stiffness_n_per_m: f64,
    /// The tool goes no faster, m/s.
    speed_max_m_per_s: f64,
    hand: Option<HandSample>,
    /// Work of the hand, J.
    hand_j: f64,
    /// It is no less than this, J: the model is passive, so the hand gets no more back than the model holds.
    hand_least_j: f64,
    /// Work of the tool, J.
    tool_j: f64,
    trail: Option<Trail>,
    /// Ways of the HIP in the ticks of the last round trip, m, and their sum, now and at its longest.
    ways: VecDeque<f64>,
    way_m: f64,
    way_max_m: f64,
    round_trip_ticks: usize,
    held_ticks: u64,
    shown_ticks: u32,
}

impl ToolEnergy {
    /// Nothing has passed. The tool presses with `force_max_n` (N) and goes at `speed_max_m_per_s` at the most.
    ///
    /// # Errors
    /// Names the number that is not within its range.
    pub fn try_new(
        config: EnergyConfig,
        force_max_n: f64,
        coupling: Coupling,
        speed_max_m_per_s: f64,
    ) -> Result<Self, OutOfRange> {
        let most = config.hand_force_max_n;
        in_range("tool energy: hand force", "N", most, HAND_FORCE_N)?;
        in_range("tool energy: share", "", config.share, SHARE)?;
        let ticks = ((ROUND_TRIP_MAX_S + WORKING_S) / TICK_S) as usize;
        Ok(Self {
            config,
            force_max_n,
            stiffness_n_per_m: coupling.stiffness_n_per_m,
            speed_max_m_per_s,
            hand: None,
            hand_j: 0.0,
            hand_least_j: f64::NEG_INFINITY,
            tool_j: 0.0,
            trail: None,
            ways: VecDeque::with_capacity(ticks + 1),
            way_m: 0.0,
            way_max_m: 0.0,
            round_trip_ticks: (WORKING_S / TICK_S) as usize,
            held_ticks: 0,
            shown_ticks: 0,
        })
    }

    /// Work of the hand on the model as the samples show it, J.
    #[must_use]
    pub fn hand_j(&self) -> f64 {
        self.hand_j
    }

    /// Work of the tool on the object by the measured force, J.
    #[must_use]
    pub fn tool_j(&self) -> f64 {
        self.tool_j
    }

    /// Ticks in which the bound shortened the tool's way.
    #[must_use]
    pub fn held_ticks(&self) -> u64 {
        self.held_ticks
    }

    /// Whether the bound holds the tool, or has within the last 100 ms.
    #[must_use]
    pub fn holds(&self) -> bool {
        self.shown_ticks > 0
    }

    /// How much more than the hand the tool may give so far, J.
    #[must_use]
    pub fn budget_j(&self) -> f64 {
        self.config.share * self.hand_j.max(0.0) + self.force_max_n * self.way_max_m + START_J
    }

    /// The path takes so long, there and back.
    pub fn set_round_trip(&mut self, path: Duration) {
        let s = path.as_secs_f64().min(ROUND_TRIP_MAX_S) + WORKING_S;
        self.round_trip_ticks = (s / TICK_S) as usize;
    }

    /// After the newest sample the master's model can give the hand so much back, J.
    pub(super) fn set_returnable(&mut self, returnable_j: f64) {
        self.hand_least_j = self.hand_least_j.max(self.hand_j - returnable_j);
    }

    /// Begins at a place (m) where an earlier session left the tool with this force on it, N.
    pub(super) fn begin_at(&mut self, place: Vec2, force: Vec2) {
        self.trail = Some(Trail { place, force });
        self.tool_j = self.stored_j(force);
    }

    /// Takes the hand's sample that is played in this tick; none where no sample shows it.
    pub(super) fn follow_hand(&mut self, hand: Option<HandSample>) {
        let before = std::mem::replace(&mut self.hand, hand);
        let way = match (before, hand) {
            (Some(before), Some(hand)) => hand.hip - before.hip,
            _ => Vec2::zeros(),
        };
        let length = way.norm();
        let most = self.speed_max_m_per_s * TICK_S;
        self.push_way(length.min(most));
        if let Some(before) = before.filter(|_| length <= WAY_MAX_M) {
            // E(k) = E(k−1) + f(k−1)·(x(k) − x(k−1)), of the force that the device may have shown
            let shown = self.config.hand_force_max_n / before.force.norm();
            self.hand_j += before.force.dot(&way) * shown.min(1.0);
            // a box that is carried back takes the HIP with it: the hand does not get what that looks like
            self.hand_j = self.hand_j.max(self.hand_least_j);
        }
    }

    fn push_way(&mut self, way_m: f64) {
        self.ways.push_back(way_m);
        self.way_m += way_m;
        while self.ways.len() > self.round_trip_ticks {
            self.way_m -= self.ways.pop_front().unwrap_or_default();
        }
        self.way_max_m = self.way_max_m.max(self.way_m);
    }

    /// How far the tool may go along its force (N on the object), m: as far as what may still be given lasts. Without a bound or a
    /// force as far as it likes.
    pub(super) fn way_left_m(&self, force: Vec2) -> f64 {
        let size = force.norm();
        if !self.config.bounded || size <= 0.0 {
            return f64::INFINITY;
        }
        // what the contact stores comes back
        let given_j = self.tool_j - self.stored_j(force);
        let left_j = self.hand_j + self.budget_j() - given_j;
        left_j.max(0.0) / size
    }

    /// Notes whether the bound shortened the way of this tick.
    pub(super) fn note(&mut self, held: bool) {
        self.held_ticks += u64::from(held);
        self.shown_ticks = if held {
            SHOWN_TICKS
        } else {
            self.shown_ticks.saturating_sub(1)
        };
    }

    /// Takes the force (N on the object) that is measured with the tool at `place` (m).
    pub(super) fn measured(&mut self, place: Vec2, force: Vec2) {
        let trail = self.trail.get_or_insert(Trail { place, force });
        self.tool_j += trail.follow(place, force);
    }

    fn stored_j(&self, force: Vec2) -> f64 {
        0.5 * force.norm_squared() / self.stiffness_n_per_m
    }
}

#[cfg(test)]
mod tests;
