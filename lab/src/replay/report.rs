//! What a replay found: one document for machines, three tables for people. A number without meaning is
//! none (null), never a guess.

use std::fmt;

use mmt_shared::model::geometry::Vec2;
use mmt_shared::stats::values::{mean, median, quantile};
use serde::Serialize;

use super::config::ReplayConfig;
use super::heldout::HeldOut;
use super::surface::Law;
use super::trigger::Packets;
use crate::table::{Column, Table, column};

/// Median and mean of an error over pushes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Spread {
    /// Number of pushes that count.
    pub pushes: usize,
    /// Median; none if no push counts.
    pub median: Option<f64>,
    /// Mean; none if no push counts.
    pub mean: Option<f64>,
}

impl Spread {
    pub(super) fn of(values: impl Iterator<Item = f64> + Clone) -> Self {
        Self {
            pushes: values.clone().count(),
            median: median(values.clone()),
            mean: mean(values),
        }
    }
}

/// Packets and their rates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Rates {
    /// Packets by cause.
    #[serde(flatten)]
    pub packets: Packets,
    /// All packets.
    pub sent: u64,
    /// Packets per second of the recording; none if it lasted no time.
    pub rate_hz: Option<f64>,
    /// Packets per second of contact; none without contact.
    pub contact_rate_hz: Option<f64>,
}

impl Rates {
    pub(super) fn of(packets: Packets, duration_s: f64, contact_s: f64) -> Self {
        let per = |seconds: f64| (seconds > 0.0).then(|| packets.sent() as f64 / seconds);
        Self {
            packets,
            sent: packets.sent(),
            rate_hz: per(duration_s),
            contact_rate_hz: per(contact_s),
        }
    }
}

/// One law on one push.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LawOnPush {
    /// The law.
    pub law: Law,
    /// Force predicted from the push's motion and the pushes before it, world, N.
    pub predicted_n: Vec2,
    /// Relative error of |F| against the steady measured force; none without contact.
    pub relative_error: Option<f64>,
    /// |predicted − measured| / |measured|; none without contact.
    pub vector_error: Option<f64>,
    /// Mean over contact samples of the relative vector error of the force that the master's model held.
    pub held_error: Option<f64>,
    /// What the trigger sent.
    pub updates: Rates,
}

/// One push.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PushReport {
    /// Its number, from 0.
    pub index: usize,
    /// Length of the force record, s.
    pub duration_s: f64,
    /// Of it in contact, s.
    pub contact_s: f64,
    /// Distance that the reference point moved, m.
    pub distance_m: f64,
    /// Turn of the block, rad, counter-clockwise.
    pub turn_rad: f64,
    /// Mean force times displacement, N m; positive in every sound record.
    pub force_times_displacement_nm: f64,
    /// Steady force on the block, world, N; none without contact.
    pub measured_n: Option<Vec2>,
    /// Each law's prediction and packets.
    pub laws: Vec<LawOnPush>,
}

/// One law over all pushes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LawReport {
    /// The law.
    pub law: Law,
    /// Friction c after the last push, N.
    pub friction_n: f64,
    /// Friction torque e after the last push, N m; none for decoupled friction, whose force does not
    /// depend on it.
    pub friction_torque_nm: Option<f64>,
    /// Centre of friction from the reference point, block's frame, m; none for decoupled friction.
    pub centre_m: Option<Vec2>,
    /// Relative error of |F|, predicted before the push's force was used.
    pub force_error: Spread,
    /// |predicted − measured| / |measured|, likewise.
    pub vector_error: Spread,
    /// Mean over all contact samples of the relative vector error of the force held by the master's model.
    pub held_error: Option<f64>,
    /// What the trigger sent.
    pub updates: Rates,
}

/// The whole replay. Mass and damping are no part of it: at 3 mm/s the force of inertia is below the sensor's noise, and
/// at one speed damping looks like friction.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ReplayReport {
    /// Length of all force records, s.
    pub duration_s: f64,
    /// Of it in contact, s.
    pub contact_s: f64,
    /// Each law over all pushes.
    pub laws: Vec<LawReport>,
    /// Held-out prediction of each law.
    pub held_out: Vec<HeldOut>,
    /// Each push.
    pub pushes: Vec<PushReport>,
    /// How the replay was run.
    #[serde(skip)]
    pub configuration: ReplayConfig,
}

