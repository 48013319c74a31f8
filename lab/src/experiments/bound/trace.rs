//! One run of a scheme, kept tick by tick, and what an oracle makes of it.
//!
//! The oracle is judged in the ticks in which the scheme is, and by the same forces.

use std::collections::VecDeque;
use std::time::Duration;

use mmt_shared::model::dynamics::Motion;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::model::params::ModelParams;
use mmt_shared::model::settings::ModelSettings;
use mmt_shared::model::update::Cause;
use mmt_shared::stats::values::quantile;
use mmt_shared::time::{TICK_S, Time};

use crate::experiment::findings::ExperimentError;
use crate::oracle::{Oracle, Tick};
use crate::trial::TrialError;
use crate::world::{World, WorldConfig, WorldTick};

/// Ticks of a contact that are left out at its beginning: nobody knows anything then.
const LEFT_OUT_TICKS: u32 = 100;
/// Ticks from one possible update of the oracle's to the next: the shortest time between two of the schemes.
const GAP_TICKS: usize = 10;
/// The share of the judged ticks in which the scheme's error is below epsilon.
const SHARE: f64 = 0.95;
/// What an update of the oracle's may take for e, over the truth: the limit surface of the model is an ellipsoid, the box's own is
/// not, so that no e is right for every motion.
const TURNING_CHOICES: [f64; 7] = [0.90, 0.95, 1.0, 1.05, 1.10, 1.15, 1.20];

/// What a run of a scheme came to, beside the oracle's.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Bounded {
    /// Length of the run, s.
    pub(super) duration_s: f64,
    /// Time in which the force is judged, s.
    pub(super) judged_s: f64,
    /// The force error that the scheme stays within for 95 % of that time, N; none without contact.
    pub(super) epsilon_n: Option<f64>,
    /// Updates of the scheme.
    pub(super) updates: u64,
    /// Those of them that a contact mismatch or a lost contact asked for.
    pub(super) contact_updates: u64,
    /// Those of them that were sent in a judged tick.
    pub(super) judged_updates: u64,
    /// Updates of the oracle; none if it cannot stay within epsilon.
    pub(super) fewest: Option<usize>,
    /// Updates of a sender that knows the truth, but not what is to come.
    pub(super) when_off: Option<usize>,
    /// Of the run's event log.
    pub(super) digest: String,
}

/// What is kept of a run.
#[derive(Default)]
struct Kept {
    ticks: Vec<Tick>,
    /// The scheme's own force error in each judged tick, N.
    errors_n: Vec<f64>,
    /// The hand's samples that the slave has not played yet, and the one that it plays.
    samples: VecDeque<(Time, Vec2)>,
    /// The HIP that was played last, m.
    hip: Option<Vec2>,
    contact_ticks: u32,
    updates: u64,
    contact_updates: u64,
    judged_updates: u64,
}

impl Bounded {
    /// Runs a world for a duration, then asks the oracle.
    pub(super) fn of(config: &WorldConfig, duration: Duration) -> Result<Self, ExperimentError> {
        let mut world = World::try_new(config).map_err(TrialError::from)?;
        let mut kept = Kept::default();
        for _ in 0..duration.as_millis() {
            let object = world.slave().environment();
            let truth = Motion {
                pose: object.pose(),
                twist: object.twist(),
            };
            let tick = world.step();
            kept.take(truth, &tick);
        }
        let Kept {
            ticks,
            mut errors_n,
            ..
        } = kept;
        errors_n.sort_by(f64::total_cmp);
        let epsilon_n = quantile(&errors_n, SHARE);
        let settings = *world.slave().settings();
        let object = world.slave().environment();
        let choices = choices(&object.truth(), &settings);
        let oracle = Oracle {
            settings,
            footprint: object.footprint(),
            choices: &choices,
            ticks: &ticks,
            gap_ticks: GAP_TICKS,
        };
        let start = *world.slave().state();
        let needed = epsilon_n.map(|epsilon_n| oracle.needed(start, epsilon_n));
        Ok(Self {
            duration_s: duration.as_secs_f64(),
            judged_s: errors_n.len() as f64 * TICK_S,
            epsilon_n,
            updates: kept.updates,
            contact_updates: kept.contact_updates,
            judged_updates: kept.judged_updates,
            fewest: needed.and_then(|needed| needed.fewest),
            when_off: needed.and_then(|needed| needed.when_off),
            digest: world.digest(),
        })
    }

    /// Updates of the scheme over the oracle's; none where that needs none.
    pub(super) fn ratio(&self) -> Option<f64> {
        let fewest = self.fewest.filter(|fewest| *fewest > 0)?;
        Some(self.updates as f64 / fewest as f64)
    }
}

/// What an update of the oracle's may carry: the truth, with e by each of the choices.
fn choices(truth: &ModelParams, settings: &ModelSettings) -> Vec<ModelParams> {
    let [m, b, c, inertia, e] = truth.to_array();
    let scaled = |by: f64| ModelParams::try_new(m, b, c, inertia, e * by, &settings.coupling);
    TURNING_CHOICES
        .into_iter()
        .filter_map(|by| scaled(by).ok())
        .collect()
}

impl Kept {
    fn take(&mut self, truth: Motion, tick: &WorldTick) {
        let sample = &tick.master.sample;
        self.samples.push_back((sample.stamp, sample.hip.metres()));
        let Some(slave) = tick.slave else {
            return;
        };
        let hip = self.hip_at(slave.stamp);
        let hip_velocity = (hip - self.hip.unwrap_or(hip)) / TICK_S;
        self.hip = Some(hip);
        let force = slave.true_force;
        self.contact_ticks = if force == Vec2::zeros() {
            0
        } else {
            self.contact_ticks.saturating_add(1)
        };
        let judged = slave.f_m.filter(|_| self.contact_ticks > LEFT_OUT_TICKS);
        self.errors_n.extend(judged.map(|f_m| (f_m - force).norm()));
        if let Some(update) = slave.update {
            self.updates += 1;
            self.judged_updates += u64::from(judged.is_some());
            self.contact_updates += u64::from(matches!(
                update.cause,
                Cause::MasterOnlyContact | Cause::SlaveOnlyContact | Cause::ContactLost
            ));
        }
        self.ticks.push(Tick {
            hip,
            hip_velocity,
            truth,
            force,
            is_judged: judged.is_some(),
        });
    }

    /// The HIP of the sample that the slave plays in this tick, m: play-out is a few ticks behind the hand.
    fn hip_at(&mut self, stamp: Time) -> Vec2 {
        while self.samples.get(1).is_some_and(|(next, _)| *next <= stamp) {
            self.samples.pop_front();
        }
        self.samples.front().map_or(Vec2::zeros(), |(_, hip)| *hip)
    }
}
