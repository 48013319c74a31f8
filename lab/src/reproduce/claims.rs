//! What section IV-B claims, measured here: each claim with a value, an interval and a verdict.
//!
//! Paper mode, as it is; nothing is tuned to make a claim hold. Differences are taken between runs of the same
//! seed, so that what the seeds have in common cancels.

mod equal_rate;

pub(super) use equal_rate::log_ratio;

use mmt_shared::model::settings::Mode;
use serde::Serialize;

use super::fig5::{Point, points};
use super::{
    Curve, DEADBANDS, Extent, FIG5_CURVES, Findings, Laboratory, ReproduceError, digest, nothing,
    paper_world,
};
use crate::statistics::Interval;
use crate::table::{Cell, Table};
use crate::trial::{Measured, Trial};

/// The three schemes of the paper.
const SCHEMES: [Curve; 3] = [Curve::Deadband, Curve::Hybrid(50), Curve::Hybrid(150)];
/// A rate that the paper calls "about 60" is within this share of it.
const ABOUT: f64 = 0.25;

/// Whether a claim holds here.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Verdict {
    /// The whole 95 % interval agrees with the claim.
    #[serde(rename = "holds")]
    Holds,
    /// The whole interval contradicts it.
    #[serde(rename = "does not hold")]
    DoesNotHold,
    /// The interval leaves it open.
    #[serde(rename = "tie")]
    Tie,
}

impl Verdict {
    /// Of the claim that a quantity lies above a bound.
    fn above(interval: &Interval, bound: f64) -> Self {
        if interval.low > bound {
            Self::Holds
        } else if interval.high < bound {
            Self::DoesNotHold
        } else {
            Self::Tie
        }
    }

    /// Of the claim that it lies below.
    fn below(interval: &Interval, bound: f64) -> Self {
        if interval.high < bound {
            Self::Holds
        } else if interval.low > bound {
            Self::DoesNotHold
        } else {
            Self::Tie
        }
    }

    /// The words of files and tables.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::Holds => "holds",
            Self::DoesNotHold => "does not hold",
            Self::Tie => "tie",
        }
    }
}

/// One claim and what was measured of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Claim {
    /// A short name.
    pub id: String,
    /// What the paper says.
    pub statement: &'static str,
    /// What was measured, in words.
    pub quantity: &'static str,
    /// What the claim expects of it.
    pub expected: String,
    /// Measured; none if no run could tell.
    pub measured: Option<Interval>,
    /// Whether it holds.
    pub verdict: Verdict,
}

/// Runs the paper's schemes and judges its claims; keeps `claims.json` and `claims.csv`.
///
/// # Errors
/// As [`Laboratory::run`] and [`Laboratory::keep`].
pub fn reproduce(laboratory: &dyn Laboratory, extent: Extent) -> Result<Findings, ReproduceError> {
    let curves: Vec<(Mode, Curve)> = FIG5_CURVES
        .into_iter()
        .filter(|(mode, _)| *mode == Mode::Paper)
        .collect();
    let points = points(&curves, extent.seeds);
    let trials: Vec<Trial> = points.iter().map(|point| point.trial(extent)).collect();
    let measured = laboratory.run("claims", &trials, &nothing)?;
    let runs = Runs {
        points: &points,
        measured: &measured,
        seeds: extent.seeds,
    };
    let mut claims = runs.claims();
    claims.push(estimation_time(laboratory));
    let table = table(&claims, extent.seeds);
    laboratory.keep("claims.csv", &table.to_csv())?;
    let document = Document { claims: &table };
    let document = serde_json::to_string_pretty(&document).unwrap_or_default();
    laboratory.keep("claims.json", format!("{document}\n").as_bytes())?;
    Ok(Findings {
        experiment: "claims",
        extent,
        digest: digest(&measured),
        configuration: vec![paper_world(Mode::Paper, Curve::Hybrid(150).at(0.10))],
        tables: vec![table.selected(&["claim", "expected", "value", "low", "high", "verdict"])],
    })
}

/// `claims.json`.
#[derive(Serialize)]
struct Document<'a> {
    claims: &'a Table,
}

fn table(claims: &[Claim], seeds: u64) -> Table {
    let mut table = Table::new(
        format!("Claims of section IV-B, {seeds} seeds, paper mode"),
        &[
            ("claim", 0),
            ("statement", 0),
            ("quantity", 0),
            ("expected", 0),
            ("value", 4),
            ("low", 4),
            ("high", 4),
            ("verdict", 0),
        ],
    );
    for claim in claims {
        table.push([
            Cell::from(claim.id.clone()),
            claim.statement.into(),
            claim.quantity.into(),
            claim.expected.clone().into(),
            claim.measured.map(|i| i.mean).into(),
            claim.measured.map(|i| i.low).into(),
            claim.measured.map(|i| i.high).into(),
            claim.verdict.words().into(),
        ]);
    }
    table
}

