//! The slave's half of a session, from what its end counted and measured.

use mmt_shared::report::{
    ArchitectureReport, EstimateReport, ModelReport, SentUpdates, SessionStats, SlaveHalf,
    ToolReport,
};
use mmt_shared::time::TICK_S;
use mmt_shared::wire::Side;

use super::SlaveEnd;
use crate::slave::Slave;

impl SlaveEnd {
    /// What it counted and measured in the `duration_s` (s) since it began. Each update that a tick made is sent,
    /// superseded or unsent; one that still waits is unsent.
    #[must_use]
    pub fn half(&self, duration_s: f64) -> SlaveHalf {
        let (slave, counts) = (&self.slave, &self.counts);
        let repeats = counts.repeated.total();
        let mut session = SessionStats::new(Side::Slave, &self.channel, repeats, duration_s);
        session.architecture = ArchitectureReport::new(self.config.architecture, None);
        let waiting = u64::from(self.update.is_some());
        session.add_drops([
            ("messages_overtaken", counts.messages_overtaken),
            ("samples_disengaged", counts.samples_disengaged),
            ("updates_superseded", counts.updates_superseded),
            ("updates_unsent", counts.updates_unsent + waiting),
            (
                "acknowledgements_implausible",
                counts.acknowledgements_implausible,
            ),
        ]);
        session.add_drops(drops(slave));
        SlaveHalf {
            session,
            updates: SentUpdates::new(&counts.updates, &counts.repeated),
            force: slave.force().summary(),
            true_force: slave.true_force(),
            model: model(slave),
            tool: tool(slave),
            playout_delay_ms: slave.playout().delays().into(),
        }
    }
}

fn tool(slave: &Slave) -> ToolReport {
    let (force, energy) = (slave.tool_force(), slave.tool_energy());
    let seconds = |ticks: u64| (ticks as f64 * TICK_S).into();
    ToolReport {
        held_s: seconds(force.held_ticks()),
        force_peak_n: force.peak_n().into(),
        work_j: energy.tool_j().into(),
        hand_work_j: energy.hand_j().into(),
        energy_held_s: seconds(energy.held_ticks()),
        sensor_gain: slave.sensor_gain().into(),
    }
}

fn drops(slave: &Slave) -> [(&'static str, u64); 12] {
    let playout = slave.playout().counts();
    [
        ("samples_late", playout.late),
        ("samples_duplicate", playout.duplicate),
        ("samples_overflow", playout.overflow),
        ("samples_implausible", playout.implausible),
        ("updates_unacknowledged", slave.shadow().unacknowledged()),
        ("images_dropped", slave.images_dropped()),
        ("images_too_old", slave.images_too_old()),
        ("estimates_refused", slave.refused_estimates()),
        ("states_clamped", slave.clamped_states()),
        ("wrenches_refused", slave.environment().refused()),
        ("forces_not_finite", slave.force().rejected()),
        ("model_not_finite", slave.shadow().ahead().not_finite()),
    ]
}

/// m, b, c: absent as long as the estimator has seen nothing that counts.
fn model(slave: &Slave) -> ModelReport {
    let (estimate, truth) = (slave.estimate(), slave.environment().truth());
    let known = !slave.is_linked();
    let [m, b, c, ..] = truth.to_array().map(|number| known.then_some(number));
    let seen = |estimated: f64| (estimate.samples > 0).then_some(estimated);
    ModelReport {
        mass_kg: EstimateReport::new(seen(estimate.m), m),
        damping_ns_per_m: EstimateReport::new(seen(estimate.b), b),
        friction_n: EstimateReport::new(seen(estimate.c), c),
    }
}
