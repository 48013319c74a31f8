//! What section IV-B claims, measured here: each claim with a value, an interval and a verdict.
//!
//! Paper mode, as it is; nothing is tuned to make a claim hold. Differences are taken between runs of the same
//! seed, so that what the seeds have in common cancels.

mod runs;
mod verdict;

use std::collections::BTreeMap;

use crate::experiment::prelude::*;
use crate::io::estimator_tick_ms;
use crate::setting::Point;
pub(super) use runs::Runs;
pub(super) use verdict::Verdict;
use verdict::{Bound, judge};

/// The three schemes of the paper.
const SCHEMES: [Curve; 3] = [Curve::Deadband, Curve::Hybrid(50), Curve::Hybrid(150)];
/// What the paper states of the knee.
const KNEE: &str = "PMSE falls steeply from 30 to 10 % and is nearly flat from 10 to 2.5 %";
/// A rate that the paper calls "about 60" is within this share of it.
const ABOUT: f64 = 0.25;

/// The claims; with fewer seeds, differences between the schemes are noise.
pub(super) const CLAIMS: Experiment = Experiment::new(
    "claims",
    "Every claim of section IV-B with value, interval and verdict",
    40,
    run,
);

/// What is expected of a quantity.
#[derive(Clone, Copy)]
enum Expected {
    /// A claim of the paper, which is tested.
    Claimed(Bound),
    /// What follows from how the system is made: kept or broken.
    Kept(Bound),
    /// Nothing: the paper names no number.
    Nothing,
}

/// A quantity that the paper speaks of, and what was measured of it.
pub(super) struct Claim {
    /// A short name.
    pub(super) id: String,
    /// The paper's statement.
    statement: &'static str,
    /// What was measured, in words.
    quantity: &'static str,
    expected: Expected,
    /// None if no run could show it.
    pub(super) measured: Option<Interval>,
}

/// A claim with its p-value after Holm's correction, and its verdict in a word.
struct Judged {
    claim: Claim,
    p: Option<f64>,
    verdict: &'static str,
}

/// Keeps `claims.json` and `claims.csv`.
fn run(runner: &Runner, request: &Request) -> Result<Findings, ExperimentError> {
    let extent = request.extent;
    let groups = runner.trials("claims", extent.seeds, points(), |point| {
        point.trial(extent.duration)
    })?;
    let runs = Runs {
        groups: &groups,
        seeds: extent.seeds,
    };
    let title = format!("Claims of section IV-B, {} seeds, paper mode", extent.seeds);
    let mut claims = claims(&runs);
    // the one number that depends on the machine
    claims.push(Claim {
        id: "estimation-time".to_owned(),
        statement: "estimation takes less than 1 ms",
        quantity: "CPU time of one tick of the paper's estimator on this machine, ms",
        expected: Expected::Kept(Bound::Below(1.0)),
        measured: Interval::of([estimator_tick_ms(Mode::Paper)]),
    });
    let table = Table::of(title, &judged(claims), &columns());
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

/// The three schemes of the paper at each of its deadbands.
pub(super) fn points() -> Vec<Point> {
    Point::of(SCHEMES.map(|curve| (Mode::Paper, Senses::Touch, curve)))
}

/// The verdict on each claim that is tested; none on what is kept or only measured.
pub(super) fn verdicts(claims: &[Claim]) -> Vec<Option<(Option<f64>, Verdict)>> {
    let tested = claims.iter().filter_map(|claim| match claim.expected {
        Expected::Claimed(bound) => Some((bound, claim.measured)),
        Expected::Kept(_) | Expected::Nothing => None,
    });
    let mut tested = judge(&tested.collect::<Vec<_>>()).into_iter();
    let verdict = |claim: &Claim| {
        let is_tested = matches!(claim.expected, Expected::Claimed(_));
        is_tested.then(|| tested.next()).flatten()
    };
    claims.iter().map(verdict).collect()
}

fn judged(claims: Vec<Claim>) -> Vec<Judged> {
    let verdicts = verdicts(&claims);
    let claims = claims.into_iter().zip(verdicts);
    let judged = claims.map(|(claim, verdict)| Judged {
        p: verdict.and_then(|(p, _)| p),
        verdict: match (claim.expected, verdict) {
            (Expected::Kept(bound), _) if bound.is_kept(claim.measured) => "kept",
            (Expected::Kept(_), _) => "broken",
            (_, Some((_, verdict))) => verdict.word(),
            (_, None) => "",
        },
        claim,
    });
    judged.collect()
}

#[rustfmt::skip]
fn columns<'a>() -> Vec<Column<'a, Judged>> {
    let mut columns: Vec<Column<Judged>> = vec![
        column("claim", "", 0, |row| row.claim.id.clone()),
        column("kind", "", 0, |row| match row.claim.expected {
            Expected::Claimed(_) => "claim",
            Expected::Kept(_) => "check",
            Expected::Nothing => "measure",
        }),
        column("statement", "", 0, |row| row.claim.statement),
        column("quantity", "", 0, |row| row.claim.quantity),
        column("expected", "", 0, |row| match row.claim.expected {
            Expected::Claimed(bound) | Expected::Kept(bound) => bound.to_string(),
            Expected::Nothing => String::new(),
        }),
    ];
    let measured = |row: &Judged| row.claim.measured;
    columns.extend(interval(["value", "low", "high"], "", 4, measured));
    columns.push(column("p", "", 4, |row| row.p));
    columns.push(column("verdict", "", 0, |row| row.verdict));
    columns
}

/// Everything that the paper claims of its schemes.
pub(super) fn claims(runs: &Runs) -> Vec<Claim> {
    let mut claims = of_errors(runs);
    claims.extend(of_rates(runs));
    claims.extend(of_curves(runs));
    claims
}

/// What it claims of the PMSE.
fn of_errors(runs: &Runs) -> Vec<Claim> {
    let mut claims = Vec::new();
    claims.extend(SCHEMES.map(|curve| Claim {
        id: format!("knee, {}", curve.label()),
        statement: KNEE,
        quantity: "exponent of PMSE over Delta from 30 to 10 % less that from 10 to 2.5 %",
        expected: Expected::Claimed(Bound::Above(0.0)),
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
        expected: Expected::Claimed(Bound::LessThanEqual),
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
            expected: Expected::Claimed(Bound::LessThanEqual),
            measured: runs.ratio_at_equal_rate(better, worse),
        }
    }));
    claims
}

