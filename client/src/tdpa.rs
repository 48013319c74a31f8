//! The hand's side of time-domain passivity control (TDPA): the tool's force, and the energy that pays for it.
//!
//! The ledger holds what the hand gets to what went in at the tool (`docs/baselines.md`). Pure: it never waits or
//! allocates, and what it returns goes through the limiter.

use mmt_shared::model::geometry::Vec2;
use mmt_shared::model::tool::{HandPort, Tool};
use mmt_shared::passivity::{PortEnergy, REPAYMENT_NS_PER_M, RESERVE_J, impedance_controller};
use mmt_shared::time::{TICK_S, Time};

/// Time constant of the round trip, s: a single late packet is no path.
const ROUND_TRIP_TAU_S: f64 = 0.2;

/// The hand's port.
#[derive(Clone, Debug)]
pub struct TdpaHand {
    energy: PortEnergy,
    /// E_in of the tool's port as far as is known, J.
    other_in_j: f64,
    /// f_s, the newest force of the tool, N on the object.
    received: Vec2,
    tool_in_contact: bool,
    newest_round_trip_s: Option<f64>,
    round_trip_s: Option<f64>,
    /// Force on the object that the device has held since the last tick, N.
    held: Vec2,
    last_hip: Option<Vec2>,
    last_velocity: Vec2,
}

impl Default for TdpaHand {
    /// A port through which nothing has passed, and no force until the tool's has come.
    fn default() -> Self {
        Self {
            energy: PortEnergy::with_reserve(RESERVE_J),
            other_in_j: 0.0,
            received: Vec2::zeros(),
            tool_in_contact: false,
            newest_round_trip_s: None,
            round_trip_s: None,
            held: Vec2::zeros(),
            last_hip: None,
            last_velocity: Vec2::zeros(),
        }
    }
}

impl TdpaHand {
    /// Whether the tool touches the object, as far as is known.
    pub fn tool_in_contact(&self) -> bool {
        self.tool_in_contact
    }

    /// The smoothed round trip of the force, s: from a HIP sample to its answer, play-out included. None before the
    /// first answer.
    pub fn round_trip_s(&self) -> Option<f64> {
        self.round_trip_s
    }

    /// What goes to the tool's port after this tick.
    pub fn port(&self) -> HandPort {
        HandPort {
            in_j: self.energy.in_j,
        }
    }

    /// Takes in the tool's state that arrived at `now`, by the master's clock, no older than the one before.
    pub fn receive(&mut self, now: Time, tool: &Tool) {
        self.newest_round_trip_s = Some(now.saturating_since(tool.answers).as_secs_f64());
        self.tool_in_contact = tool.in_contact;
        self.other_in_j = self.other_in_j.max(tool.in_j);
        self.received = tool.force.newtons();
    }

    /// One tick with the HIP, m: the force on the object to be displayed, N.
    pub fn step(&mut self, hip: Vec2) -> Vec2 {
        let way = hip - self.last_hip.unwrap_or(hip);
        self.last_hip = Some(hip);
        // E(k) = E(k−1) + f(k−1)·(x(k) − x(k−1)): exact, since the device held f
        self.energy.push(self.held.dot(&way), self.other_in_j);
        let v = way / TICK_S;
        // the velocity that the force of this tick will meet
        let next_v = v * 2.0 - self.last_velocity;
        self.last_velocity = v;
        self.smooth_round_trip();
        let margin_j = self.energy.margin_j(self.other_in_j);
        impedance_controller(self.received, next_v, margin_j, REPAYMENT_NS_PER_M)
    }

    /// Takes note of the force on the hand (N) that the limiter let through.
    pub fn displayed(&mut self, hand_force: Vec2) {
        self.held = -hand_force;
    }

    fn smooth_round_trip(&mut self) {
        if let Some(newest_s) = self.newest_round_trip_s {
            let smoothed_s = self.round_trip_s.get_or_insert(newest_s);
            *smoothed_s += (newest_s - *smoothed_s) * (TICK_S / ROUND_TRIP_TAU_S);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mmt_shared::model::sample::ForceCounts;

    fn tool(answers_ms: u64, force: Vec2, in_j: f64) -> Tool {
        Tool {
            answers: Time::from_millis(answers_ms),
            force: ForceCounts::nearest(force),
            in_contact: true,
            in_j,
        }
    }

    #[test]
    fn a_hand_at_rest_feels_the_newest_force_of_the_tool() {
        let mut hand = TdpaHand::default();
        assert_eq!(hand.step(Vec2::zeros()), Vec2::zeros());
        hand.receive(Time::from_millis(30), &tool(20, Vec2::new(1.0, 0.5), 0.0));
        assert_eq!(hand.step(Vec2::zeros()), Vec2::new(1.0, 0.5));
        assert!(hand.tool_in_contact());
        assert!((hand.round_trip_s().unwrap() - 0.01).abs() < 1e-12);
    }

    #[test]
    fn a_hand_that_is_pushed_gets_no_more_than_went_in_at_the_tool() {
        for in_j in [RESERVE_J, 5e-3] {
            let mut hand = TdpaHand::default();
            hand.receive(Time::ZERO, &tool(0, Vec2::new(1.5, 0.0), in_j));
            // the hand gives way at 0.1 m/s for a second: 150 mJ, if it were let
            let mut given_j = 0.0;
            for ms in 0..1000 {
                let held = hand.held;
                let force = hand.step(Vec2::new(-1e-4 * f64::from(ms), 0.0));
                given_j += if ms > 0 { held.x * 1e-4 } else { 0.0 };
                hand.displayed(-force);
            }
            assert!(given_j <= in_j - RESERVE_J + 1e-5, "{given_j} of {in_j} J");
            assert!(hand.port().in_j < 1e-15);
        }
    }

    #[test]
    fn what_the_hand_does_on_the_tool_goes_into_its_port() {
        let mut hand = TdpaHand::default();
        hand.receive(Time::ZERO, &tool(0, Vec2::new(1.0, 0.0), 1.0));
        for ms in 0..=1000 {
            let force = hand.step(Vec2::new(1e-4 * f64::from(ms), 0.0));
            hand.displayed(-force);
        }
        // 1 N over 0.1 m
        assert!(
            (hand.port().in_j - 0.1).abs() < 1e-3,
            "{}",
            hand.port().in_j
        );
    }
}