impl ReplayReport {
    /// The totals of a law.
    #[must_use]
    pub fn law(&self, law: Law) -> Option<&LawReport> {
        self.laws.iter().find(|report| report.law == law)
    }

    /// The held-out prediction of a law.
    #[must_use]
    pub fn held_out(&self, law: Law) -> Option<&HeldOut> {
        self.held_out.iter().find(|report| report.law == law)
    }
}

/// The most repeats of which every one is shown.
const SHOWN_MAX: usize = 10;

/// The errors of single repeats: each, or the 5th to the 95th percentile of many.
fn of_repeats(errors: &[f64]) -> String {
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    if errors.len() <= SHOWN_MAX {
        let each = errors.iter().map(|error| percent(*error));
        return each.collect::<Vec<_>>().join(", ");
    }
    let mut sorted = errors.to_vec();
    sorted.sort_by(f64::total_cmp);
    let [low, high] =
        [0.05, 0.95].map(|share| quantile(&sorted, share).map_or(String::new(), percent));
    format!("5th to 95th percentile: {low} to {high}")
}

pub(super) fn percent(share: Option<f64>) -> Option<f64> {
    share.map(|share| 100.0 * share)
}

impl fmt::Display for ReplayReport {
    /// A table of the pushes, one of the laws, one of the held-out prediction.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.of_pushes())?;
        writeln!(f, "{}", self.of_laws())?;
        write!(f, "{}", self.of_held_out())
    }
}

#[rustfmt::skip]
impl ReplayReport {
    fn of_pushes(&self) -> Table {
        let mut columns: Vec<Column<PushReport>> = vec![
            column("push", "", 0, |push| push.index as u64),
            column("mm", "mm", 2, |push| 1e3 * push.distance_m),
            column("deg", "deg", 2, |push| push.turn_rad.to_degrees()),
            column("N", "N", 2, |push| push.measured_n.map(|force| force.norm())),
        ];
        for law in Law::ALL {
            let of = move |push: &PushReport| push.laws.iter().find(|report| report.law == law).copied();
            let error = move |push: &PushReport| percent(of(push).and_then(|law| law.relative_error)).into();
            let rate = move |push: &PushReport| of(push).and_then(|law| law.updates.rate_hz).into();
            columns.push(Column::new(law.name(), "%", 1, error));
            columns.push(Column::new("packets/s", "Hz", 1, rate));
        }
        let title = "Each push, predicted from its motion and the pushes before it: |F| error in % by law, packets/s";
        Table::of(title, &self.pushes, &columns)
    }

    fn of_laws(&self) -> Table {
        let (pushes, all, contact) = (self.pushes.len(), self.duration_s, self.contact_s);
        let title = format!(
            "All {pushes} pushes, {all:.0} s, {contact:.0} s in contact; errors in %; mass and damping: absent (quasi-static)"
        );
        Table::of(
            title,
            &self.laws,
            &[
                column("law", "", 0, |law| law.law.name()),
                column("c N", "N", 3, |law| law.friction_n),
                column("e N m", "N m", 3, |law| law.friction_torque_nm),
                column("|F| median", "%", 1, |law| percent(law.force_error.median)),
                column("|F| mean", "%", 1, |law| percent(law.force_error.mean)),
                column("F median", "%", 1, |law| percent(law.vector_error.median)),
                column("packets/s", "Hz", 1, |law| law.updates.rate_hz),
                column("in contact", "Hz", 1, |law| law.updates.contact_rate_hz),
                column("with news", "", 0, |law| law.updates.packets.with_news),
            ],
        )
    }

    fn of_held_out(&self) -> Table {
        let ReplayConfig { fitted_share, repeats, seed, .. } = self.configuration;
        let fitted = 100.0 * fitted_share;
        Table::of(
            format!("Held-out pushes, {fitted:.0} % fitted, {repeats} repeats, seed {seed}: median |F| error in %"),
            &self.held_out,
            &[
                column("law", "", 0, |held_out| held_out.law.name()),
                column("error", "%", 1, |held_out| percent(held_out.median_error)),
                column("of each repeat", "", 0, |held_out| of_repeats(&held_out.median_errors)),
            ],
        )
    }
}
