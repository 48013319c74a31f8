//! What spaced repeats of updates and repeated samples in commands buy under loss, and what they cost.
//!
//! The live defaults over 50 ms one way, and the paper's best scheme, which sends more; only the repeats differ, so that
//! a seed meets the same operator, noise and network everywhere. It must never compare different seeds.

use mmt_netem::config::LinkConfig;
use mmt_server::repeats::Repeats;
use mmt_shared::channel::rate_control::StretchMax;
use mmt_shared::stats::values::quantile;

use super::loss::{Loss, link};
use crate::experiment::prelude::*;

/// One way.
const DELAY: &str = "delay 50ms";
/// When an update is repeated, ms.
const REPEATS_MS: [&[f64]; 3] = [&[], &[10.0], &[10.0, 30.0]];
/// Commands whose samples a command repeats.
const REPEAT_SAMPLES: [u8; 2] = [0, 1];

/// The default scheme, and the paper's best.
const CURVES: [Curve; 2] = [Curve::Useful(150), Curve::Hybrid(150)];
const DELTA: f64 = 0.10;

/// What repeats buy and cost: with these seeds, one update in a thousand is seen.
pub(super) const REPEATS: Experiment = Experiment::new(
    "repeats",
    "What repeats of updates and samples buy under loss, and cost",
    20,
    run,
);

/// A point of the grid.
struct Case {
    curve: Curve,
    loss: Loss,
    repeats: Repeats,
    repeat_samples: u8,
    world: WorldConfig,
}

type Group = grid::Group<Case, Measured>;

fn cases() -> Result<Vec<Case>, ExperimentError> {
    let mut cases = Vec::new();
    for (curve, loss) in CURVES
        .into_iter()
        .flat_map(|curve| Loss::ALL.map(|loss| (curve, loss)))
    {
        let link = link(DELAY, loss)?;
        for times in REPEATS_MS {
            let refused = |error| ExperimentError::network("repeats", error);
            let repeats = Repeats::try_new(times).map_err(refused)?;
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
    let world = WorldConfig::over(link.clone());
    let mut world = world.stretched(StretchMax::OFF, StretchMax::OFF);
    world.slave.trigger.scheme = curve.at(DELTA);
    world.slave.repeats_ms = repeats;
    world.repeat_samples = repeat_samples;
    world
}

/// Keeps `repeats.csv` and `repeats.svg`.
fn run(runner: &Runner, request: &Request) -> Result<Findings, ExperimentError> {
    let extent = request.extent;
    let groups = runner.trials("repeats", extent.seeds, cases()?, |case| {
        Trial::new(case.world.clone(), extent.duration)
    })?;
    let table = |title: &str, shown: fn(&Case) -> bool| {
        let rows = rows(&groups);
        let rows = rows.iter().filter(|row| shown(&row.group.case));
        Table::of(title, rows, &columns())
    };
    let all = table("Repeats over 50 ms one way", |_| true);
    runner.keep_table("repeats.csv", &all)?;
    runner.keep_figure("repeats.svg", &figure(&groups))?;
    let updates = table(
        "Repeats of updates, 50 ms one way: staleness, traffic, force error (ratio: over that without any repeats)",
        |case| case.repeat_samples == 0,
    );
    let samples = table(
        "Repeats of samples, 50 ms one way, updates repeated as by default",
        |case| case.repeats == Repeats::recommended(),
    );
    let configuration = groups.first().map(|group| group.case.world.clone());
    Ok(Findings {
        digest: digest(&groups),
        configuration: configuration.into_iter().collect(),
        tables: vec![
            updates.without(&NOT_OF_UPDATES),
            samples.selected(&OF_SAMPLES),
        ],
    })
}

/// Columns that repeated updates do not change.
const NOT_OF_UPDATES: [&str; 8] = [
    "repeat_samples",
    "datagrams_up_hz",
    "kbit_up_per_s",
    "stale_max_ms",
    "known_share",
    "pmse",
    "relative_error",
    "position_rms_mm",
];
/// Columns that show what repeated samples do.
const OF_SAMPLES: [&str; 9] = [
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

/// A group beside the one that differs in having no repeats at all.
struct Row<'a> {
    group: &'a Group,
    without: &'a Group,
}

fn rows(groups: &[Group]) -> Vec<Row<'_>> {
    let row = |group| {
        let bare = |other: &&Group| {
            let (case, group): (&Case, &Group) = (&other.case, group);
            let same = (case.curve, case.loss) == (group.case.curve, group.case.loss);
            same && case.repeats == Repeats::NONE && case.repeat_samples == 0
        };
        let without = groups.iter().find(bare).unwrap_or(group);
        Row { group, without }
    };
    groups.iter().map(row).collect()
}

#[rustfmt::skip]
fn columns<'a>() -> Vec<Column<'a, Row<'a>>> {
    let of_group: Vec<Column<Group>> = vec![
        column("scheme", "", 0, |group| group.case.curve.label()),
        column("loss", "", 0, |group| group.case.loss.name),
        column("repeats", "", 0, |group| group.case.repeats.to_string()),
        column("repeat_samples", "", 0, |group| u64::from(group.case.repeat_samples)),
        column("updates", "", 0, |group| group.runs.iter().map(|run| run.updates.total()).sum::<u64>()),
        column("repeated", "", 0, |group| group.runs.iter().map(|run| run.traffic.repeated.total()).sum::<u64>()),
        mean("datagrams_up_hz", "Hz", 1, |run| run.traffic.wire.up.rate_hz.get()),
        mean("datagrams_down_hz", "Hz", 1, |run| run.traffic.wire.down.rate_hz.get()),
        mean("kbit_up_per_s", "kbit/s", 1, |run| run.traffic.wire.up.bits_per_s.get().map(|bits| bits * 1e-3)),
        mean("kbit_down_per_s", "kbit/s", 1, |run| run.traffic.wire.down.bits_per_s.get().map(|bits| bits * 1e-3)),
        column("stale_p50_ms", "ms", 0, |group| stale_ms(group, 0.5)),
        column("stale_p99_ms", "ms", 0, |group| stale_ms(group, 0.99)),
        column("stale_p999_ms", "ms", 0, |group| stale_ms(group, 0.999)),
        column("stale_max_ms", "ms", 0, |group| stale_ms(group, 1.0)),
        mean("known_share", "", 4, |run| Some(run.force.samples? as f64 * 1e-3 / run.duration_s)),
        mean("pmse", "", 4, |run| run.force.pmse),
        mean("relative_error", "", 4, |run| run.force.relative_error),
    ];
    let of_group = of_group.into_iter();
    let mut columns: Vec<Column<Row>> = of_group
        .map(|column| column.of(|row: &Row| row.group))
        .collect();
    columns.extend(interval(
        ["error_ratio", "error_ratio_low", "error_ratio_high"],
        "",
        3,
        |row: &Row| row.group.ratio(row.without, |run| run.force.relative_error),
    ));
    columns.push(column("position_rms_mm", "mm", 2, |row| row.group.mean(|run| Some(run.position_rms_m? * 1e3))));
    columns
}

