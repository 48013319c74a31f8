//! The master's core: one haptic tick around the local model, or around the tool's force where the hand feels that.
//!
//! HIP in, force out, a sample for the slave. It must never wait, allocate, log or read a clock, and
//! force leaves it through the limiter only.

mod port;

use std::time::Duration;

use mmt_shared::model::architecture::Architecture;
use mmt_shared::model::geometry::{Pose, Vec2};
use mmt_shared::model::local_model::{LocalModel, Rendered};
use mmt_shared::model::sample::{ForceCounts, HipCounts, HipSample};
use mmt_shared::model::tool::{HandPort, Tool};
use mmt_shared::model::update::{Cause, Update};
use mmt_shared::time::{TICK_S, Time};
use mmt_shared::wire::Welcome;

use crate::failsafe::LinkState;
use crate::limiter::ForceLimiter;
use crate::operator::scripted::View;
use crate::tdpa::TdpaHand;
pub use port::PortObserver;

/// This far from the box, m, a HIP that was carried comes back to the device.
const CLEAR_M: f64 = 0.02;
/// How fast it comes back, m/s.
const RETURN_M_PER_S: f64 = 0.05;

/// What one haptic tick gave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MasterTick {
    /// Goes to the slave: the HIP and the force that is felt for it.
    pub sample: HipSample,
    /// Goes to the tool's port, where the hand feels the tool's force.
    pub port: Option<HandPort>,
    /// What the model did.
    pub rendered: Rendered,
    /// Force on the object that is felt, N, before the limiter: the model's (f_m) or, with TDPA, the tool's.
    pub displayed: Vec2,
    /// Goes to the device: force on the hand, N, world, limited.
    pub hand_force: Vec2,
    /// The link as this tick saw it.
    pub link: LinkState,
}

/// The master between the device and the link.
#[derive(Clone, Debug)]
pub struct Master {
    model: LocalModel,
    /// Where the hand feels the tool's force.
    tdpa: Option<TdpaHand>,
    limiter: ForceLimiter,
    link: LinkState,
    /// The session ends: the hand is not engaged again.
    ended: bool,
    /// An emergency stop is set.
    stopped: bool,
    port: PortObserver,
    /// The last reading that was of numbers, m.
    reading: Vec2,
    /// By how much the HIP is elsewhere than the device, m ([`LocalModel::carry`]).
    offset: Vec2,
    bad_readings: u64,
    applied: [u64; Cause::ALL.len()],
    updates_after_release: u64,
}

impl Master {
    /// A master that renders the model of the slave's welcome, its force limited by `limiter`.
    pub fn new(welcome: &Welcome, limiter: ForceLimiter) -> Self {
        Self::with_architecture(welcome, limiter, Architecture::Mmt)
    }

    /// A master whose hand feels the force of this architecture.
    pub fn with_architecture(
        welcome: &Welcome,
        mut limiter: ForceLimiter,
        architecture: Architecture,
    ) -> Self {
        limiter.engage();
        Self {
            model: LocalModel::new(welcome.settings, welcome.state, welcome.tool_force_max_n),
            tdpa: architecture.feels_tool().then(TdpaHand::default),
            limiter,
            link: LinkState::Fresh,
            ended: false,
            stopped: false,
            port: PortObserver::default(),
            reading: Vec2::zeros(),
            offset: Vec2::zeros(),
            bad_readings: 0,
            applied: [0; Cause::ALL.len()],
            updates_after_release: 0,
        }
    }

    /// The hand's port, where the hand feels the tool's force.
    pub fn tdpa(&self) -> Option<&TdpaHand> {
        self.tdpa.as_ref()
    }

    /// The local model, felt or not.
    pub fn model(&self) -> &LocalModel {
        &self.model
    }

    /// The force limiter.
    pub fn limiter(&self) -> &ForceLimiter {
        &self.limiter
    }

    /// Device readings that were not finite and were replaced by the one before.
    pub fn bad_readings(&self) -> u64 {
        self.bad_readings
    }

    /// Updates that reached the model, by cause.
    pub fn applied(&self) -> [u64; Cause::ALL.len()] {
        self.applied
    }

    /// Updates that came after the hand had been released and were not applied.
    pub fn updates_after_release(&self) -> u64 {
        self.updates_after_release
    }

    /// Energy that updates have added to the model so far beyond what its tank paid, J.
    pub fn energy_injected_j(&self) -> f64 {
        self.model.energy_injected_j()
    }

    /// The passivity observer at the hand.
    pub fn port(&self) -> &PortObserver {
        &self.port
    }

