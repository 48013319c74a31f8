//! Recorded real pushes, replayed: friction learned push by push, the next force predicted, the trigger
//! run on what was measured.
//!
//! Pure: time is in the recording, the seed in the configuration. A push's own force must never take part
//! in its own prediction. What each number means is in `docs/replay.md`.

mod config;
mod fit;
mod heldout;
mod pipeline;
mod report;
mod surface;
mod trigger;

pub use config::ReplayConfig;
pub use heldout::HeldOut;
pub use mmt_server::contact_prediction::Support;
pub use pipeline::{Errors, PipelineReport, pipeline, table as pipeline_table};
pub use report::{LawOnPush, LawReport, PushReport, Rates, ReplayReport, Spread};
pub use surface::{Law, PushMotion};
pub use trigger::Packets;

use mmt_shared::model::geometry::{Vec2, rotate};
use mmt_shared::recording::{Push, Recording};

use fit::fit;
use heldout::Split;
use mmt_server::contact_prediction::Observation;
use mmt_shared::stats::values::{mean_of_sum, quantile};
use trigger::{Contact, TriggerTraffic};

/// Replays a recording under every law: friction fitted to the pushes so far, the next push's force
/// predicted from its motion before its own force is used, the trigger run on measured against predicted
/// force; then the held-out prediction. `progress` is called with the work done and the whole of it.
pub fn replay(
    recording: &Recording,
    config: &ReplayConfig,
    progress: &mut dyn FnMut(usize, usize),
) -> ReplayReport {
    let whole = recording.pushes.len() + config.repeats as usize;
    let mut learners = Law::ALL.map(|law| Learner::new(law, config));
    let mut observed = Vec::new();
    let mut pushes = Vec::new();
    for (index, push) in recording.pushes.iter().enumerate() {
        progress(index, whole);
        pushes.push(replay_push(
            index,
            push,
            config,
            &mut learners,
            &mut observed,
        ));
    }
    let mut repeats: [Vec<Vec<f64>>; Law::ALL.len()] = Default::default();
    for repeat in 0..config.repeats {
        progress(recording.pushes.len() + repeat as usize, whole);
        let split = Split::draw(config, observed.len(), repeat);
        for (law, errors) in Law::ALL.into_iter().zip(&mut repeats) {
            errors.push(split.errors(config, law, &observed));
        }
    }
    progress(whole, whole);
    let duration_s = pushes.iter().map(|push| push.duration_s).sum();
    let contact_s = pushes.iter().map(|push| push.contact_s).sum();
    let summaries = Law::ALL.into_iter().zip(&repeats);
    ReplayReport {
        duration_s,
        contact_s,
        laws: learners
            .iter()
            .map(|learner| learner.report(&pushes, duration_s, contact_s))
            .collect(),
        held_out: summaries
            .map(|(law, errors)| heldout::summary(law, errors))
            .collect(),
        pushes,
        configuration: *config,
    }
}

fn replay_push(
    index: usize,
    push: &Push,
    config: &ReplayConfig,
    learners: &mut [Learner],
    observed: &mut Vec<Observation<PushMotion>>,
) -> PushReport {
    let motion = PushMotion::of(push);
    let measured = steady_force(config, push);
    let contact_s = contact_time_s(config, push);
    let laws = learners
        .iter_mut()
        .map(|learner| learner.predict(push, &motion, measured, contact_s))
        .collect();
    if let Some(force) = measured {
        let force = rotate(-motion.halfway, force);
        observed.push(Observation { motion, force });
        learners
            .iter_mut()
            .for_each(|learner| learner.learn(observed));
    }
    PushReport {
        index,
        duration_s: push.duration_s(),
        contact_s,
        distance_m: (push.after.position - push.before.position).norm(),
        turn_rad: motion.turn,
        force_times_displacement_nm: push.force_times_displacement(),
        measured_n: measured,
        laws,
    }
}

