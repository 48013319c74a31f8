//! When the slave sends an update: (12), the timer, and the contact mismatches of III-A.
//!
//! Pure, and only of what it is given. Rules that the paper leaves open: (12) is evaluated while both
//! sides are in contact, with the force divided by no less than a floor; a contact that only one side has
//! counts after a debounce and is sent again at intervals, not at every sample, and ever more rarely while the HIP stands.
//! The end of a contact, which III-A does not name, is sent once, and only if that is asked for. Every update, whatever its
//! cause, resets the timer.

mod config;
mod contact;
mod input;
mod judged;
mod metric;
mod scheme;

pub use config::TriggerConfig;
pub use contact::{ContactConfig, ContactDetector};
pub use input::TriggerInput;
pub use metric::MismatchMetric;
pub use scheme::{Scheme, SchemeError};

use std::time::Duration;

use judged::Judged;

use mmt_shared::model::params::ModelParams;
use mmt_shared::model::update::Cause;
use mmt_shared::time::{TICK_S, Time};

/// The shortest time between two updates of the scheme `useful`.
const USEFUL_GAP: Duration = Duration::from_millis(10);
/// A predicted force change above this share of the force is felt (`useful`).
const USEFUL_SHARE: f64 = 0.01;
/// The force that the share is taken of is at least this, N (`useful`).
const USEFUL_FLOOR_N: f64 = 0.3;
/// A change of the face's direction above this is felt, rad (`useful`).
const USEFUL_TURN_RAD: f64 = 0.010;
/// An object that is farther than this from where the model has it is seen there, m, though along the face no force shows it
/// (`useful`).
const USEFUL_SHIFT_M: f64 = 0.020;

/// An error of fewer standard deviations of the force per axis may be noise.
const NOISE_DEVIATIONS: f64 = 4.5;

/// A change of fewer standard deviations of the predicted force may be the estimate's own error: the rows of the estimator
/// share a filter, so that the deviation is too small by a factor of five.
const ESTIMATE_DEVIATIONS: f64 = 10.0;
/// The same where (12) shows that the force is wrong, with a quiet and with a noisy sensor: it need not be all that is wrong.
const WRONG_DEVIATIONS: (f64, f64) = (2.0, 5.0);
/// A turn of fewer standard deviations of the angle may be the error of that.
const TURN_DEVIATIONS: f64 = 3.0;

/// A place that is off by fewer standard deviations may be the noise of the images.
const PLACE_DEVIATIONS: f64 = 3.0;

/// A model that was sent more than this share of c, and this much more, N, is held by what is no friction.
const HELD: (f64, f64) = (2.0, 0.3);

/// A contact mismatch that lasts while the HIP stands is sent again ever more rarely, up to this: nobody feels it.
const REPEAT_MAX: Duration = Duration::from_secs(1);

/// Only one side is in contact.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Mismatch {
    cause: Cause,
    since: Time,
    sent: Option<Time>,
    /// From one update to the next.
    repeat: Duration,
}

/// Decides, sample by sample.
#[derive(Clone, Debug)]
pub struct Trigger {
    config: TriggerConfig,
    /// The configured scheme, stretched.
    scheme: Scheme,
    /// When the last update went out, and its parameters.
    last: Option<(Time, ModelParams)>,
    began: Option<Time>,
    was_in_contact: bool,
    mismatch: Option<Mismatch>,
    /// The error that the last update left, summed over contact: relative force error times s.
    accumulated_error: f64,
    /// Cause of the last update, if that was lost.
    repeat: Option<Cause>,
    /// What (12) is judged by.
    recent: Judged,
}

impl Trigger {
    /// A trigger that has sent nothing.
    #[must_use]
    pub fn new(config: TriggerConfig) -> Self {
        Self {
            scheme: config.scheme,
            recent: Judged::over(config.judged_over),
            config,
            last: None,
            began: None,
            was_in_contact: false,
            mismatch: None,
            accumulated_error: 0.0,
            repeat: None,
        }
    }

    /// The last update, which had this cause, did not arrive: a new one is sent instead, at once and under every scheme.
    pub fn repeat(&mut self, cause: Cause) {
        self.repeat = Some(cause);
    }

    /// From now on thresholds and times of the scheme are `by` as large as configured; 1: as configured.
    pub fn stretch(&mut self, by: f64) {
        self.scheme = self.config.scheme.stretched(by);
    }

    /// The scheme as it is now.
    #[must_use]
    pub fn scheme_now(&self) -> Scheme {
        self.scheme
    }

    /// Whether an update is to be sent now, and why. An answer counts as sent.
    pub fn step(&mut self, now: Time, input: &TriggerInput) -> Option<Cause> {
        self.decide(now, input, |own| own.due(now, input))
    }

