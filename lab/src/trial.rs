//! One run of an experiment: a world, how long it runs, what changes on the way, and what is measured.
//!
//! Pure and deterministic: a trial's result is a function of the trial. It must never look at another
//! trial, so that trials may run in any order on any number of threads.

mod recovery;
mod running;

pub use recovery::Recovery;
pub use running::Running;

use std::time::Duration;

use mmt_server::environment::{Environment, EnvironmentError};
use mmt_server::slave::SlaveTick;
use mmt_shared::metrics::{ForceSummary, UpdateCounts};
use mmt_shared::model::geometry::Vec2;
use mmt_shared::model::update::Cause;
use mmt_shared::report::TrueForce;
use mmt_shared::time::TICK_S;
use serde::{Deserialize, Serialize};

use crate::world::{World, WorldConfig, WorldError, WorldTick, WorldTraffic};
use recovery::Watch;

/// The first second of contact is the opening: the model starts wrong there.
const OPENING_S: f64 = 1.0;

/// A run to be done.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// The world.
    pub config: WorldConfig,
    /// How long it runs.
    pub duration: Duration,
    /// What changes on the way; none is usual.
    pub change: Option<Change>,
    /// Whether every tick's forces are kept.
    pub traced: bool,
}

/// A change of the object in mid-push.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Change {
    /// Pushes completed before the one in which it comes.
    pub after_pushes: u64,
    /// Contact in that push before it comes, s.
    pub contact_s: f64,
    /// What changes.
    pub to: Alteration,
}

/// What can change under the tool.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Alteration {
    /// Nothing: only watched from here on, since the model starts wrong.
    Nothing,
    /// The friction coefficient mu.
    FrictionCoefficient(f64),
    /// The mass m, kg, and with it c, I and e.
    MassKg(f64),
}

impl Alteration {
    /// Changes the object.
    ///
    /// # Errors
    /// When no object can be so.
    pub fn apply(self, environment: &mut Environment) -> Result<(), EnvironmentError> {
        match self {
            Self::Nothing => Ok(()),
            Self::FrictionCoefficient(mu) => environment.set_friction(mu),
            Self::MassKg(m) => environment.set_mass(m),
        }
    }
}

/// One tick of a traced trial.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TraceRow {
    /// Stamp of the HIP sample, s since the start.
    pub t_s: f64,
    /// f_s, N.
    pub f_s: Vec2,
    /// f_m rendered for the same sample, N; none if the sample was lost.
    pub f_m: Option<Vec2>,
    /// Why an update was sent in this tick.
    pub update: Option<Cause>,
}

/// What a trial came to.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// Time from the slave's first tick, s.
    pub duration_s: f64,
    /// Time in contact, s.
    pub contact_s: f64,
    /// Force metrics of the whole run.
    pub force: ForceSummary,
    /// The same against the true force.
    pub true_force: TrueForce,
    /// Updates by cause.
    pub updates: UpdateCounts,
    /// Updates per second of contact in the first second of contact; none if contact was shorter.
    pub opening_rate_hz: Option<f64>,
    /// Updates per second of contact after it, counting those sent in contact; none without.
    pub later_rate_hz: Option<f64>,
    /// Pushes that the operator completed.
    pub pushes: u64,
    /// Root mean square error of the master's model's position, m.
    pub position_rms_m: Option<f64>,
    /// The same of its angle, rad.
    pub angle_rms_rad: Option<f64>,
    /// Breaks of contact per push.
    pub breaks_per_push: Option<f64>,
    /// Largest force on the hand, N.
    pub force_peak_n: Option<f64>,
    /// m, b, c as estimated at the end, less the truth, over the truth.
    pub parameter_errors: [f64; 3],
    /// How the change was followed; none if the trial has no change or it never came.
    pub recovery: Option<Recovery>,
    /// From the sending of each update until the master knew it or a newer one.
    pub staleness: Vec<Duration>,
    /// Messages, datagrams and bits that were sent.
    pub traffic: WorldTraffic,
    /// The forces, tick by tick; empty unless the trial is traced.
    pub trace: Vec<TraceRow>,
    /// SHA-256 of the world's event log.
    pub digest: String,
}

/// Why a trial could not be run.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TrialError {
    /// The world could not be made.
    #[error(transparent)]
    World(#[from] WorldError),
    /// The change is to something that no object can be.
    #[error("change: {0}")]
    Change(#[from] EnvironmentError),
}

impl Trial {
    /// A trial without change and without trace.
    #[must_use]
    pub fn new(config: WorldConfig, duration: Duration) -> Self {
        Self {
            config,
            duration,
            change: None,
            traced: false,
        }
    }

    /// The same with another seed.
    #[must_use]
    pub fn seeded(self, seed: u64) -> Self {
        Self {
            config: self.config.seeded(seed),
            ..self
        }
    }
}

/// What is counted while a trial runs.
#[derive(Clone, Debug, Default)]
struct Counters {
    contact_s: f64,
    /// Contact in the push that the change is to come in, s; none until the tool has let go after the push before.
    push_contact_s: Option<f64>,
    opening_updates: u64,
    later_updates: u64,
    watch: Option<Watch>,
    trace: Vec<TraceRow>,
}

impl Counters {
    fn take(&mut self, tick: &WorldTick, traced: bool) {
        let Some(slave) = &tick.slave else {
            return;
        };
        if slave.in_contact {
            let sent = u64::from(slave.update.is_some());
            if self.contact_s < OPENING_S {
                self.opening_updates += sent;
            } else {
                self.later_updates += sent;
            }
            self.contact_s += TICK_S;
            if let Some(contact_s) = &mut self.push_contact_s {
                *contact_s += TICK_S;
            }
        } else if self.push_contact_s.is_none() {
            self.push_contact_s = Some(0.0);
        }
        if let Some(watch) = &mut self.watch {
            watch.take(slave);
        }
        if traced {
            self.trace.push(row(slave));
        }
    }

    fn measured(self, world: &World) -> Measured {
        let outcome = world.outcome();
        let pushes = world.operator().pushes_completed().unwrap_or_default();
        let later_s = self.contact_s - OPENING_S;
        let estimate = world.slave().estimate();
        let truth = world.slave().environment().truth();
        let error = |found: f64, is: f64| (found - is) / is;
        Measured {
            duration_s: outcome.updates.duration_s(),
            contact_s: outcome.updates.contact_s(),
            force: world.force(),
            true_force: world.slave().true_force(),
            updates: outcome.updates,
            opening_rate_hz: (later_s >= 0.0).then(|| self.opening_updates as f64 / OPENING_S),
            later_rate_hz: (later_s > 0.0).then(|| self.later_updates as f64 / later_s),
            pushes,
            position_rms_m: outcome.pose.position_rms_m(),
            angle_rms_rad: outcome.pose.angle_rms_rad(),
            breaks_per_push: outcome.breaks.per_push(pushes),
            force_peak_n: outcome.on_hand.largest_n(),
            parameter_errors: [
                error(estimate.m, truth.m()),
                error(estimate.b, truth.b()),
                error(estimate.c, truth.c()),
            ],
            recovery: self.watch.map(Watch::recovery),
            staleness: outcome.staleness.times().to_vec(),
            traffic: world.traffic(),
            trace: self.trace,
            digest: world.digest(),
        }
    }
}

fn row(slave: &SlaveTick) -> TraceRow {
    TraceRow {
        t_s: slave.stamp.as_secs_f64(),
        f_s: slave.f_s,
        f_m: slave.f_m,
        update: slave.update.map(|update| update.cause),
    }
}

#[cfg(test)]
mod tests;
