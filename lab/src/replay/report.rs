//! What a replay found: one document for machines, two tables for people. A number without meaning is
//! none (null), never a guess.

use std::fmt;

use mmt_shared::model::geometry::Vec2;
use serde::Serialize;

use super::ReplayConfig;
use super::heldout::HeldOut;
use super::surface::{Law, Surface};
use super::trigger::Packets;
use crate::statistics::{mean, median, quantile};

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

impl LawReport {
    pub(super) fn new(law: Law, surface: &Surface) -> Self {
        let coupled = law != Law::Decoupled;
        Self {
            law,
            friction_n: surface.friction_n,
            friction_torque_nm: coupled.then(|| surface.torque_nm()),
            centre_m: coupled.then_some(surface.centre_m),
            force_error: Spread::default(),
            vector_error: Spread::default(),
            held_error: None,
            updates: Rates::default(),
        }
    }
}

/// The whole replay.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ReplayReport {
    /// Length of all force records, s.
    pub duration_s: f64,
    /// Of it in contact, s.
    pub contact_s: f64,
    /// Always none: at 3 mm/s the force of inertia is below the sensor's noise.
    pub mass_kg: Option<f64>,
    /// Always none: at one speed, damping cannot be told from friction.
    pub damping_ns_per_m: Option<f64>,
    /// Each law over all pushes.
    pub laws: Vec<LawReport>,
    /// Held-out prediction of each law.
    pub held_out: Vec<HeldOut>,
    /// Each push.
    pub pushes: Vec<PushReport>,
    /// How the replay was run.
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

/// A share in per cent, or a dash.
struct Percent(Option<f64>);

impl fmt::Display for Percent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = self
            .0
            .map_or_else(|| "-".to_owned(), |share| format!("{:.1} %", 100.0 * share));
        f.pad(&text)
    }
}

/// A number with so many decimals, or a dash.
struct Fixed(Option<f64>, usize);

impl fmt::Display for Fixed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = self
            .0
            .map_or_else(|| "-".to_owned(), |value| format!("{value:.*}", self.1));
        f.pad(&text)
    }
}

/// The most repeats of which every one is shown.
const SHOWN_MAX: usize = 10;

/// The errors of single repeats: each, or the 5th to the 95th percentile of many.
struct Repeats<'a>(&'a [f64]);

impl fmt::Display for Repeats<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.len() > SHOWN_MAX {
            let mut sorted = self.0.to_vec();
            sorted.sort_by(f64::total_cmp);
            let [low, high] = [0.05, 0.95].map(|share| Percent(quantile(&sorted, share)));
            return write!(f, "5th to 95th percentile: {low} to {high}");
        }
        for (repeat, error) in self.0.iter().enumerate() {
            let comma = if repeat == 0 { "" } else { ", " };
            write!(f, "{comma}{}", Percent(Some(*error)))?;
        }
        Ok(())
    }
}

impl fmt::Display for ReplayReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.write_pushes(f)?;
        writeln!(f)?;
        self.write_totals(f)?;
        writeln!(f)?;
        self.write_held_out(f)
    }
}

impl ReplayReport {
    fn write_pushes(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "Each push, predicted from its motion and the pushes before it: |F| error, packets/s"
        )?;
        write!(f, "{:>4} {:>7} {:>7} {:>6}", "push", "mm", "deg", "N")?;
        for law in &self.laws {
            write!(f, "  {:>20}", law.law.name())?;
        }
        writeln!(f)?;
        for push in &self.pushes {
            write!(
                f,
                "{:>4} {:>7.2} {:>7.2} {:>6}",
                push.index,
                1e3 * push.distance_m,
                push.turn_rad.to_degrees(),
                Fixed(push.measured_n.map(|force| force.norm()), 2),
            )?;
            for law in &push.laws {
                let rate = Fixed(law.updates.rate_hz, 1);
                write!(f, "  {:>10} {rate:>9}", Percent(law.relative_error))?;
            }
            writeln!(f)?;
        }
        Ok(())
    }

    fn write_totals(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "All {} pushes, {:.0} s, {:.0} s in contact; mass and damping: absent (quasi-static)",
            self.pushes.len(),
            self.duration_s,
            self.contact_s
        )?;
        writeln!(
            f,
            "{:<20} {:>8} {:>8} {:>12} {:>9} {:>10} {:>10} {:>10} {:>6}",
            "",
            "c N",
            "e N m",
            "|F| median",
            "|F| mean",
            "F median",
            "packets/s",
            "in contact",
            "news"
        )?;
        for law in &self.laws {
            writeln!(
                f,
                "{:<20} {:>8.3} {:>8} {:>12} {:>9} {:>10} {:>10} {:>10} {:>6}",
                law.law.name(),
                law.friction_n,
                Fixed(law.friction_torque_nm, 3),
                Percent(law.force_error.median),
                Percent(law.force_error.mean),
                Percent(law.vector_error.median),
                Fixed(law.updates.rate_hz, 1),
                Fixed(law.updates.contact_rate_hz, 1),
                law.updates.packets.with_news,
            )?;
        }
        Ok(())
    }

    fn write_held_out(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "Held-out pushes, {:.0} % fitted, {} repeats, seed {}: median |F| error",
            100.0 * self.configuration.fitted_share,
            self.configuration.repeats,
            self.configuration.seed
        )?;
        for law in &self.held_out {
            let (name, error) = (law.law.name(), Percent(law.median_error));
            writeln!(
                f,
                "{name:<20} {error:>8}  ({})",
                Repeats(&law.median_errors)
            )?;
        }
        Ok(())
    }
}
