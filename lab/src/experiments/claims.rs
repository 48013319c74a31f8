//! What section IV-B claims, measured here: each claim with a value, an interval and a verdict.
//!
//! Paper mode, as it is; nothing is tuned to make a claim hold. Differences are taken between runs of the same
//! seed, so that what the seeds have in common cancels.

mod runs;
mod verdict;

use std::collections::BTreeMap;

use crate::experiment::prelude::*;
use crate::io::estimator_tick_ms;
use crate::setting::{FIG5_CURVES, Point};
use runs::Runs;
use verdict::Bound;

/// The three schemes of the paper.
const SCHEMES: [Curve; 3] = [Curve::Deadband, Curve::Hybrid(50), Curve::Hybrid(150)];
/// A rate that the paper calls "about 60" is within this share of it.
const ABOUT: f64 = 0.25;

/// The claims; with fewer seeds, differences between the schemes are noise.
pub(super) const CLAIMS: Experiment = Experiment::new(
    "claims",
    "Every claim of section IV-B with value, interval and verdict",
    40,
    run,
);

/// One claim and what was measured of it.
struct Claim {
    /// A short name.
    id: String,
    /// The paper's statement.
    statement: &'static str,
    /// What was measured, in words.
    quantity: &'static str,
    /// Where the claim expects it.
    bound: Bound,
    /// None if no run could tell.
    measured: Option<Interval>,
}

/// Keeps `claims.json` and `claims.csv`.
fn run(runner: &Runner, request: &Request) -> Result<Findings, ExperimentError> {
    let extent = request.extent;
    let curves = FIG5_CURVES.into_iter();
    let curves = curves.filter(|(mode, _)| *mode == Mode::Paper);
    let groups = runner.trials("claims", extent.seeds, Point::of(curves), |point| {
        point.trial(extent.duration)
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
        column("expected", "", 0, |claim| claim.bound.to_string()),
    ];
    let measured = |claim: &Claim| claim.measured;
    columns.extend(interval(["value", "low", "high"], "", 4, measured));
    columns.push(column("verdict", "", 0, |claim| claim.bound.verdict(claim.measured).words()));
    columns
}

fn claims(runs: &Runs) -> Vec<Claim> {
    let mut claims = Vec::new();
    claims.extend(SCHEMES.map(|curve| Claim {
        id: format!("knee, {}", curve.label()),
        statement: "PMSE falls steeply from 30 to 10 % and is nearly flat from 10 to 2.5 %",
        quantity: "exponent of PMSE over Delta from 30 to 10 % less that from 10 to 2.5 %",
        bound: Bound::Above(0.0),
        measured: runs.knee(curve),
    }));
    claims.extend(PAIRS.map(|(better, worse)| Claim {
        id: format!(
            "at equal deadband, {} against {}",
            better.label(),
            worse.label()
        ),
        statement: "at the same deadband parameter a shorter T_update gives a lower PMSE",
        quantity: "ratio of PMSE, geometric mean over the seven deadbands",
        bound: Bound::Below(1.0),
        measured: runs.ratio_at_equal_deadband(better, worse),
    }));
    claims.extend(PAIRS.map(|pair| {
        // of two hybrids the paper ranks the longer period first
        let (better, worse) = match pair {
            (Curve::Hybrid(50), Curve::Hybrid(150)) => (pair.1, pair.0),
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
            bound: Bound::Below(1.0),
            measured: runs.ratio_at_equal_rate(better, worse),
        }
    }));
    let about_60 = Bound::Within(60.0 * (1.0 - ABOUT), 60.0 * (1.0 + ABOUT));
    let (reaches, reduces) = (
        "the 50 ms scheme reaches a minimum of about 60 packets/s",
        "the 150 ms scheme reduces the rate to less than 40 packets/s",
    );
    let rates = [(50, reaches, about_60), (150, reduces, Bound::Below(40.0))];
    claims.extend(rates.map(|(ms, statement, bound)| Claim {
        id: format!("rate at 30 %, hybrid {ms} ms"),
        statement,
        quantity: "packets per second of the run",
        bound,
        measured: Interval::of(runs.rates(Curve::Hybrid(ms), 0.30)),
    }));
    claims.extend([50, 150].map(|ms| Claim {
        id: format!("lower bound, hybrid {ms} ms"),
        statement: "the packet rate never falls below 1000 ms / T_update: 20 and about 7 packets/s",
        quantity: "least rate of any run",
        bound: Bound::AtLeast(1000.0 / ms as f64),
        measured: runs.least_rate(Curve::Hybrid(ms)),
    }));
    claims.extend([Curve::Deadband, Curve::Hybrid(150)].map(|curve| Claim {
        id: format!("dense at the beginning, {}", curve.label()),
        statement: "packet rates are relatively high at the beginning (figs. 6 and 7)",
        quantity: "packets per contact second at 15 %: the first second of contact against the rest",
        bound: Bound::Above(1.0),
        measured: runs.opening(curve),
    }));
    // the one number that depends on the machine
    claims.push(Claim {
        id: "estimation-time".to_owned(),
        statement: "estimation takes less than 1 ms",
        quantity: "CPU time of one tick of the paper's estimator on this machine, ms",
        bound: Bound::Below(1.0),
        measured: Interval::of([estimator_tick_ms(Mode::Paper)]),
    });
    claims
}

/// Each pair with the one first that is claimed to be better at an equal deadband.
const PAIRS: [(Curve, Curve); 3] = [
    (Curve::Hybrid(50), Curve::Deadband),
    (Curve::Hybrid(150), Curve::Deadband),
    (Curve::Hybrid(50), Curve::Hybrid(150)),
];
