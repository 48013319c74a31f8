//! What section IV-B claims, measured here: each claim with a value, an interval and a verdict.
//!
//! Paper mode, as it is; nothing is tuned to make a claim hold. Differences are taken between runs of the same
//! seed, so that what the seeds have in common cancels.

mod runs;
mod verdict;

use std::collections::BTreeMap;

use mmt_shared::model::settings::Mode;

use crate::experiment::description::{DURATION, Experiment, Request};
use crate::experiment::findings::{ExperimentError, Findings};
use crate::experiment::grid::{digest, interval};
use crate::io::{Runner, estimator_tick_ms};
use crate::setting::{Curve, DEADBANDS, FIG5_CURVES, Point, paper_world};
use crate::statistics::Interval;
use crate::table::{Column, Table, column};
use runs::Runs;
use verdict::Bound;

/// The three schemes of the paper.
const SCHEMES: [Curve; 3] = [Curve::Deadband, Curve::Hybrid(50), Curve::Hybrid(150)];
/// A rate that the paper calls "about 60" is within this share of it.
const ABOUT: f64 = 0.25;

/// The claims.
pub(super) const CLAIMS: Experiment = Experiment {
    name: "claims",
    about: "Every claim of section IV-B with value, interval and verdict",
    // with fewer, differences between the schemes are noise
    seeds: 40,
    duration: DURATION,
    arguments: &[],
    run,
};

/// One claim and what was measured of it.
struct Claim {
    /// A short name.
    id: String,
    /// The paper's statement.
    statement: &'static str,
    /// What was measured, in words.
    quantity: &'static str,
    /// Where the claim expects it, in words and numbers.
    expected: String,
    bound: Bound,
    /// None if no run could tell.
    measured: Option<Interval>,
}

/// Keeps `claims.json` and `claims.csv`.
fn run(runner: &Runner, request: &Request) -> Result<Findings, ExperimentError> {
    let extent = request.extent;
    let curves = FIG5_CURVES.into_iter();
    let curves = curves.filter(|(mode, _)| *mode == Mode::Paper);
    let groups = runner.grid("claims", extent.seeds, Point::of(curves), |point, seed| {
        runner.trial(&point.trial(seed, extent.duration))
    })?;
    let runs = Runs {
        groups: &groups,
        seeds: extent.seeds,
    };
    let title = format!("Claims of section IV-B, {} seeds, paper mode", extent.seeds);
    let table = Table::of(title, &claims(&runs), &columns());
    runner.keep_table("claims.csv", &table)?;
    let document = BTreeMap::from([("claims", &table)]);
    let document = serde_json::to_string_pretty(&document).unwrap_or_default();
    runner.keep("claims.json", format!("{document}\n").as_bytes())?;
    Ok(Findings {
        experiment: CLAIMS.name,
        extent,
        digest: digest(&groups),
        configuration: vec![paper_world(Mode::Paper, Curve::Hybrid(150).at(0.10))],
        tables: vec![table.without(&["statement", "quantity"])],
    })
}

#[rustfmt::skip]
fn columns<'a>() -> Vec<Column<'a, Claim>> {
    let mut columns: Vec<Column<Claim>> = vec![
        column("claim", "", 0, |claim| claim.id.clone()),
        column("statement", "", 0, |claim| claim.statement),
        column("quantity", "", 0, |claim| claim.quantity),
        column("expected", "", 0, |claim| claim.expected.clone()),
    ];
    let measured = |claim: &Claim| claim.measured;
    columns.extend(interval(["value", "low", "high"], "", 4, measured));
    columns.push(column("verdict", "", 0, |claim| claim.bound.verdict(claim.measured).words()));
    columns
}

fn claims(runs: &Runs) -> Vec<Claim> {
    let mut claims = Vec::new();
    claims.extend(SCHEMES.map(|curve| knee(runs, curve)));
    claims.extend(PAIRS.map(|(better, worse)| equal_deadband(runs, better, worse)));
    claims.extend(PAIRS.map(|(better, worse)| equal_rate(runs, better, worse)));
    claims.push(rate_at_30(runs));
    claims.push(rate_below_40(runs));
    claims.extend([50, 150].map(|ms| lower_bound(runs, ms)));
    claims.extend([Curve::Deadband, Curve::Hybrid(150)].map(|curve| opening(runs, curve)));
    claims.push(estimation_time());
    claims
}

/// How much steeper PMSE falls from 30 to 10 % than from 10 to 2.5 %: the difference of the exponents
/// d ln PMSE / d ln Delta.
fn knee(runs: &Runs, curve: Curve) -> Claim {
    let differences = runs.per_seed(|seed| {
        let ln = |deadband| Some(libm::log(runs.pmse(curve, deadband, seed)?));
        let steep = (ln(0.30)? - ln(0.10)?) / libm::log(3.0);
        let flat = (ln(0.10)? - ln(0.025)?) / libm::log(4.0);
        Some(steep - flat)
    });
    Claim {
        id: format!("knee, {}", curve.label()),
        statement: "PMSE falls steeply from 30 to 10 % and is nearly flat from 10 to 2.5 %",
        quantity: "exponent of PMSE over Delta from 30 to 10 % less that from 10 to 2.5 %",
        expected: "> 0".to_owned(),
        bound: Bound::Above(0.0),
        measured: Interval::of(differences),
    }
}