    /// The same under a scheme of somebody else's, whose answer to this input is `asked`. A contact that only one side has, or,
    /// where that is sent, that has ended, and what was lost are sent as under every scheme, and come before it.
    pub fn step_by(
        &mut self,
        now: Time,
        input: &TriggerInput,
        asked: Option<Cause>,
    ) -> Option<Cause> {
        self.decide(now, input, |_| asked)
    }

    fn decide(
        &mut self,
        now: Time,
        input: &TriggerInput,
        scheme: impl FnOnce(&mut Self) -> Option<Cause>,
    ) -> Option<Cause> {
        self.began.get_or_insert(now);
        if input.both_in_contact() {
            self.recent.push([input.f_s, input.f_m]);
            self.accumulated_error += self.expected_correction(input) * TICK_S;
        }
        let cause = self
            .geometry(now, input)
            .or_else(|| scheme(self))
            .or_else(|| self.elsewhere(now, input))
            .or(self.repeat);
        if cause.is_some() {
            self.last = Some((now, input.params));
            self.accumulated_error = 0.0;
            self.repeat = None;
            self.recent.begin();
        }
        cause
    }

    /// Contact that only one side has (III-A cases 1 and 2), and where it is sent, contact that has ended.
    fn geometry(&mut self, now: Time, input: &TriggerInput) -> Option<Cause> {
        let lost = self.config.contact_lost && self.was_in_contact && !input.slave_in_contact;
        self.was_in_contact = input.slave_in_contact;
        let cause = match (input.shadow_in_contact, input.slave_in_contact) {
            (true, false) => Some(Cause::MasterOnlyContact),
            (false, true) => Some(Cause::SlaveOnlyContact),
            _ => None,
        };
        let Some(cause) = cause else {
            self.mismatch = None;
            return lost.then_some(Cause::ContactLost);
        };
        let fresh = Mismatch {
            cause,
            since: now,
            sent: None,
            repeat: self.config.mismatch_repeat,
        };
        let old = self.mismatch.filter(|old| old.cause == cause);
        let mut mismatch = old.unwrap_or(fresh);
        if !input.hip_stands {
            mismatch.repeat = fresh.repeat;
        }
        let due = match mismatch.sent {
            None => now >= mismatch.since + self.config.mismatch_debounce,
            Some(sent) => now >= sent + mismatch.repeat,
        };
        if due {
            if mismatch.sent.is_some() {
                mismatch.repeat = (mismatch.repeat * 2).min(REPEAT_MAX.max(fresh.repeat));
            }
            mismatch.sent = Some(now);
        }
        self.mismatch = Some(mismatch);
        if due {
            Some(cause)
        } else {
            lost.then_some(Cause::ContactLost)
        }
    }

    /// An object that nobody touches and that is not where the model has it, or that the model has held where nothing but friction
    /// holds it: the hand would meet it elsewhere, or push against nothing.
    fn elsewhere(&self, now: Time, input: &TriggerInput) -> Option<Cause> {
        let least = self.config.free_space_error_m;
        let free = !input.slave_in_contact && !input.shadow_in_contact;
        let rested = (self.last).is_none_or(|(last, _)| now >= last + self.config.mismatch_repeat);
        let off = input.shift.norm() > least.max(PLACE_DEVIATIONS * input.shift_deviation);
        let wrong = off || self.is_held_in_vain(input);
        (least > 0.0 && free && rested && wrong).then_some(Cause::Elsewhere)
    }

    /// Whether the model has what an obstacle needed for friction, and the tool no more pushes the object against that.
    fn is_held_in_vain(&self, input: &TriggerInput) -> bool {
        let (share, more) = HELD;
        let needs = share * input.params.c() + more;
        let is_held = self.last.is_some_and(|(_, sent)| sent.c() > needs);
        input.only_friction_holds && is_held
    }

    fn due(&self, now: Time, input: &TriggerInput) -> Option<Cause> {
        match self.scheme {
            Scheme::Deadband { delta } => self.violated(input, delta),
            Scheme::Hybrid { delta, t_update } => {
                let running = self.config.timer_in_free_space || input.both_in_contact();
                self.violated(input, delta)
                    .or_else(|| self.timed(now, t_update).filter(|_| running))
            }
            Scheme::Timer { t_update } => self.timed(now, t_update),
            Scheme::EverySample => Some(Cause::EverySample),
            Scheme::Dis {
                threshold_n,
                heartbeat,
            } => {
                let beyond = self.judged(input) && input.force_error() > threshold_n;
                beyond
                    .then_some(Cause::Deadband)
                    .or_else(|| self.timed(now, heartbeat))
            }
            Scheme::Adaptive { delta, horizon } => {
                let due = self.accumulated_error > delta * horizon.as_secs_f64();
                self.felt(now, input, delta, due.then_some(Cause::Timer))
            }
            Scheme::Useful { delta, t_update } => {
                let timed = self.timed(now, t_update);
                self.felt(now, input, delta, timed.filter(|_| input.both_in_contact()))
            }
        }
    }

