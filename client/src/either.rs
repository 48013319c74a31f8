//! Whose force the hand feels where it may feel the tool's too: the local model's, the tool's, or a fade between them.
//!
//! The model runs all the time, so that it is there when it is wanted; of the tool's force only the share that is felt
//! passes TDPA's port. The model's share grows only as fast as the model's tank pays for what the coupling stores, so a
//! fade gives the hand no energy. It must never change the force by a fade faster than [`FADE_TICKS`] allows, never
//! wait or allocate; what it blends goes through the limiter.

use mmt_shared::bilateral::passivity::{PortEnergy, RESERVE_J, impedance_controller};
use mmt_shared::model::geometry::Vec2;
use mmt_shared::model::local_model::{LocalModel, Rendered};
use mmt_shared::model::tool::{HandPort, Tool};
use mmt_shared::time::{TICK_S, Time};
use mmt_shared::wire::Architecture;

use crate::choice::{Choice, Chosen};

/// A fade from end to end, ticks: at the 8 N of the default device 40 mN a tick, the least force that is perceived.
pub const FADE_TICKS: u16 = 200;
/// So long a fade waits for the hand to let go of what it feels, ticks: longer than a push. Both are passive meanwhile.
pub const PATIENCE_TICKS: u32 = 5000;
/// When the packing of the samples changes, the slave's play-out learns that within this, s, ...
const LEARNS_S: f64 = 0.6;
/// ... and takes so many times the difference to come down to it (`docs/model.md`, Play-out).
const UNPACKS: f64 = 100.0;
/// A force of the tool that is older than this, ticks, is not faded in.
const FRESH_TICKS: u32 = 100;

/// What became of the choice, for reports.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ChoiceOutcome {
    /// Ticks in which the tool's force was felt alone.
    pub tool_ticks: u64,
    /// Ticks in all.
    pub ticks: u64,
    /// Largest change of the force on the hand in a tick of a fade, N.
    pub fade_step_n: f64,
}

/// What stands between the model's force and the limiter.
#[derive(Clone, Debug)]
pub struct Either {
    choice: Choice,
    /// The only one that may be felt, where there is no choice.
    fixed: Option<Chosen>,
    /// Share of the model, in ticks of a fade: 0 is the tool's force alone.
    model_share: u16,
    /// How long the first sample of a packet waits for the last, s, while the tool's force is not wanted.
    packing_s: f64,
    /// What of that is in the round trip now, s.
    packed_s: f64,
    /// For how long it has been wanted, or not.
    since_ticks: u32,
    round_trip_s: Option<f64>,
    model_error: f64,
    received: Vec2,
    tool_in_contact: bool,
    silent_ticks: u32,
    /// For how long another one than the chosen one has been felt.
    waited_ticks: u32,
    other_in_j: f64,
    network: PortEnergy,
    wants_force: bool,
    /// The model's share of what is felt in this tick, N on the object.
    of_model: Vec2,
    /// The tool's share of the force that the device has held since the last tick, N on the object.
    held: Vec2,
    last_hip: Option<Vec2>,
    last_velocity: Vec2,
    hand_force: Vec2,
    outcome: ChoiceOutcome,
}

impl Either {
    /// For a device of stiffness k_p (N/m): the model until the tool has been heard of. None where the architecture
    /// leaves the hand the model alone.
    #[must_use]
    pub fn new(architecture: Architecture, k_p: f64) -> Option<Self> {
        let fixed = match architecture {
            Architecture::Mmt => return None,
            Architecture::Tdpa => Some(Chosen::Tdpa),
            Architecture::Auto => None,
        };
        Some(Self {
            choice: Choice::for_stiffness(k_p),
            fixed,
            model_share: FADE_TICKS,
            packing_s: 0.0,
            packed_s: 0.0,
            since_ticks: 0,
            round_trip_s: None,
            model_error: 1.0,
            received: Vec2::zeros(),
            tool_in_contact: false,
            silent_ticks: u32::MAX,
            waited_ticks: 0,
            other_in_j: 0.0,
            network: PortEnergy::with_reserve(RESERVE_J),
            wants_force: false,
            of_model: Vec2::zeros(),
            held: Vec2::zeros(),
            last_hip: None,
            last_velocity: Vec2::zeros(),
            hand_force: Vec2::zeros(),
            outcome: ChoiceOutcome::default(),
        })
    }

    /// So many samples go out in a packet while the tool's force is not wanted: that is no part of the path of a force.
    pub fn packs(&mut self, samples_per_command: u8) {
        self.packing_s = f64::from(samples_per_command.saturating_sub(1)) * TICK_S;
    }

    /// The choice and what it rests on.
    #[must_use]
    pub fn choice(&self) -> &Choice {
        &self.choice
    }

    /// The model's relative error of late, as the slave says it; 1 before it has said anything.
    #[must_use]
    pub fn model_error(&self) -> f64 {
        self.model_error
    }

    /// The model's share of the force, 0 to 1.
    #[must_use]
    pub fn model_share(&self) -> f64 {
        f64::from(self.model_share) / f64::from(FADE_TICKS)
    }

    /// What became of the choice so far.
    #[must_use]
    pub fn outcome(&self) -> &ChoiceOutcome {
        &self.outcome
    }

