//! The trigger: when the slave sends an update, and why. III-B of the paper and model notes, section 5.
//!
//! Compares the measured force with that of the shadow, the model that the master has. It is pure: time
//! comes in as an argument. Whatever `decide` returns counts as sent, so nothing may be dropped after it.
//!
//! Rules that the paper leaves open:
//! - (12) is evaluated only while both sides are in contact; its denominator is at least `f_floor_n`.
//! - One side alone in contact for `mismatch_debounce` sends geometry (III-A, cases 1 and 2), and again
//!   every `geometry_repeat` while it lasts. The slave's loss of contact sends at once. All schemes do so.
//! - T_update has passed when `now − last update ≥ T_update`: the interval is T_update itself, as the
//!   paper's lower bounds (1000/50 ms = 20 packets/s) say. Counted as printed, with `Timer > T_update`
//!   and an increment in each of the two steps, it would be 26 samples for T_update = 50.

use std::time::Duration;

use mmt_shared::geometry::{Pose, Vec2};
use mmt_shared::params::ModelParams;
use mmt_shared::settings::Mode;
use mmt_shared::time::Time;
use mmt_shared::wire::message::Cause;
use serde::{Deserialize, Serialize};

pub mod contact;
pub mod mismatch;
pub mod scheme;
#[cfg(test)]
mod tests;

pub use contact::{ContactDetector, ContactThresholds};
pub use mismatch::Metric;
pub use scheme::{Scheme, SchemeError};

/// When an update of the scheme `useful` is useful.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Usefulness {
    /// Least time since the last update. 10 ms: a hand does not feel the difference.
    pub interval: Duration,
    /// The force must change by more than this share of the measured force. 0.01: a seventh of the just
    /// noticeable difference.
    pub force_share: f64,
    /// Least measured force for that share, N.
    pub force_floor_n: f64,
    /// Or the orientation by more than this, rad.
    pub turn_rad: f64,
}

impl Default for Usefulness {
    fn default() -> Self {
        Self {
            interval: Duration::from_millis(10),
            force_share: 0.01,
            force_floor_n: 0.3,
            turn_rad: 0.010,
        }
    }
}

/// Settings of [`Trigger`], and of the contact detector in front of it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TriggerConfig {
    /// The scheme.
    pub scheme: Scheme,
    /// What its Delta bounds; `dis` always bounds the force error.
    pub metric: Metric,
    /// Least denominator of (12), N.
    pub f_floor_n: f64,
    /// Whether a sticking object can violate (12); if not, it is held by static friction and any force
    /// below c is right.
    pub sticking_counts: bool,
    /// How long one side alone must be in contact. 10 ms: longer than the jitter of one packet.
    pub mismatch_debounce: Duration,
    /// How often geometry is sent again while one side alone stays in contact. 50 ms: the master needs
    /// some time to let go.
    pub geometry_repeat: Duration,
    /// For the scheme `useful`.
    pub usefulness: Usefulness,
    /// When the slave's tool touches; the trigger gets the result.
    pub contact: ContactThresholds,
}

impl TriggerConfig {
    /// The defaults of a mode with a scheme. The floor of (12) is the least perceivable force, 0.04 N
    /// (IV-B), or 0.3 N, where 10 % is three times the force noise.
    #[must_use]
    pub fn of_mode(mode: Mode, scheme: Scheme) -> Self {
        let paper = mode == Mode::Paper;
        Self {
            scheme,
            metric: Metric::Force,
            f_floor_n: if paper { 0.04 } else { 0.3 },
            sticking_counts: paper,
            mismatch_debounce: Duration::from_millis(10),
            geometry_repeat: Duration::from_millis(50),
            usefulness: Usefulness::default(),
            contact: ContactThresholds::default(),
        }
    }
}

/// What the trigger looks at in one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriggerInput {
    /// f_s: the raw measured force on the object, world frame, N.
    pub f_s: Vec2,
    /// f_m: the force that the shadow renders for the same HIP sample, world frame, N.
    pub f_m: Vec2,
    /// Whether the slave's tool touches the object.
    pub slave_in_contact: bool,
    /// Whether the shadow's HIP touches the shadow's object.
    pub shadow_in_contact: bool,
    /// Whether static friction holds the object.
    pub sticking: bool,
    /// Speed v·n of the touched surface, m/s.
    pub speed: f64,
    /// Acceleration a·n of the touched surface, m/s².
    pub acceleration: f64,
    /// The parameters that an update would carry.
    pub candidate: ModelParams,
    /// The parameters that the last update carried.
    pub sent: ModelParams,
    /// The object's pose that an update would carry.
    pub object: Pose,
    /// The pose that the master's model has without an update: the shadow's.
    pub model: Pose,
}