    /// What the operator sees: the local model. In contact is what is felt.
    pub fn view(&self) -> View {
        let state = self.model.state();
        let touches_model = self.model.rendered().in_contact();
        let tdpa = self.tdpa.as_ref();
        View {
            pose: self.seen_by_hand(state.pose),
            footprint: state.footprint,
            in_contact: tdpa.map_or(touches_model, TdpaHand::tool_in_contact),
        }
    }

    /// Where the hand was in the newest tick, m: the HIP without that by which it was carried.
    pub fn reading(&self) -> Vec2 {
        self.reading
    }

    /// A pose of the world from where the hand is: the HIP may be elsewhere than the device.
    pub fn seen_by_hand(&self, pose: Pose) -> Pose {
        Pose {
            position: pose.position - self.offset,
            ..pose
        }
    }

    /// Begins to ramp the force out: the session ends.
    pub fn release(&mut self) {
        self.ended = true;
        self.limiter.release();
    }

    /// Whether a hand holds the device from now on: force ramps in, or out. After the session's end, or once the link
    /// has released the hand, it is not engaged again.
    pub fn hold(&mut self, engaged: bool) {
        if !engaged {
            self.limiter.release();
        } else if !self.ended && self.link != LinkState::Released {
            self.limiter.engage();
        }
    }

    /// Whether there is to be no force on the hand from the next tick on: it falls as fast as the device's limits allow.
    /// Afterwards the hand has to be engaged anew.
    pub fn stop(&mut self, stopped: bool) {
        self.stopped = stopped;
        if stopped {
            self.limiter.release();
        }
    }

    /// Applies an accepted update, unless the hand has been released; returns whether it did.
    pub fn apply(&mut self, update: &Update) -> bool {
        let alive = self.link < LinkState::Released;
        if alive {
            self.model.apply(update);
            if let Some(count) = self.applied.get_mut(update.cause.number()) {
                *count += 1;
            }
        } else {
            self.updates_after_release += 1;
        }
        alive
    }

    /// Takes in the tool's state that arrived at `now`, no older than the one before. Only with TDPA it changes anything.
    pub fn handle_tool_state(&mut self, now: Time, tool: &Tool) {
        if let Some(tdpa) = &mut self.tdpa {
            tdpa.receive(now, tool);
        }
    }

    /// One sample period. `stamp` is the tick's time, `reading` the device's HIP (m, world), `silence`
    /// for how long one of the two ways has been silent.
    pub fn tick(&mut self, stamp: Time, reading: Vec2, silence: Duration) -> MasterTick {
        if reading.x.is_finite() && reading.y.is_finite() {
            self.reading = reading;
        } else {
            self.bad_readings += 1;
        }
        let offset = self.offset;
        let counts = HipCounts::nearest(self.reading + offset);
        // A released hand stays released: it takes a new session to feel again.
        self.link = self.link_after(silence);
        if self.link == LinkState::Released {
            self.limiter.release();
        }
        let hip = counts.metres();
        let rendered = self.model.step(stamp, hip);
        self.carry(hip);
        if self.model.not_finite() > 0 {
            self.release();
        }
        let displayed = match &mut self.tdpa {
            Some(tdpa) => tdpa.step(hip),
            None => rendered.force,
        };
        let force = ForceCounts::nearest(displayed);
        let sample = HipSample {
            stamp,
            hip: counts,
            force,
        };
        let wanted = if self.stopped {
            Vec2::zeros()
        } else {
            -displayed
        };
        let hand_force = self.limiter.limit(wanted);
        if let Some(tdpa) = &mut self.tdpa {
            tdpa.displayed(hand_force);
        }
        self.port.push(hip - offset, hand_force);
        MasterTick {
            sample,
            port: self.tdpa.as_ref().map(TdpaHand::port),
            rendered,
            displayed,
            hand_force,
            link: self.link,
        }
    }

    /// Moves the HIP of the next tick against the device: with the box that is carried back, and later, clear of the box,
    /// towards the device again. A hand that feels the tool is not moved.
    fn carry(&mut self, hip: Vec2) {
        if self.tdpa.is_some() {
            return;
        }
        self.offset += self.model.carry();
        let away = self.offset.norm();
        if away > 0.0 && self.model.clearance(hip) > CLEAR_M {
            self.offset *= (1.0 - RETURN_M_PER_S * TICK_S / away).max(0.0);
        }
    }

    fn link_after(&self, silence: Duration) -> LinkState {
        if self.link == LinkState::Released {
            LinkState::Released
        } else {
            LinkState::of_silence(silence)
        }
    }
}

#[cfg(test)]
mod tests;