/// A claim whose quantity must lie above or below a bound; without a measurement it is open.
fn judged(
    id: String,
    statement: &'static str,
    quantity: &'static str,
    (expected, judge, bound): (String, fn(&Interval, f64) -> Verdict, f64),
    measured: Option<Interval>,
) -> Claim {
    Claim {
        id,
        statement,
        quantity,
        expected,
        measured,
        verdict: measured.map_or(Verdict::Tie, |interval| judge(&interval, bound)),
    }
}

fn estimation_time(laboratory: &dyn Laboratory) -> Claim {
    let one = laboratory.estimator_tick_ms();
    judged(
        "estimation-time".to_owned(),
        "estimation takes less than 1 ms",
        "CPU time of one tick of the paper's estimator on this machine, ms",
        ("< 1".to_owned(), Verdict::below, 1.0),
        one.and_then(|ms| Interval::of([ms])),
    )
}

/// All runs, by scheme, deadband and seed.
pub(super) struct Runs<'a> {
    pub(super) points: &'a [Point],
    pub(super) measured: &'a [Measured],
    pub(super) seeds: u64,
}

impl Runs<'_> {
    fn claims(&self) -> Vec<Claim> {
        let mut claims = Vec::new();
        claims.extend(SCHEMES.map(|curve| self.knee(curve)));
        claims.extend(PAIRS.map(|(better, worse)| self.equal_deadband(better, worse)));
        claims.extend(PAIRS.map(|(better, worse)| self.equal_rate(better, worse)));
        claims.push(self.rate_at_30());
        claims.push(self.rate_below_40());
        claims.extend([50, 150].map(|ms| self.lower_bound(ms)));
        claims.extend([Curve::Deadband, Curve::Hybrid(150)].map(|curve| self.opening(curve)));
        claims
    }

    /// The run of a scheme at a deadband with a seed.
    pub(super) fn run(&self, curve: Curve, deadband: f64, seed: u64) -> Option<&Measured> {
        let wanted = |point: &Point| {
            (point.mode, point.curve, point.seed) == (Mode::Paper, curve, seed)
                && point.deadband == deadband
        };
        let index = self.points.iter().position(wanted)?;
        self.measured.get(index)
    }

    /// A number of each seed's runs, where all of them have one.
    fn per_seed(&self, of: impl Fn(u64) -> Option<f64>) -> Vec<f64> {
        (1..=self.seeds).filter_map(of).collect()
    }

    fn pmse(&self, curve: Curve, deadband: f64, seed: u64) -> Option<f64> {
        self.run(curve, deadband, seed)?.force.pmse
    }

    /// How much steeper PMSE falls from 30 to 10 % than from 10 to 2.5 %: the difference of the exponents
    /// d ln PMSE / d ln Delta.
    fn knee(&self, curve: Curve) -> Claim {
        let differences = self.per_seed(|seed| {
            let ln = |deadband| Some(libm::log(self.pmse(curve, deadband, seed)?));
            let steep = (ln(0.30)? - ln(0.10)?) / libm::log(3.0);
            let flat = (ln(0.10)? - ln(0.025)?) / libm::log(4.0);
            Some(steep - flat)
        });
        judged(
            format!("knee, {}", curve.label()),
            "PMSE falls steeply from 30 to 10 % and is nearly flat from 10 to 2.5 %",
            "exponent of PMSE over Delta from 30 to 10 % less that from 10 to 2.5 %",
            ("> 0".to_owned(), Verdict::above, 0.0),
            Interval::of(differences),
        )
    }

    fn equal_deadband(&self, better: Curve, worse: Curve) -> Claim {
        let ratios = self.per_seed(|seed| {
            let ratio = |deadband: &f64| {
                let (better, worse) = (
                    self.pmse(better, *deadband, seed)?,
                    self.pmse(worse, *deadband, seed)?,
                );
                Some(libm::log(better / worse))
            };
            let logs: Option<Vec<f64>> = DEADBANDS.iter().map(ratio).collect();
            let logs = logs?;
            Some(libm::exp(logs.iter().sum::<f64>() / logs.len() as f64))
        });
        judged(
            format!(
                "at equal deadband, {} against {}",
                better.label(),
                worse.label()
            ),
            "at the same deadband parameter a shorter T_update gives a lower PMSE",
            "ratio of PMSE, geometric mean over the seven deadbands",
            ("< 1".to_owned(), Verdict::below, 1.0),
            Interval::of_ratios(ratios),
        )
    }

    fn equal_rate(&self, first: Curve, second: Curve) -> Claim {
        // of two hybrids the paper ranks the longer period first
        let (better, worse) = match (first, second) {
            (Curve::Hybrid(50), Curve::Hybrid(150)) => (second, first),
            pair => pair,
        };
        judged(
            format!(
                "at equal rate, {} against {}",
                better.label(),
                worse.label()
            ),
            "hybrid 150 ms performs best, hybrid 50 ms second, the deadband scheme last",
            "ratio of PMSE, geometric mean over the packet rates that both reach",
            ("< 1".to_owned(), Verdict::below, 1.0),
            self.ratio_at_equal_rate(better, worse),
        )
    }

    fn rates(&self, curve: Curve, deadband: f64) -> Vec<f64> {
        self.per_seed(|seed| self.run(curve, deadband, seed)?.updates.rate_hz())
    }

    fn rate_at_30(&self) -> Claim {
        let measured = Interval::of(self.rates(Curve::Hybrid(50), 0.30));
        let (low, high) = (60.0 * (1.0 - ABOUT), 60.0 * (1.0 + ABOUT));
        let verdict = measured.map_or(Verdict::Tie, |interval| {
            if interval.low >= low && interval.high <= high {
                Verdict::Holds
            } else if interval.low > high || interval.high < low {
                Verdict::DoesNotHold
            } else {
                Verdict::Tie
            }
        });
        Claim {
            id: "rate at 30 %, hybrid 50 ms".to_owned(),
            statement: "the 50 ms scheme reaches a minimum of about 60 packets/s",
            quantity: "packets per second of the run",
            expected: format!("{low} to {high}"),
            measured,
            verdict,
        }
    }

    fn rate_below_40(&self) -> Claim {
        judged(
            "rate at 30 %, hybrid 150 ms".to_owned(),
            "the 150 ms scheme reduces the rate to less than 40 packets/s",
            "packets per second of the run",
            ("< 40".to_owned(), Verdict::below, 40.0),
            Interval::of(self.rates(Curve::Hybrid(150), 0.30)),
        )
    }

    /// The least rate of any run; a bound is a bound on each, so it has no interval.
    fn lower_bound(&self, ms: u64) -> Claim {
        let rates = DEADBANDS
            .iter()
            .flat_map(|deadband| self.rates(Curve::Hybrid(ms), *deadband));
        let least = rates.fold(f64::INFINITY, f64::min);
        let bound = 1000.0 / ms as f64;
        // a run of whole periods and a rest sends one packet less than its length over T_update
        let bound = bound * 0.995;
        judged(
            format!("lower bound, hybrid {ms} ms"),
            "the packet rate never falls below 1000 ms / T_update: 20 and about 7 packets/s",
            "least rate of any run",
            (
                format!(">= {:.1}", 1000.0 / ms as f64),
                Verdict::above,
                bound,
            ),
            least
                .is_finite()
                .then_some(least)
                .and_then(|least| Interval::of([least])),
        )
    }

    fn opening(&self, curve: Curve) -> Claim {
        let ratios = self.per_seed(|seed| {
            let run = self.run(curve, 0.15, seed)?;
            run.later_rate_hz
                .filter(|later| *later > 0.0)
                .zip(run.opening_rate_hz.filter(|o| *o > 0.0))
                .map(|(later, opening)| opening / later)
        });
        judged(
            format!("dense at the beginning, {}", curve.label()),
            "packet rates are relatively high at the beginning (figs. 6 and 7)",
            "packets per contact second at 15 %: the first second of contact against the rest",
            ("> 1".to_owned(), Verdict::above, 1.0),
            Interval::of_ratios(ratios),
        )
    }
}

/// Each pair with the one first that is claimed to be better at an equal deadband.
const PAIRS: [(Curve, Curve); 3] = [
    (Curve::Hybrid(50), Curve::Deadband),
    (Curve::Hybrid(150), Curve::Deadband),
    (Curve::Hybrid(50), Curve::Hybrid(150)),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_verdict_needs_the_whole_interval() {
        let interval = |low, high| Interval {
            n: 9,
            mean: f64::midpoint(low, high),
            low,
            high,
        };
        assert_eq!(Verdict::below(&interval(0.8, 0.9), 1.0), Verdict::Holds);
        assert_eq!(Verdict::below(&interval(0.8, 1.1), 1.0), Verdict::Tie);
        assert_eq!(
            Verdict::below(&interval(1.01, 1.1), 1.0),
            Verdict::DoesNotHold
        );
        assert_eq!(Verdict::above(&interval(1.01, 1.1), 1.0), Verdict::Holds);
        assert_eq!(Verdict::above(&interval(0.9, 1.1), 1.0), Verdict::Tie);
        assert_eq!(
            Verdict::above(&interval(0.8, 0.9), 1.0),
            Verdict::DoesNotHold
        );
    }
}
