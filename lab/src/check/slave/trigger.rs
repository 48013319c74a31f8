//! When an update leaves: by (12) and by the timer, as far as the numbers of a tick show it.
//!
//! Each direction is judged where it follows from the contract alone. An update of cause `deadband` needs (12), one
//! of cause `timer` needs T_update. Under the schemes that ask for nothing more, (12) and T_update need an update.
//! Not judged: where the force is averaged because its sensor is noisy or by `judged_over`; other metrics and
//! references than the paper's; what `useful` and `adaptive` leave out as not felt; and (12) in a tick in which the
//! model pushes harder than the tool, whose limit may hold it back then.

use std::mem::replace;
use std::time::Duration;

use mmt_server::shadow::TriggerReference;
use mmt_server::slave::SlaveTick;
use mmt_server::trigger::{MismatchMetric, Scheme};
use mmt_shared::model::geometry::Vec2;
use mmt_shared::model::update::Cause;
use mmt_shared::time::Time;

use super::{ROUNDING_N, SlaveChecks, SlaveTicked};
use crate::check::Invariant;

impl SlaveChecks {
    /// From now on somebody else's scheme decides.
    pub(crate) fn other_scheme(&mut self) {
        self.is_own_scheme = false;
    }

    pub(super) fn judge_trigger(&mut self, tick: &SlaveTicked<'_>, done: &SlaveTick) {
        let (now, slave) = (tick.now, tick.end.slave());
        // what is given up as lost is sent again in the same tick, whatever the scheme
        let given_up = slave.shadow().newest_given_up();
        let repeats = replace(&mut self.given_up, given_up) != given_up;
        let since = now.saturating_since(*self.updated.get_or_insert(now));
        let cause = done.update.map(|update| update.cause);
        if cause.is_some() {
            self.updated = Some(now);
        }
        if !self.is_own_scheme {
            return;
        }
        let scheme = slave.scheme_now();
        let excess = self
            .excess(scheme, done)
            .filter(|_| slave.force_noise_n() == 0.0);
        let held = slave.estimate().sticking && !self.about.config.trigger.judge_sticking;
        let holds = match cause {
            _ if repeats => return,
            Some(Cause::Deadband) => excess.is_none_or(|excess| excess > -ROUNDING_N),
            Some(Cause::Timer) => self.may_be_timed(scheme, since, done.in_contact),
            Some(Cause::EverySample) => scheme == Scheme::EverySample,
            Some(_) => true,
            None => {
                !self.must_be_timed(scheme, since) && (held || !must_be_sent(scheme, excess, done))
            }
        };
        self.verdict.judge(Invariant::TriggerFires, now, holds, || {
            format!(
                "{cause:?} under {scheme:?}, {since:?} after the update before; f_s {:?} N, the shadow {:?} N, contact {}",
                done.f_s, done.f_shadow, done.in_contact
            )
        });
    }

    pub(super) fn judge_update(&mut self, now: Time, done: &SlaveTick) {
        let Some(update) = done.update else {
            return;
        };
        let touches = done.in_contact;
        // what was lost is sent again, whatever is touched by now
        let again = self
            .unconfirmed
            .iter()
            .any(|(.., cause)| *cause == update.cause);
        // a touch of another body shows the master that body, also after the touch
        let lone = self.about.config.scene.bodies.len() < 2;
        let metric = self.about.config.trigger.metric;
        let fits = !lone
            || match update.cause {
                Cause::MasterOnlyContact | Cause::ContactLost | Cause::Elsewhere => !touches,
                Cause::SlaveOnlyContact => touches,
                // parameters and pose can differ in free space
                Cause::Deadband => touches || metric != MismatchMetric::Force,
                Cause::Timer | Cause::EverySample => true,
            };
        let holds =
            (fits || again) && update.slave_in_contact() == touches && update.answers == done.stamp;
        self.verdict.judge(Invariant::UpdateCause, now, holds, || {
            format!(
                "{:?} with contact {touches} at {:?}, answering {:?}",
                update.cause, done.stamp, update.answers
            )
        });
        self.updates += 1;
        self.made = Some(update);
        self.unconfirmed
            .push((update.sequence, self.lived, update.cause));
    }

    /// (12): by how much the error of the force is beyond what the scheme allows, N; none where that is not the rule.
    fn excess(&self, scheme: Scheme, done: &SlaveTick) -> Option<f64> {
        let config = &self.about.config;
        let floor = config.trigger.force_floor_n;
        let allowed = match scheme {
            Scheme::Deadband { delta }
            | Scheme::Hybrid { delta, .. }
            | Scheme::Useful { delta, .. }
            | Scheme::Adaptive { delta, .. } => delta * done.f_s.norm().max(floor),
            Scheme::Dis { threshold_n, .. } => threshold_n,
            Scheme::Timer { .. } | Scheme::EverySample => f64::INFINITY,
        };
        let is_rule = config.trigger.metric == MismatchMetric::Force
            && config.trigger_reference == TriggerReference::Shadow
            && config.trigger.judged_over.is_zero();
        // (12)
        is_rule.then_some((done.f_s - done.f_shadow).norm() - allowed)
    }

    fn may_be_timed(&self, scheme: Scheme, since: Duration, touches: bool) -> bool {
        match scheme {
            Scheme::Adaptive { .. } => true,
            Scheme::Useful { t_update, .. } => since >= t_update && touches,
            _ => period(scheme).is_some_and(|period| since >= period),
        }
    }

    /// Whether T_update has passed and nothing more is asked for.
    fn must_be_timed(&self, scheme: Scheme, since: Duration) -> bool {
        let everywhere = self.about.config.trigger.timer_in_free_space;
        match scheme {
            Scheme::Hybrid { t_update, .. } => everywhere && since >= t_update,
            Scheme::EverySample => true,
            _ => period(scheme).is_some_and(|period| since >= period),
        }
    }
}

/// The time after which a scheme sends in any case.
fn period(scheme: Scheme) -> Option<Duration> {
    match scheme {
        Scheme::Hybrid { t_update, .. } | Scheme::Timer { t_update } => Some(t_update),
        Scheme::Dis { heartbeat, .. } => Some(heartbeat),
        Scheme::Deadband { .. }
        | Scheme::EverySample
        | Scheme::Useful { .. }
        | Scheme::Adaptive { .. } => None,
    }
}

/// Whether (12) alone asks for an update: tool and model touch, and the model pushes no harder than the tool.
fn must_be_sent(scheme: Scheme, excess: Option<f64>, done: &SlaveTick) -> bool {
    let alone = matches!(
        scheme,
        Scheme::Deadband { .. } | Scheme::Hybrid { .. } | Scheme::Dis { .. }
    );
    let (f_s, f_m) = (done.f_s, done.f_shadow);
    let touch = done.in_contact && f_m != Vec2::zeros();
    let harder = f_m.dot(&f_s) >= f_s.norm_squared();
    alone && touch && !harder && excess.is_some_and(|excess| excess > ROUNDING_N)
}