/// Decides, tick by tick, whether an update is sent.
#[derive(Clone, Copy, Debug)]
pub struct Trigger {
    config: TriggerConfig,
    /// Start of the timer: the last update, or the first tick.
    last: Option<Time>,
    /// Start of the present contact of the slave, the first tick included.
    touching_since: Option<Time>,
    apart_since: Option<Time>,
    geometry_sent: Option<Time>,
}

impl Trigger {
    /// A trigger that has sent nothing; its timer starts at the first tick.
    #[must_use]
    pub fn new(config: TriggerConfig) -> Self {
        Self {
            config,
            last: None,
            touching_since: None,
            apart_since: None,
            geometry_sent: None,
        }
    }

    /// Looks at one tick and says whether an update is sent, and why.
    ///
    /// The first cause that holds wins: every sample, lost contact, contact mismatch, violation, timer.
    pub fn decide(&mut self, now: Time, input: &TriggerInput) -> Option<Cause> {
        let lost = self.touching_since.is_some() && !input.slave_in_contact;
        self.follow_contact(now, input);
        let last = *self.last.get_or_insert(now);
        let cause = if self.config.scheme == Scheme::EverySample {
            Some(Cause::EverySample)
        } else if lost {
            Some(Cause::ContactLost)
        } else {
            self.geometry(now, input)
                .or_else(|| self.scheduled(now, last, input))
        };
        if cause.is_some() {
            self.last = Some(now);
        }
        cause
    }

    fn follow_contact(&mut self, now: Time, input: &TriggerInput) {
        self.touching_since = input
            .slave_in_contact
            .then(|| self.touching_since.unwrap_or(now));
        let apart = input.slave_in_contact != input.shadow_in_contact;
        self.apart_since = apart.then(|| self.apart_since.unwrap_or(now));
        if !apart {
            self.geometry_sent = None;
        }
    }

    /// III-A, cases 1 and 2.
    fn geometry(&mut self, now: Time, input: &TriggerInput) -> Option<Cause> {
        let config = &self.config;
        let ripe = now.saturating_since(self.apart_since?) >= config.mismatch_debounce;
        let repeated = self
            .geometry_sent
            .is_none_or(|sent| now.saturating_since(sent) >= config.geometry_repeat);
        if !(ripe && repeated) {
            return None;
        }
        self.geometry_sent = Some(now);
        Some(if input.slave_in_contact {
            Cause::SlaveOnlyContact
        } else {
            Cause::MasterOnlyContact
        })
    }

    fn scheduled(&self, now: Time, last: Time, input: &TriggerInput) -> Option<Cause> {
        let passed = |time: Duration| now.saturating_since(last) >= time;
        let pick = |violated: bool, timer: bool| {
            let timer = timer.then_some(Cause::Timer);
            if violated {
                Some(Cause::Deadband)
            } else {
                timer
            }
        };
        match self.config.scheme {
            Scheme::Deadband { delta } => pick(self.violates(input, delta), false),
            Scheme::Hybrid { delta, t_update } => {
                pick(self.violates(input, delta), passed(t_update))
            }
            Scheme::Timer { t_update } => pick(false, passed(t_update)),
            Scheme::EverySample => Some(Cause::EverySample),
            Scheme::Dis {
                threshold_n,
                heartbeat,
            } => {
                let off = (input.f_s - input.f_m).norm() > threshold_n;
                pick(off && self.comparable(input), passed(heartbeat))
            }
            Scheme::Useful { delta, t_update } => {
                let in_contact = self
                    .touching_since
                    .is_some_and(|since| now.saturating_since(since.max(last)) >= t_update);
                let cause = pick(self.violates(input, delta), in_contact);
                cause.filter(|_| passed(self.config.usefulness.interval) && self.useful(input))
            }
        }
    }

    /// Whether the two forces may be compared.
    fn comparable(&self, input: &TriggerInput) -> bool {
        let both = input.slave_in_contact && input.shadow_in_contact;
        both && (self.config.sticking_counts || !input.sticking)
    }

    fn violates(&self, input: &TriggerInput, delta: f64) -> bool {
        let mismatch = || self.config.metric.mismatch(input, self.config.f_floor_n);
        self.comparable(input) && mismatch() > delta
    }

    fn useful(&self, input: &TriggerInput) -> bool {
        let rule = &self.config.usefulness;
        let force = input.f_s.norm().max(rule.force_floor_n);
        mismatch::force_change(input) > rule.force_share * force
            || mismatch::turned(input) > rule.turn_rad
    }
}
