//! The master's core that lets the hand feel the local model or the tool's force, and fades from one to the other.
//!
//! The model runs all the time, so that it is there when it is wanted; of the tool's force only the share that is felt
//! passes TDPA's port. The model's share grows only as fast as the model's tank pays for what the coupling stores, so a
//! fade gives the hand no energy. It must never change the force by a fade faster than [`FADE_TICKS`] allows, never
//! wait or allocate, and force leaves it through the limiter only.

use mmt_shared::bilateral::passivity::{PortEnergy, RESERVE_J, impedance_controller};
use mmt_shared::geometry::Vec2;
use mmt_shared::local_model::{LocalModel, Rendered};
use mmt_shared::time::{TICK_S, Time};
use mmt_shared::wire::{ForceCounts, HipCounts, HipSample, Update, Welcome};

use crate::choice::{Choice, Chosen};
use crate::limiter::ForceLimiter;
use crate::master::PortObserver;
use crate::operator::scripted::View;

/// A fade from end to end, ticks: at the 8 N of the default device 40 mN a tick, the least force that is perceived.
pub const FADE_TICKS: u16 = 200;
/// So long a fade waits for the hand to let go of what it feels, ticks: longer than a push. Both are passive meanwhile.
pub const PATIENCE_TICKS: u32 = 5000;
/// A force of the tool that is older than this, ticks, is not faded in.
const FRESH_TICKS: u32 = 100;

/// What the slave says of the tool.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToolNews {
    /// The slave's time of sending: older news than the newest is of no use.
    pub sent: Time,
    /// Stamp of the sample that the tool was at, by the master's clock: from it comes the round trip that the hand would
    /// feel, play-out included.
    pub echo: Time,
    /// f_s, N on the object; none where the slave does not stream it.
    pub force: Option<ForceCounts>,
    /// Whether the tool touches the object.
    pub in_contact: bool,
    /// E_in of the tool's port, J.
    pub in_j: f64,
    /// Relative error of the model of late.
    pub model_error: f64,
}

/// What one haptic tick gave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EitherTick {
    /// Goes to the slave: the HIP and the force that is felt for it.
    pub sample: HipSample,
    /// What the model did.
    pub rendered: Rendered,
    /// Force on the hand, N, limited.
    pub hand_force: Vec2,
    /// E_in of this port, J; goes to the slave.
    pub in_j: f64,
    /// Whether the slave is to stream the tool's force.
    pub wants_force: bool,
    /// Whether the tool is to go only as far as the hand has paid for.
    pub passive_tool: bool,
}

/// The master between the device and the link.
#[derive(Clone, Debug)]
pub struct EitherMaster {
    model: LocalModel,
    limiter: ForceLimiter,
    choice: Choice,
    /// The only one that may be felt, where there is no choice.
    fixed: Option<Chosen>,
    /// Share of the model, in ticks of a fade: 0 is the tool's force alone.
    model_share: u16,
    newest: Option<Time>,
    round_trip_s: Option<f64>,
    model_error: f64,
    received: Vec2,
    tool_in_contact: bool,
    silent_ticks: u32,
    /// For how long another one than the chosen one has been felt.
    waited_ticks: u32,
    other_in_j: f64,
    network: PortEnergy,
    /// The tool's share of the force that the device has held since the last tick, N on the object.
    held: Vec2,
    hip: HipCounts,
    last_hip: Option<Vec2>,
    last_velocity: Vec2,
    port: PortObserver,
}

impl EitherMaster {
    /// A master that renders what the welcome says until it has heard of the tool. `fixed` leaves it no choice.
    #[must_use]
    pub fn new(welcome: &Welcome, mut limiter: ForceLimiter, fixed: Option<Chosen>) -> Self {
        limiter.engage();
        Self {
            model: LocalModel::new(welcome.settings, welcome.state),
            limiter,
            choice: Choice::for_stiffness(welcome.settings.coupling.stiffness_n_per_m),
            fixed,
            model_share: FADE_TICKS,
            newest: None,
            round_trip_s: None,
            model_error: 1.0,
            received: Vec2::zeros(),
            tool_in_contact: false,
            silent_ticks: u32::MAX,
            waited_ticks: 0,
            other_in_j: 0.0,
            network: PortEnergy::with_reserve(RESERVE_J),
            held: Vec2::zeros(),
            hip: HipCounts::default(),
            last_hip: None,
            last_velocity: Vec2::zeros(),
            port: PortObserver::default(),
        }
    }