    /// Whether what is felt most is in contact.
    #[must_use]
    pub fn in_contact(&self, model_in_contact: bool) -> bool {
        match 2 * self.model_share > FADE_TICKS {
            true => model_in_contact,
            false => self.tool_in_contact,
        }
    }

    /// Takes in news of the tool that arrived at `now`, by the master's clock, no older than the news before.
    pub fn receive(&mut self, now: Time, tool: &Tool) {
        self.round_trip_s = Some(now.saturating_since(tool.answers).as_secs_f64());
        self.model_error = tool.model_error;
        self.tool_in_contact = tool.in_contact;
        self.other_in_j = self.other_in_j.max(tool.in_j);
        if let Some(force) = tool.force {
            self.received = force.newtons();
            self.silent_ticks = 0;
        }
    }

    /// One tick, with the HIP (m) and what the model has rendered for it: the force on the object (N) that is to be felt.
    pub fn blend(&mut self, hip: Vec2, model: &mut LocalModel, rendered: &Rendered) -> Vec2 {
        let way = hip - self.last_hip.unwrap_or(hip);
        self.last_hip = Some(hip);
        // E(k) = E(k−1) + f(k−1)·(x(k) − x(k−1)), of the tool's share
        self.network.push(self.held.dot(&way), self.other_in_j);
        let v = way / TICK_S;
        // the velocity that the force of this tick will meet
        let next_v = v * 2.0 - self.last_velocity;
        self.last_velocity = v;
        self.silent_ticks = self.silent_ticks.saturating_add(1);

        let round_trip_s = self.round_trip_without_packing();
        let chosen = self.choice.tick(round_trip_s, self.model_error);
        let chosen = self.fixed.unwrap_or(chosen);
        self.fade(chosen, model, rendered);
        let wants_force = chosen == Chosen::Tdpa || self.model_share < FADE_TICKS;
        self.since_ticks = match wants_force == self.wants_force {
            true => self.since_ticks.saturating_add(1),
            false => 0,
        };
        self.wants_force = wants_force;
        let share = self.model_share();
        self.of_model = rendered.force * share;
        let margin_j = self.network.margin_j(self.other_in_j);
        // what repays the reserve is faded in as well: on its own it would be a jolt
        let of_tool = impedance_controller(self.received, next_v, margin_j) * (1.0 - share);
        self.of_model + of_tool
    }

    /// Takes note of the force on the hand (N) that the limiter let through.
    pub fn displayed(&mut self, hand_force: Vec2) {
        // what the limiter did is the tool's, as long as the tool is felt
        self.held = match self.model_share < FADE_TICKS {
            true => -hand_force - self.of_model,
            false => Vec2::zeros(),
        };
        let step_n = (hand_force - self.hand_force).norm();
        self.hand_force = hand_force;
        let outcome = &mut self.outcome;
        outcome.ticks += 1;
        outcome.tool_ticks += u64::from(self.model_share == 0);
        if 0 < self.model_share && self.model_share < FADE_TICKS {
            outcome.fade_step_n = outcome.fade_step_n.max(step_n);
        }
    }

    /// What goes to the tool's port after this tick.
    #[must_use]
    pub fn port(&self) -> HandPort {
        HandPort {
            in_j: self.network.in_j,
            wants_force: self.wants_force,
            passive_tool: self.model_share == 0,
        }
    }

    /// The newest round trip (s) as it is for a force, each sample in a packet of its own.
    fn round_trip_without_packing(&mut self) -> Option<f64> {
        let seen_s = self.round_trip_s.take()?;
        let settles_s = LEARNS_S + UNPACKS * self.packing_s;
        if f64::from(self.since_ticks) * TICK_S > settles_s + seen_s {
            self.packed_s = if self.wants_force {
                0.0
            } else {
                self.packing_s
            };
        }
        Some((seen_s - self.packed_s).max(0.0))
    }

    /// One tick's step towards what is chosen, once the hand has let go or will not.
    fn fade(&mut self, chosen: Chosen, model: &mut LocalModel, rendered: &Rendered) {
        let aim = match chosen {
            Chosen::Tdpa => 0,
            Chosen::Mediated => FADE_TICKS,
        };
        let fading = self.model_share != 0 && self.model_share != FADE_TICKS;
        let free = !rendered.in_contact() && !self.tool_in_contact;
        self.waited_ticks = match self.model_share == aim {
            true => 0,
            false => self.waited_ticks.saturating_add(1),
        };
        if !fading && !free && self.waited_ticks < PATIENCE_TICKS {
            return;
        }
        match chosen {
            Chosen::Tdpa if self.silent_ticks <= FRESH_TICKS && self.model_share > 0 => {
                if self.model_share == FADE_TICKS {
                    // what the tool took in before is nobody's credit now
                    self.network.out_j = self.other_in_j + RESERVE_J;
                }
                self.model_share -= 1;
            }
            Chosen::Mediated if self.model_share < FADE_TICKS => {
                let pen = rendered.touch.map_or(0.0, |touch| touch.penetration);
                let stored_j = model.settings().coupling.energy(pen);
                if model.pay(stored_j / f64::from(FADE_TICKS)) {
                    self.model_share += 1;
                }
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests;