/// Staleness of all updates of all runs, rising.
fn times(runs: &[Measured]) -> Vec<Duration> {
    let of = runs.iter().flat_map(|run| run.staleness.iter().copied());
    let mut times: Vec<Duration> = of.collect();
    times.sort_unstable();
    times
}

fn stale_ms(group: &Group, share: f64) -> Option<f64> {
    let stale = quantile(&times(&group.runs), share);
    stale.map(|time| time.as_secs_f64() * 1e3)
}

/// A panel a loss: the share of updates of the chattier scheme that took longer than a time, without repeated samples.
fn figure(groups: &[Group]) -> Figure {
    let styles = [
        (Colour::VERMILION, Stroke::Solid),
        (Colour::BLUE, Stroke::Dashed),
        (Colour::BLACK, Stroke::Solid),
    ];
    let panels = Loss::ALL.into_iter().map(|loss| {
        let of = groups.iter().filter(|group| {
            let case = &group.case;
            case.curve == Curve::Hybrid(150) && case.loss == loss && case.repeat_samples == 0
        });
        let series = of.zip(styles).map(|(group, (colour, stroke))| {
            let label = group.case.repeats.to_string();
            Series::line(&label, colour, exceeded(times(&group.runs))).stroked(stroke, 2)
        });
        let title = match loss.words {
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
        let p95 = |runs: &[Measured]| quantile(&times(runs), 0.95).unwrap();
        let (without, with) = (p95(&none), p95(&updates));
        println!("95 % of updates within {without:?}, with repeats {with:?}");
        assert!(with < without.mul_f64(0.7));
        let known =
            |runs: &[Measured]| runs.iter().filter_map(|run| run.force.samples).sum::<u64>();
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