    /// (12), or what is `timed`, if the hand would feel what an update corrects.
    fn felt(
        &self,
        now: Time,
        input: &TriggerInput,
        delta: f64,
        timed: Option<Cause>,
    ) -> Option<Cause> {
        let (quiet, noisy) = WRONG_DEVIATIONS;
        let wrong = if input.noise_n > 0.0 { noisy } else { quiet };
        let felt = |deviations| self.is_perceptible(now, input, delta, deviations);
        self.violated(input, delta)
            .filter(|_| felt(wrong))
            .or_else(|| timed.filter(|_| felt(ESTIMATE_DEVIATIONS)))
    }

    /// Whether the forces can be compared at all.
    fn judged(&self, input: &TriggerInput) -> bool {
        input.both_in_contact() && (self.config.judge_sticking || !input.sticking)
    }

    /// (12), multiplied out, and more than the noise of the force.
    fn is_beyond(&self, input: &TriggerInput, delta: f64) -> bool {
        let Some([f_s, f_m]) = self.recent.forces([input.f_s, input.f_m]) else {
            return false;
        };
        let felt = delta * f_s.norm().max(self.config.force_floor_n);
        (f_s - f_m).norm() > felt.max(NOISE_DEVIATIONS * input.noise_n)
    }

    fn violated(&self, input: &TriggerInput, delta: f64) -> Option<Cause> {
        let beyond = match self.config.metric {
            MismatchMetric::Force => self.judged(input) && self.is_beyond(input, delta),
            MismatchMetric::Parameters => self
                .last
                .is_none_or(|(_, sent)| metric::parameters(&input.params, &sent) > delta),
            MismatchMetric::Pose => metric::pose(input.shift, input.turn) > delta,
        };
        beyond.then_some(Cause::Deadband)
    }

    /// The paper's second step. Its `Timer > T_update` with its bounds of 20 and 7 packets/s means an
    /// interval of T_update exactly.
    fn timed(&self, now: Time, t_update: Duration) -> Option<Cause> {
        let since = self.last.map(|(time, _)| time).or(self.began)?;
        (now >= since + t_update).then_some(Cause::Timer)
    }

    /// What an update would correct now, as a relative force error: the change of the force beyond the
    /// estimate's own deviation, the turn of its direction, and the error of a face that is held wrongly.
    fn expected_correction(&self, input: &TriggerInput) -> f64 {
        let (Scheme::Adaptive { delta, .. }, Some((_, sent))) = (self.scheme, &self.last) else {
            return 0.0;
        };
        let change = (force_change(input, sent) - input.force_deviation).max(0.0);
        let held = if self.is_held_wrongly(input, delta) {
            input.force_error()
        } else {
            0.0
        };
        (change + held) / input.f_s.norm().max(USEFUL_FLOOR_N) + input.turn.abs()
    }

    /// Whether the hand would feel what an update corrects: by the force that the changed parameters would
    /// give in the present motion if that changes by so many standard `deviations` of it, by the direction of the face, by
    /// its place while the object is held, or by where the object is seen.
    fn is_perceptible(&self, now: Time, input: &TriggerInput, delta: f64, deviations: f64) -> bool {
        let Some((time, sent)) = self.last else {
            return true;
        };
        if now < time + USEFUL_GAP {
            return false;
        }
        let change = force_change(input, &sent);
        let felt_n = (USEFUL_SHARE * input.f_s.norm().max(USEFUL_FLOOR_N))
            .max(deviations * input.force_deviation);
        let felt_rad = USEFUL_TURN_RAD.max(TURN_DEVIATIONS * input.turn_deviation);
        change > felt_n
            || input.turn.abs() > felt_rad
            || input.shift.norm() > USEFUL_SHIFT_M
            || self.is_held_wrongly(input, delta)
    }

    /// What friction holds is pushed back by the depth of the HIP alone: a force that is off by more than Delta
    /// means that the face is not where the model has it.
    fn is_held_wrongly(&self, input: &TriggerInput, delta: f64) -> bool {
        input.sticking && input.both_in_contact() && self.is_beyond(input, delta)
    }
}

/// By how much the force of the present motion differs between the parameters now and those sent, N: at most.
fn force_change(input: &TriggerInput, sent: &ModelParams) -> f64 {
    let (is, was) = (&input.params, sent);
    (is.m() - was.m()).abs() * input.acceleration.abs()
        + ((is.b() - was.b()) * input.speed.abs() + is.c() - was.c()).abs()
}

#[cfg(test)]
mod tests;