/// What it claims of the packet rates.
fn of_rates(runs: &Runs) -> Vec<Claim> {
    let mut claims = Vec::new();
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
        expected: Expected::Claimed(bound),
        measured: Interval::of(runs.rates(Curve::Hybrid(ms), 0.30)),
    }));
    claims.extend([50, 150].map(|ms| Claim {
        id: format!("lower bound, hybrid {ms} ms"),
        statement: "the packet rate never falls below 1000 ms / T_update: 20 and about 7 packets/s",
        quantity: "least rate of any run",
        expected: Expected::Kept(Bound::AtLeast(1000.0 / ms as f64)),
        measured: runs.least_rate(Curve::Hybrid(ms)),
    }));
    claims.extend([Curve::Deadband, Curve::Hybrid(150)].map(|curve| Claim {
        id: format!("dense at the beginning, {}", curve.label()),
        statement: "packet rates are relatively high at the beginning (figs. 6 and 7)",
        quantity: "packets per contact second at 15 %: the first second of contact against the rest",
        expected: Expected::Claimed(Bound::MoreThanEqual),
        measured: runs.opening(curve),
    }));
    claims
}

/// How the PMSE runs over the deadband, of which the paper names no number.
fn of_curves(runs: &Runs) -> Vec<Claim> {
    let mut claims = Vec::new();
    let slopes = [
        (
            "flat",
            "exponent of PMSE over Delta from 2.5 to 10 %",
            [0.025, 0.10],
        ),
        (
            "steep",
            "exponent of PMSE over Delta from 10 to 30 %",
            [0.10, 0.30],
        ),
    ];
    claims.extend(slopes.into_iter().flat_map(|(name, quantity, deadbands)| {
        SCHEMES.map(|curve| Claim {
            id: format!("{name} part, {}", curve.label()),
            statement: KNEE,
            quantity,
            expected: Expected::Nothing,
            measured: runs.slope(curve, deadbands),
        })
    }));
    claims.extend(SCHEMES.map(|curve| Claim {
        id: format!("place of the knee, {}", curve.label()),
        statement: "a deadband of about 10 % is a good choice",
        quantity: "Delta at which the two best lines through PMSE over Delta meet, on logarithmic axes",
        expected: Expected::Nothing,
        measured: runs.place_of_knee(curve),
    }));
    claims
}

/// Each pair with the one first that is claimed to be better at an equal deadband.
const PAIRS: [(Curve, Curve); 3] = [
    (Curve::Hybrid(50), Curve::Deadband),
    (Curve::Hybrid(150), Curve::Deadband),
    (Curve::Hybrid(50), Curve::Hybrid(150)),
];
