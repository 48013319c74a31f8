//! What spaced repeats of updates and repeated samples in commands buy under loss, and what they cost.
//!
//! The live defaults over 50 ms one way, and the paper's best scheme, which says more; only the repeats differ, so that
//! a seed meets the same operator, noise and network everywhere. It must never compare different seeds.

use std::time::Duration;

use mmt_netem::config::LinkConfig;
use mmt_server::link::Repeats;
use mmt_shared::channel::rate_control::StretchMax;
use mmt_shared::metrics::Staleness;

use super::delay::Loss;
use super::{Curve, Extent, Findings, Laboratory, ReproduceError, digest, nothing};
use crate::figure::{Axis, Colour, Dot, Figure, Legend, Panel, Series, Stroke};
use crate::statistics::Interval;
use crate::table::{Cell, Table};
use crate::trial::{Measured, Trial};
use crate::world::WorldConfig;

/// One way.
const DELAY: &str = "delay 50ms";
/// When an update is said again, ms.
const REPEATS_MS: [&[f64]; 3] = [&[], &[10.0], &[10.0, 30.0]];
/// Commands whose samples a command repeats.
const REPEAT_SAMPLES: [u8; 2] = [0, 1];

/// The default scheme, and the paper's best.
const CURVES: [Curve; 2] = [Curve::Useful(150), Curve::Hybrid(150)];
const DELTA: f64 = 0.10;

/// One place of the grid.
struct Case {
    curve: Curve,
    loss: Loss,
    repeats: Repeats,
    repeat_samples: u8,
    world: WorldConfig,
}

fn cases() -> Result<Vec<Case>, ReproduceError> {
    let refused = |why: String| ReproduceError::Network {
        name: "repeats".to_owned(),
        why,
    };
    let mut cases = Vec::new();
    for (curve, loss) in CURVES
        .into_iter()
        .flat_map(|curve| Loss::ALL.map(|loss| (curve, loss)))
    {
        let words = format!("{DELAY} {}", loss.words());
        let link: Result<LinkConfig, _> = words.trim().parse();
        let link =
            link.map_err(|error: mmt_netem::words::ParseError| refused(error.to_string()))?;
        for times in REPEATS_MS {
            let repeats = Repeats::try_new(times).map_err(|error| refused(error.to_string()))?;
            cases.extend(REPEAT_SAMPLES.map(|repeat_samples| Case {
                curve,
                loss,
                repeats,
                repeat_samples,
                world: world(curve, &link, repeats, repeat_samples),
            }));
        }
    }
    Ok(cases)
}

fn world(curve: Curve, link: &LinkConfig, repeats: Repeats, repeat_samples: u8) -> WorldConfig {
    let mut world = WorldConfig {
        up: link.clone(),
        down: link.clone(),
        repeat_samples,
        stretch_max: StretchMax::OFF,
        ..WorldConfig::default()
    };
    world.slave.trigger.scheme = curve.at(DELTA);
    world.slave.repeats_ms = repeats;
    world.slave.stretch_max = StretchMax::OFF;
    world
}

/// Runs the grid and keeps `repeats.csv` and `repeats.svg`.
///
/// # Errors
/// As [`Laboratory::run`] and [`Laboratory::keep`].
pub fn reproduce(laboratory: &dyn Laboratory, extent: Extent) -> Result<Findings, ReproduceError> {
    let cases = cases()?;
    let seeds = |case: &Case| {
        let world = case.world.clone();
        (1..=extent.seeds).map(move |seed| Trial::new(world.clone().seeded(seed), extent.duration))
    };
    let trials: Vec<Trial> = cases.iter().flat_map(seeds).collect();
    let measured = laboratory.run("repeats", &trials, &nothing)?;
    let runs: Vec<&[Measured]> = measured.chunks(extent.seeds.max(1) as usize).collect();
    let all = table("Repeats over 50 ms one way", &cases, &runs, |_| true);
    laboratory.keep("repeats.csv", &all.to_csv())?;
    let updates = table(
        "Repeats of updates, 50 ms one way: staleness, traffic, force error (ratio: over that without any repeats)",
        &cases,
        &runs,
        |case| case.repeat_samples == 0,
    );
    let samples = table(
        "Repeats of samples, 50 ms one way, updates repeated as by default",
        &cases,
        &runs,
        |case| case.repeats == Repeats::recommended(),
    );
    laboratory.keep_figure("repeats.svg", &figure(&cases, &runs))?;
    Ok(Findings {
        experiment: "repeats",
        extent,
        digest: digest(&measured),
        configuration: cases
            .iter()
            .map(|case| case.world.clone())
            .take(1)
            .collect(),
        tables: vec![updates.selected(&SHOWN), samples.selected(&SAMPLES_SHOWN)],
    })
}

