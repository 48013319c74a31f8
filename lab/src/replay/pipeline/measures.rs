//! How far a rendered force is from the recorded one, and what that cost.

use mmt_shared::model::geometry::Vec2;
use mmt_shared::stats::values::{mean, median};
use mmt_shared::time::TICK_S;
use serde::Serialize;

use super::course::Course;
use crate::replay::config::ReplayConfig;
use crate::replay::trigger::Contact;

/// Errors over the milliseconds of contact by the recorded force, onset included; none without contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Errors {
    /// Median of | |f_m| − |f_s| | / |f_s|.
    pub force_median: Option<f64>,
    /// Its mean.
    pub force_mean: Option<f64>,
    /// Median over the pushes of the median within a push.
    pub force_median_of_pushes: Option<f64>,
    /// Median of |f_m − f_s| / |f_s|.
    pub vector_median: Option<f64>,
    /// Its mean.
    pub vector_mean: Option<f64>,
    /// Sum of |f_m − f_s| over that of |f_s|, over all milliseconds: what is felt before and after a contact counts too.
    pub impulse_error: Option<f64>,
}

/// What a run has come to so far.
#[derive(Clone, Debug, Default)]
pub(super) struct Run {
    contact: Contact,
    contact_ticks: u64,
    /// Updates that left the slave.
    pub(super) sent: u64,
    /// The push, the error of |f| and that of f, of each millisecond of contact.
    errors: Vec<(usize, f64, f64)>,
    /// Sums of |f_m − f_s| and of |f_s| over every millisecond, N.
    sums: (f64, f64),
}

impl Run {
    /// Takes a millisecond at `t_s` of the recording, the force that was rendered for it (N), none if that is not known.
    pub(super) fn push(&mut self, course: &Course, t_s: f64, rendered: Option<Vec2>) {
        let f_s = course.force_at(t_s);
        if let Some(f_m) = rendered {
            self.sums.0 += (f_m - f_s).norm();
            self.sums.1 += f_s.norm();
        }
        let touches = self.contact.follow(&ReplayConfig::default(), f_s);
        let push = course.push_at(t_s).filter(|_| touches);
        let Some(push) = push else { return };
        self.contact_ticks += 1;
        if let Some(f_m) = rendered {
            let size = f_s.norm();
            let errors = [f_m.norm() - size, (f_m - f_s).norm()].map(|error| error.abs() / size);
            self.errors.push((push, errors[0], errors[1]));
        }
    }

    pub(super) fn report(
        self,
        system: &'static str,
        scheme: String,
        delay_ms: u64,
    ) -> PipelineReport {
        let contact_s = self.contact_ticks as f64 * TICK_S;
        PipelineReport {
            system,
            scheme,
            delay_ms,
            sent: self.sent,
            contact_s,
            contact_rate_hz: (contact_s > 0.0).then(|| self.sent as f64 / contact_s),
            errors: self.errors(),
        }
    }

    fn errors(&self) -> Errors {
        let force = || self.errors.iter().map(|(_, force, _)| *force);
        let vector = || self.errors.iter().map(|(_, _, vector)| *vector);
        let pushes = self.errors.chunk_by(|a, b| a.0 == b.0);
        let of_push = pushes.filter_map(|push| median(push.iter().map(|(_, force, _)| *force)));
        Errors {
            force_median: median(force()),
            force_mean: mean(force()),
            force_median_of_pushes: median(of_push),
            vector_median: median(vector()),
            vector_mean: mean(vector()),
            impulse_error: (self.sums.1 > 0.0).then(|| self.sums.0 / self.sums.1),
        }
    }
}

/// One scheme over one delay, over all pushes of a recording in their order.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PipelineReport {
    /// `mmt`, or `hold`: the last measured force.
    pub system: &'static str,
    /// When it sends.
    pub scheme: String,
    /// One-way delay, ms.
    pub delay_ms: u64,
    /// Updates that left the slave, of every cause.
    pub sent: u64,
    /// Time in contact by the recorded force, s.
    pub contact_s: f64,
    /// Updates per second of contact; none without contact.
    pub contact_rate_hz: Option<f64>,
    /// Errors of the rendered force.
    #[serde(flatten)]
    pub errors: Errors,
}