/// The force that belongs to a push as a whole, world, N: the mean over the samples above half of the
/// force that one sample in ten exceeds. That leaves out the approach, the onset and lost contacts, and
/// does not hang on a peak. None if that force is not a contact.
fn steady_force(config: &ReplayConfig, push: &Push) -> Option<Vec2> {
    let mut sizes: Vec<f64> = push
        .force
        .iter()
        .map(|sample| sample.force.norm())
        .collect();
    sizes.sort_by(f64::total_cmp);
    let high = quantile(&sizes, 0.9)?;
    if high < config.contact_on_n {
        return None;
    }
    let steady = push.force.iter().map(|sample| sample.force);
    let steady = steady.filter(|force| force.norm() >= 0.5 * high);
    let (sum, count) = steady.fold((Vec2::zeros(), 0_u32), |(sum, count), force| {
        (sum + force, count + 1)
    });
    let mean = sum / f64::from(count);
    (mean.norm() > 0.0).then_some(mean)
}

/// Time in contact, s: the sample periods at whose both ends the finger touched.
fn contact_time_s(config: &ReplayConfig, push: &Push) -> f64 {
    let mut contact = Contact::default();
    let mut last_s = None;
    let mut sum_s = 0.0;
    for sample in &push.force {
        let touching = contact.follow(config, sample.force);
        if let (true, Some(last_s)) = (touching, last_s) {
            sum_s += sample.t_s - last_s;
        }
        last_s = touching.then_some(sample.t_s);
    }
    sum_s
}

/// One law's friction as the slave knows it and as the master last received it.
struct Learner {
    law: Law,
    config: ReplayConfig,
    at_slave: Support,
    at_master: Support,
    packets: Packets,
    samples: u64,
    error_sum: f64,
}

impl Learner {
    fn new(law: Law, config: &ReplayConfig) -> Self {
        Self {
            law,
            config: *config,
            at_slave: config.start,
            at_master: config.start,
            packets: Packets::default(),
            samples: 0,
            error_sum: 0.0,
        }
    }

    /// Predicts a push and runs the trigger on it; learns nothing from its force.
    fn predict(
        &mut self,
        push: &Push,
        motion: &PushMotion,
        measured: Option<Vec2>,
        contact_s: f64,
    ) -> LawOnPush {
        let force = |surface| rotate(motion.halfway, self.law.force(surface, motion));
        let (by_master, predicted) = (force(&self.at_master), force(&self.at_slave));
        let traffic = trigger::run(&self.config, &push.force, by_master, predicted);
        if traffic.packets.sent() > 0 {
            self.at_master = self.at_slave;
        }
        self.count(&traffic);
        LawOnPush {
            law: self.law,
            predicted_n: predicted,
            relative_error: measured.map(|force| heldout::relative_error(predicted, force)),
            vector_error: measured.map(|force| (predicted - force).norm() / force.norm()),
            held_error: mean_of_sum(traffic.error_sum, traffic.samples),
            updates: Rates::of(traffic.packets, push.duration_s(), contact_s),
        }
    }

    fn count(&mut self, traffic: &TriggerTraffic) {
        self.packets.add(&traffic.packets);
        self.samples += traffic.samples;
        self.error_sum += traffic.error_sum;
    }

    /// Fits the friction again, now that one more push is over.
    fn learn(&mut self, observed: &[Observation<PushMotion>]) {
        self.at_slave = fit(self.law, &self.config.start, &self.at_slave, observed);
    }

    fn report(&self, pushes: &[PushReport], duration_s: f64, contact_s: f64) -> LawReport {
        let own = || {
            let laws = pushes.iter().flat_map(|push| &push.laws);
            laws.filter(|law| law.law == self.law)
        };
        let coupled = self.law != Law::Decoupled;
        LawReport {
            law: self.law,
            friction_n: self.at_slave.friction_n,
            friction_torque_nm: coupled.then(|| self.at_slave.torque_nm()),
            centre_m: coupled.then_some(self.at_slave.centre_m),
            force_error: Spread::of(own().filter_map(|law| law.relative_error)),
            vector_error: Spread::of(own().filter_map(|law| law.vector_error)),
            held_error: mean_of_sum(self.error_sum, self.samples),
            updates: Rates::of(self.packets, duration_s, contact_s),
        }
    }
}

#[cfg(test)]
mod tests;