    /// The local model, felt or not.
    #[must_use]
    pub fn model(&self) -> &LocalModel {
        &self.model
    }

    /// The choice and what it rests on.
    #[must_use]
    pub fn choice(&self) -> &Choice {
        &self.choice
    }

    /// The model's share of the force, 0 to 1.
    #[must_use]
    pub fn model_share(&self) -> f64 {
        f64::from(self.model_share) / f64::from(FADE_TICKS)
    }

    /// The passivity observer at the hand.
    #[must_use]
    pub fn port(&self) -> &PortObserver {
        &self.port
    }

    /// What the operator sees: the local model. In contact is what is felt.
    #[must_use]
    pub fn view(&self) -> View {
        let state = self.model.state();
        let touches_model = self.model.rendered().in_contact();
        View {
            pose: state.pose,
            footprint: state.footprint,
            in_contact: match 2 * self.model_share > FADE_TICKS {
                true => touches_model,
                false => self.tool_in_contact,
            },
        }
    }

    /// Takes in an accepted update, whatever is felt.
    pub fn apply(&mut self, update: &Update) {
        self.model.apply(update);
    }

    /// Takes in news of the tool that arrived at `now`, in any order.
    pub fn receive(&mut self, now: Time, news: &ToolNews) {
        if self.newest.is_some_and(|newest| news.sent <= newest) {
            return;
        }
        self.newest = Some(news.sent);
        self.round_trip_s = Some(now.saturating_since(news.echo).as_secs_f64());
        self.model_error = news.model_error;
        self.tool_in_contact = news.in_contact;
        self.other_in_j = self.other_in_j.max(news.in_j);
        if let Some(force) = news.force {
            self.received = force.newtons();
            self.silent_ticks = 0;
        }
    }

    /// One sample period. `stamp` is the tick's time, `reading` the device's HIP (m, world).
    pub fn tick(&mut self, stamp: Time, reading: Vec2) -> EitherTick {
        if reading.x.is_finite() && reading.y.is_finite() {
            self.hip = HipCounts::nearest(reading);
        }
        let hip = self.hip.metres();
        let way = hip - self.last_hip.unwrap_or(hip);
        self.last_hip = Some(hip);
        // E(k) = E(k−1) + f(k−1)·(x(k) − x(k−1)), of the tool's share
        self.network.push(self.held.dot(&way), self.other_in_j);
        let v = way / TICK_S;
        // the velocity that the force of this tick will meet
        let next_v = v * 2.0 - self.last_velocity;
        self.last_velocity = v;
        self.silent_ticks = self.silent_ticks.saturating_add(1);

        let rendered = self.model.step(stamp, hip);
        let chosen = self.choice.tick(self.round_trip_s.take(), self.model_error);
        let chosen = self.fixed.unwrap_or(chosen);
        self.fade(chosen, &rendered);
        let share = self.model_share();
        let of_model = rendered.force * share;
        let margin_j = self.network.margin_j(self.other_in_j);
        // what repays the reserve is faded in as well: on its own it would be a jolt
        let of_tool = impedance_controller(self.received, next_v, margin_j) * (1.0 - share);
        let felt = of_model + of_tool;
        let hand_force = self.limiter.limit(-felt);
        // what the limiter did is the tool's, as long as the tool is felt
        self.held = match self.model_share < FADE_TICKS {
            true => -hand_force - of_model,
            false => Vec2::zeros(),
        };
        self.port.push(hip, hand_force);
        EitherTick {
            sample: HipSample {
                stamp,
                hip: self.hip,
                force: ForceCounts::nearest(felt),
            },
            rendered,
            hand_force,
            in_j: self.network.in_j,
            wants_force: chosen == Chosen::Tdpa || self.model_share < FADE_TICKS,
            passive_tool: self.model_share == 0,
        }
    }

    /// One tick's step towards what is chosen, once the hand has let go or will not.
    fn fade(&mut self, chosen: Chosen, rendered: &Rendered) {
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
                let stored_j = self.model.settings().coupling.energy(pen);
                if self.model.pay(stored_j / f64::from(FADE_TICKS)) {
                    self.model_share += 1;
                }
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests;
