//! How near the master's force is to the measured and to the true one, tick by tick.
//!
//! The true force goes to reports only.

use mmt_shared::metrics::{F_MIN_N, ForceMetrics, ForceSummary};
use mmt_shared::model::geometry::Vec2;
use mmt_shared::report::TrueForce;
use mmt_shared::time::TICK_S;

use crate::contact::Contact;

/// Both comparisons.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ForceErrors {
    /// Against the measured force.
    pub(super) measured: ForceMetrics,
    truth: ForceMetrics,
    /// Ticks in which the true force was above F_min.
    true_contact_ticks: u64,
}

impl ForceErrors {
    /// One tick, with the force that the master rendered for its sample, N, if that is known.
    pub(super) fn push(&mut self, contact: &Contact, f_m: Option<Vec2>) {
        if let Some(f_m) = f_m {
            self.measured.push(contact.force, f_m);
            self.truth.push(contact.true_force, f_m);
        }
        self.true_contact_ticks += u64::from(contact.true_force.norm() > F_MIN_N);
    }

    /// Against the true force.
    pub(super) fn truth(&self) -> TrueForce {
        let ForceSummary {
            pmse,
            relative_error,
            ..
        } = self.truth.summary();
        TrueForce {
            pmse_true: pmse.into(),
            relative_error_true: relative_error.into(),
            contact_true_s: (self.true_contact_ticks as f64 * TICK_S).into(),
        }
    }
}