/// The columns for people.
const SHOWN: [&str; 13] = [
    "scheme",
    "loss",
    "repeats",
    "updates",
    "repeated",
    "datagrams_down_hz",
    "kbit_down_per_s",
    "stale_p50_ms",
    "stale_p99_ms",
    "stale_p999_ms",
    "error_ratio",
    "error_ratio_low",
    "error_ratio_high",
];
const SAMPLES_SHOWN: [&str; 9] = [
    "scheme",
    "loss",
    "repeat_samples",
    "kbit_up_per_s",
    "known_share",
    "relative_error",
    "error_ratio",
    "error_ratio_low",
    "error_ratio_high",
];

fn table(
    title: &str,
    cases: &[Case],
    runs: &[&[Measured]],
    shown: impl Fn(&Case) -> bool,
) -> Table {
    let mut table = Table::new(
        title,
        &[
            ("scheme", 0),
            ("loss", 0),
            ("repeats", 0),
            ("repeat_samples", 0),
            ("updates", 0),
            ("repeated", 0),
            ("datagrams_up_hz", 1),
            ("datagrams_down_hz", 1),
            ("kbit_up_per_s", 1),
            ("kbit_down_per_s", 1),
            ("stale_p50_ms", 0),
            ("stale_p99_ms", 0),
            ("stale_p999_ms", 0),
            ("stale_max_ms", 0),
            ("known_share", 4),
            ("pmse", 4),
            ("relative_error", 4),
            ("error_ratio", 3),
            ("error_ratio_low", 3),
            ("error_ratio_high", 3),
            ("position_rms_mm", 2),
        ],
    );
    for (case, of) in cases.iter().zip(runs).filter(|(case, _)| shown(case)) {
        let none = |other: &Case| other.repeats == Repeats::NONE && other.repeat_samples == 0;
        let same = |other: &Case| other.curve == case.curve && other.loss == case.loss;
        let mut all = cases.iter().zip(runs);
        let without = all.find(|(other, _)| same(other) && none(other));
        let without = without.map_or(*of, |(_, runs)| runs);
        table.push(row(case, of, without));
    }
    table
}

fn row(case: &Case, runs: &[Measured], without: &[Measured]) -> Vec<Cell> {
    let mean = |of: &dyn Fn(&Measured) -> Option<f64>| {
        Cell::from(Interval::of(runs.iter().filter_map(of)).map(|interval| interval.mean))
    };
    let mut times = times(runs);
    let mut stale = |q| Staleness::quantile(&mut times, q).map(|time| time.as_secs_f64() * 1e3);
    let pairs = runs.iter().zip(without);
    let ratios = pairs.filter_map(|(with, without)| {
        let errors = with.force.relative_error.zip(without.force.relative_error);
        errors.map(|(with, without)| with / without)
    });
    let ratio = Interval::of_ratios(ratios);
    let repeated: u64 = runs.iter().map(|run| run.traffic.repeated.total()).sum();
    let known = |run: &Measured| run.force.samples as f64 * 1e-3 / run.duration_s;
    vec![
        case.curve.label().into(),
        case.loss.name().into(),
        case.repeats.to_string().into(),
        u64::from(case.repeat_samples).into(),
        runs.iter()
            .map(|run| run.updates.total())
            .sum::<u64>()
            .into(),
        repeated.into(),
        mean(&|run| run.traffic.wire.up.rate_hz.get()),
        mean(&|run| run.traffic.wire.down.rate_hz.get()),
        mean(&|run| run.traffic.wire.up.bits_per_s.get().map(|bits| bits * 1e-3)),
        mean(&|run| {
            run.traffic
                .wire
                .down
                .bits_per_s
                .get()
                .map(|bits| bits * 1e-3)
        }),
        stale(0.5).into(),
        stale(0.99).into(),
        stale(0.999).into(),
        stale(1.0).into(),
        mean(&|run| Some(known(run))),
        mean(&|run| run.force.pmse),
        mean(&|run| run.force.relative_error),
        ratio.map(|i| i.mean).into(),
        ratio.map(|i| i.low).into(),
        ratio.map(|i| i.high).into(),
        mean(&|run| run.position_rms_m.map(|m| m * 1e3)),
    ]
}

fn times(runs: &[Measured]) -> Vec<Duration> {
    runs.iter()
        .flat_map(|run| run.staleness.iter().copied())
        .collect()
}

