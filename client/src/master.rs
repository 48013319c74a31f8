//! The master's core: one haptic tick around the local model.
//!
//! HIP in, force out, a sample for the slave. It must never wait, allocate, log or read a clock, and
//! force leaves it through the limiter only.

use std::time::Duration;

use mmt_shared::geometry::Vec2;
use mmt_shared::local_model::{LocalModel, Rendered};
use mmt_shared::time::Time;
use mmt_shared::wire::{ForceCounts, HipCounts, HipSample, Update, Welcome};

use crate::failsafe::LinkState;
use crate::limiter::ForceLimiter;
use crate::operator::scripted::View;

/// What one haptic tick gave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MasterTick {
    /// Goes to the slave: the HIP and the force that the model rendered for it.
    pub sample: HipSample,
    /// What the model did.
    pub rendered: Rendered,
    /// Goes to the device: force on the hand, N, world, limited.
    pub hand_force: Vec2,
    /// The link as this tick saw it.
    pub link: LinkState,
}

/// The master between the device and the link.
#[derive(Clone, Debug)]
pub struct Master {
    model: LocalModel,
    limiter: ForceLimiter,
    link: LinkState,
    hip: HipCounts,
    bad_readings: u64,
    applied: u32,
    frozen: u32,
}

impl Master {
    /// A master that renders what the slave's welcome says, its force limited by `limiter`.
    #[must_use]
    pub fn new(welcome: &Welcome, mut limiter: ForceLimiter) -> Self {
        limiter.engage();
        Self {
            model: LocalModel::new(welcome.settings, welcome.state),
            limiter,
            link: LinkState::Fresh,
            hip: HipCounts::default(),
            bad_readings: 0,
            applied: 0,
            frozen: 0,
        }
    }

    /// The model that is felt.
    #[must_use]
    pub fn model(&self) -> &LocalModel {
        &self.model
    }

    /// The force limiter.
    #[must_use]
    pub fn limiter(&self) -> &ForceLimiter {
        &self.limiter
    }

    /// Device readings that were not finite and were replaced by the one before.
    #[must_use]
    pub fn bad_readings(&self) -> u64 {
        self.bad_readings
    }

    /// Updates that reached the model.
    #[must_use]
    pub fn applied(&self) -> u32 {
        self.applied
    }

    /// Updates that came after the hand had been released and were not applied.
    #[must_use]
    pub fn frozen(&self) -> u32 {
        self.frozen
    }

    /// What the operator sees: the local model, which is where it is felt.
    #[must_use]
    pub fn view(&self) -> View {
        let state = self.model.state();
        View {
            pose: state.pose,
            footprint: state.footprint,
            in_contact: self.model.rendered().in_contact(),
        }
    }

    /// Begins to ramp the force out: the session ends.
    pub fn release(&mut self) {
        self.limiter.release();
    }

    /// Takes in an accepted update, unless the link has been taken for dead.
    pub fn apply(&mut self, update: &Update) {
        if self.link < LinkState::Released {
            self.model.apply(update);
            self.applied = self.applied.saturating_add(1);
        } else {
            self.frozen = self.frozen.saturating_add(1);
        }
    }

    /// One sample period. `stamp` is the tick's time, `reading` the device's HIP (m, world), `silence`
    /// the time since anything was heard of the slave.
    pub fn tick(&mut self, stamp: Time, reading: Vec2, silence: Duration) -> MasterTick {
        if reading.x.is_finite() && reading.y.is_finite() {
            self.hip = HipCounts::nearest(reading);
        } else {
            self.bad_readings += 1;
        }
        // A released hand stays released: it takes a new session to feel again.
        self.link = self.link_after(silence);
        if self.link == LinkState::Released {
            self.limiter.release();
        }
        let rendered = self.model.step(stamp, self.hip.metres());
        let force = ForceCounts::nearest(rendered.force);
        let sample = HipSample {
            stamp,
            hip: self.hip,
            force,
        };
        let hand_force = self.limiter.limit(-rendered.force);
        MasterTick {
            sample,
            rendered,
            hand_force,
            link: self.link,
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