fn equal_deadband(runs: &Runs, better: Curve, worse: Curve) -> Claim {
    let ratios = runs.per_seed(|seed| {
        let pmse = |curve, deadband: &f64| runs.pmse(curve, *deadband, seed);
        let ratio = |deadband| Some(libm::log(pmse(better, deadband)? / pmse(worse, deadband)?));
        let logs: Option<Vec<f64>> = DEADBANDS.iter().map(ratio).collect();
        let logs = logs?;
        Some(libm::exp(logs.iter().sum::<f64>() / logs.len() as f64))
    });
    let (better, worse) = (better.label(), worse.label());
    Claim {
        id: format!("at equal deadband, {better} against {worse}"),
        statement: "at the same deadband parameter a shorter T_update gives a lower PMSE",
        quantity: "ratio of PMSE, geometric mean over the seven deadbands",
        expected: "< 1".to_owned(),
        bound: Bound::Below(1.0),
        measured: Interval::of_ratios(ratios),
    }
}

fn equal_rate(runs: &Runs, first: Curve, second: Curve) -> Claim {
    // of two hybrids the paper ranks the longer period first
    let (better, worse) = match (first, second) {
        (Curve::Hybrid(50), Curve::Hybrid(150)) => (second, first),
        pair => pair,
    };
    Claim {
        id: format!(
            "at equal rate, {} against {}",
            better.label(),
            worse.label()
        ),
        statement: "hybrid 150 ms performs best, hybrid 50 ms second, the deadband scheme last",
        quantity: "ratio of PMSE, geometric mean over the packet rates that both reach",
        expected: "< 1".to_owned(),
        bound: Bound::Below(1.0),
        measured: runs.ratio_at_equal_rate(better, worse),
    }
}

fn rate_at_30(runs: &Runs) -> Claim {
    let (low, high) = (60.0 * (1.0 - ABOUT), 60.0 * (1.0 + ABOUT));
    Claim {
        id: "rate at 30 %, hybrid 50 ms".to_owned(),
        statement: "the 50 ms scheme reaches a minimum of about 60 packets/s",
        quantity: "packets per second of the run",
        expected: format!("{low} to {high}"),
        bound: Bound::Within(low, high),
        measured: Interval::of(runs.rates(Curve::Hybrid(50), 0.30)),
    }
}

fn rate_below_40(runs: &Runs) -> Claim {
    Claim {
        id: "rate at 30 %, hybrid 150 ms".to_owned(),
        statement: "the 150 ms scheme reduces the rate to less than 40 packets/s",
        quantity: "packets per second of the run",
        expected: "< 40".to_owned(),
        bound: Bound::Below(40.0),
        measured: Interval::of(runs.rates(Curve::Hybrid(150), 0.30)),
    }
}

/// The least rate of any run; a bound is a bound on each, so it has no interval.
fn lower_bound(runs: &Runs, ms: u64) -> Claim {
    let rates = DEADBANDS.iter();
    let rates = rates.flat_map(|deadband| runs.rates(Curve::Hybrid(ms), *deadband));
    let bound = 1000.0 / ms as f64;
    Claim {
        id: format!("lower bound, hybrid {ms} ms"),
        statement: "the packet rate never falls below 1000 ms / T_update: 20 and about 7 packets/s",
        quantity: "least rate of any run",
        expected: format!(">= {bound:.1}"),
        // a run of whole periods and a rest sends one packet less than its length over T_update
        bound: Bound::Above(bound * 0.995),
        measured: rates
            .reduce(f64::min)
            .and_then(|least| Interval::of([least])),
    }
}

fn opening(runs: &Runs, curve: Curve) -> Claim {
    let ratios = runs.per_seed(|seed| {
        let run = runs.run(curve, 0.15, seed)?;
        let later = run.later_rate_hz.filter(|rate| *rate > 0.0)?;
        Some(run.opening_rate_hz.filter(|rate| *rate > 0.0)? / later)
    });
    Claim {
        id: format!("dense at the beginning, {}", curve.label()),
        statement: "packet rates are relatively high at the beginning (figs. 6 and 7)",
        quantity: "packets per contact second at 15 %: the first second of contact against the rest",
        expected: "> 1".to_owned(),
        bound: Bound::Above(1.0),
        measured: Interval::of_ratios(ratios),
    }
}

/// The one number that depends on the machine.
fn estimation_time() -> Claim {
    Claim {
        id: "estimation-time".to_owned(),
        statement: "estimation takes less than 1 ms",
        quantity: "CPU time of one tick of the paper's estimator on this machine, ms",
        expected: "< 1".to_owned(),
        bound: Bound::Below(1.0),
        measured: Interval::of([estimator_tick_ms(Mode::Paper)]),
    }
}

/// Each pair with the one first that is claimed to be better at an equal deadband.
const PAIRS: [(Curve, Curve); 3] = [
    (Curve::Hybrid(50), Curve::Deadband),
    (Curve::Hybrid(150), Curve::Deadband),
    (Curve::Hybrid(50), Curve::Hybrid(150)),
];