/// A panel a loss: the share of updates of the chattier scheme that took longer than a time, without repeated samples.
fn figure(cases: &[Case], runs: &[&[Measured]]) -> Figure {
    let styles = [
        (Colour::Vermilion, Stroke::Solid),
        (Colour::Blue, Stroke::Dashed),
        (Colour::Black, Stroke::Solid),
    ];
    let panels = Loss::ALL.into_iter().map(|loss| {
        let of = cases.iter().zip(runs);
        let of = of.filter(|(case, _)| {
            case.curve == Curve::Hybrid(150) && case.loss == loss && case.repeat_samples == 0
        });
        let series = of.zip(styles).map(|((case, runs), (colour, stroke))| {
            Series::line(&case.repeats.to_string(), colour, exceeded(times(runs)))
                .stroked(stroke, 2)
        });
        let title = match loss.words() {
            "" => "no loss",
            words => words,
        };
        Panel::new(
            title,
            Axis::linear("time from sent to known, ms").over(0.0..400.0),
            Axis::log("share of updates that took longer").over(5e-4..1.0),
            series,
        )
    });
    Figure::of_alike(panels, Legend::UpperRight, 3, (360, 300))
}

/// The share of times above each time, as steps.
fn exceeded(mut times: Vec<Duration>) -> Vec<Dot> {
    times.sort_unstable();
    let all = times.len() as f64;
    let mut dots = vec![Dot::at(0.0, 1.0)];
    let mut above = times.len();
    for equal in times.chunk_by(|a, b| a == b) {
        let ms = equal.first().map_or(0.0, |time| time.as_secs_f64() * 1e3);
        dots.push(Dot::at(ms, above as f64 / all));
        above -= equal.len();
        dots.push(Dot::at(ms, above as f64 / all));
    }
    dots
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trial(words: &str, repeats: Repeats, repeat_samples: u8, seed: u64) -> Measured {
        let link: LinkConfig = words.parse().unwrap();
        let config = world(Curve::Hybrid(150), &link, repeats, repeat_samples);
        Trial::new(config.seeded(seed), Duration::from_secs(20))
            .run()
            .unwrap()
    }

    #[test]
    fn on_a_clean_path_repeats_change_nothing_but_the_traffic() {
        let plain = trial(DELAY, Repeats::NONE, 0, 1);
        let repeated = trial(DELAY, Repeats::recommended(), 1, 1);
        assert_eq!(plain.digest, repeated.digest);
        assert_eq!(plain.staleness, repeated.staleness);
        assert_eq!(plain.traffic.repeated.total(), 0);
        // each update twice, but where a newer one came before
        let (sent, again) = (repeated.updates.total(), repeated.traffic.repeated.total());
        assert!(2 * again > sent && again <= 2 * sent, "{again} of {sent}");
        let bits = |run: &Measured| run.traffic.wire.up.bits_per_s.get().unwrap();
        assert!(bits(&repeated) > 1.3 * bits(&plain), "samples go up twice");
        assert!(bits(&repeated) < 1.6 * bits(&plain), "headers do not");
    }

    #[test]
    fn under_loss_repeats_of_updates_shorten_the_tail_and_those_of_samples_complete_the_record() {
        let words = format!("{DELAY} loss 20%");
        let runs = |repeats, repeat_samples| -> Vec<Measured> {
            (1..=3)
                .map(|seed| trial(&words, repeats, repeat_samples, seed))
                .collect()
        };
        let (none, updates) = (runs(Repeats::NONE, 0), runs(Repeats::recommended(), 0));
        let p95 = |runs: &[Measured]| Staleness::quantile(&mut times(runs), 0.95).unwrap();
        let (without, with) = (p95(&none), p95(&updates));
        println!("95 % of updates within {without:?}, with repeats {with:?}");
        assert!(with < without.mul_f64(0.7));
        let known = |runs: &[Measured]| runs.iter().map(|run| run.force.samples).sum::<u64>();
        let both = runs(Repeats::recommended(), 1);
        let lost = 60_000 - known(&updates).min(60_000);
        let left = 60_000 - known(&both).min(60_000);
        println!("{lost} samples without f_m, with repeats {left}");
        assert!(2 * left < lost, "{left} of {lost}");
    }

    #[test]
    fn the_curve_of_the_figure_is_the_share_above_each_time() {
        let ms = Duration::from_millis;
        let dots = exceeded(vec![ms(60), ms(50), ms(50), ms(80)]);
        let expected = [
            (0.0, 1.0),
            (50.0, 1.0),
            (50.0, 0.5),
            (60.0, 0.5),
            (60.0, 0.25),
            (80.0, 0.25),
            (80.0, 0.0),
        ];
        let found: Vec<(f64, f64)> = dots.iter().map(|dot| (dot.x, dot.y)).collect();
        assert_eq!(found, expected);
    }
}
