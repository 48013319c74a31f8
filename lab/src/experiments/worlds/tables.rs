//! The tables and the figure of random worlds.

use mmt_shared::stats::values::quantile;

use super::row::Row;
use crate::experiment::findings::Extent;
use crate::experiment::prelude::*;
use crate::table::Cell;

/// A pose that is off for no longer, s, is that of another body, of which a packet came late.
const LASTS_S: f64 = 0.05;
/// The worst that are shown.
const WORST: usize = 10;

#[rustfmt::skip]
pub(super) fn columns<'a>() -> Vec<Column<'a, Row>> {
    vec![
        column("world", "", 0, |row: &Row| row.world.number),
        column("mass_kg", "kg", 2, |row| row.world.config.slave.environment.mass_kg),
        column("friction_n", "N", 2, |row| row.world.friction_n),
        column("side_m", "m", 3, |row| row.world.config.slave.environment.side_m),
        column("k_p", "N/m", 0, |row| row.world.config.stiffness_n_per_m),
        column("delay_ms", "ms", 0, |row| row.world.delay_ms),
        column("obstacle", "", 0, |row| row.world.obstacle.name()),
        column("relative_error_true", "", 3, |row| row.reached.relative_error),
        column("relative_error", "", 3, |row| row.reached.measured_error),
        column("packet_rate_hz", "1/s", 2, |row| row.reached.packets_hz),
        column("contact_s", "s", 1, |row| row.reached.contact_s),
        column("pushes", "", 0, |row| row.reached.pushes),
        column("breaks_per_push", "", 2, |row| row.reached.breaks_per_push),
        column("pose_rms_mm", "mm", 1, |row| row.reached.pose_rms_m.map(mm)),
        column("pose_max_mm", "mm", 1, |row| mm(row.reached.pose_max_m)),
        column("pose_excess_mm", "mm", 1, |row| mm(row.reached.pose_excess_m)),
        column("pose_excess_s", "s", 3, |row| row.reached.pose_excess_s),
        column("pose_beyond_object_mm", "mm", 1, |row| mm(row.reached.pose_beyond_object_m)),
        column("injected_j", "J", 6, |row| row.reached.injected_j),
        column("work_excess_j", "J", 3, |row| row.reached.work_excess_j),
        column("energy_held_s", "s", 3, |row| row.reached.energy_held_s),
        column("opposed_share", "", 4, |row| row.reached.opposed_share),
        column("unpaired_share", "", 4, |row| row.reached.unpaired_share),
        column("force_peak_n", "N", 2, |row| row.reached.force_peak_n),
        column("broken", "", 0, |row| row.reached.broken.clone()),
    ]
}

fn mm(metres: f64) -> f64 {
    metres * 1e3
}

/// A part of the worlds, and a number of each.
struct Part {
    part: &'static str,
    measure: &'static str,
    sorted: Vec<f64>,
}

type Choice = (&'static str, fn(&Row) -> bool);
type Measure = (&'static str, fn(&Row) -> Option<f64>);

const PARTS: [Choice; 4] = [
    ("movable", |row| row.world.is_movable()),
    ("movable, round trip to 100 ms", |row| {
        row.world.is_movable() && row.world.round_trip_ms() <= 100.0
    }),
    ("movable, nothing in the way", |row| {
        row.world.is_movable() && row.world.obstacle.name() == "none"
    }),
    ("immovable", |row| !row.world.is_movable()),
];

const MEASURES: [Measure; 8] = [
    ("relative_error_true", |row| row.reached.relative_error),
    ("packet_rate_hz", |row| row.reached.packets_hz),
    ("breaks_per_push", |row| row.reached.breaks_per_push),
    ("pose_rms_mm", |row| row.reached.pose_rms_m.map(mm)),
    ("pose_max_mm", |row| Some(mm(row.reached.pose_max_m))),
    ("injected_j", |row| Some(row.reached.injected_j)),
    ("work_excess_j", |row| Some(row.reached.work_excess_j)),
    ("unpaired_share", |row| row.reached.unpaired_share),
];

fn sorted(rows: &[Row], chosen: fn(&Row) -> bool, of: fn(&Row) -> Option<f64>) -> Vec<f64> {
    let mut values: Vec<f64> = rows
        .iter()
        .filter(|row| chosen(row))
        .filter_map(of)
        .collect();
    values.sort_by(f64::total_cmp);
    values
}

/// Quantiles of each measure in each part.
pub(super) fn distribution(rows: &[Row], first: u64, extent: Extent) -> Table {
    let parts: Vec<Part> = PARTS
        .iter()
        .flat_map(|(part, chosen)| {
            MEASURES.iter().map(|(measure, of)| Part {
                part,
                measure,
                sorted: sorted(rows, *chosen, *of),
            })
        })
        .collect();
    let title = format!(
        "Random worlds {first} to {}, {} s each",
        first + extent.seeds.saturating_sub(1),
        extent.duration.as_secs()
    );
    let at = |share: f64| move |part: &Part| quantile(&part.sorted, share);
    let columns: Vec<Column<Part>> = vec![
        column("part", "", 0, |part: &Part| part.part),
        column("measure", "", 0, |part| part.measure),
        column("worlds", "", 0, |part| part.sorted.len() as u64),
        Column::new("p5", "", 3, move |part| Cell::from(at(0.05)(part))),
        Column::new("p25", "", 3, move |part| Cell::from(at(0.25)(part))),
        Column::new("median", "", 3, move |part| Cell::from(at(0.5)(part))),
        Column::new("p75", "", 3, move |part| Cell::from(at(0.75)(part))),
        Column::new("p95", "", 3, move |part| Cell::from(at(0.95)(part))),
        Column::new("most", "", 3, move |part| Cell::from(at(1.0)(part))),
    ];
    Table::of(title, &parts, &columns)
}

/// The share of rising values above `most`; none without values.
pub(super) fn share_above(sorted: &[f64], most: f64) -> Option<f64> {
    let above = sorted.len() - sorted.partition_point(|value| *value <= most);
    (!sorted.is_empty()).then(|| above as f64 / sorted.len() as f64)
}

/// A target and what was reached.
struct Target {
    target: &'static str,
    wanted: f64,
    reached: Option<f64>,
}

/// The targets, each with what was reached.
pub(super) fn targets(rows: &[Row]) -> Table {
    let [(_, movable), (_, near), _, _] = PARTS;
    let error: fn(&Row) -> Option<f64> = |row| row.reached.relative_error;
    let all: fn(&Row) -> bool = |_| true;
    let share = |chosen: fn(&Row) -> bool, of: fn(&Row) -> Option<f64>, most: f64| {
        share_above(&sorted(rows, chosen, of), most)
    };
    let median = |chosen| quantile(&sorted(rows, chosen, error), 0.5);
    let broken: fn(&Row) -> Option<f64> =
        |row| Some(f64::from(u8::from(!row.reached.broken.is_empty())));
    #[rustfmt::skip]
    let targets = [
        Target { target: "median relative error, movable", wanted: 0.15, reached: median(movable) },
        Target { target: "median relative error, movable, round trip to 100 ms", wanted: 0.12, reached: median(near) },
        Target { target: "share of the movable with a relative error above 0.35", wanted: 0.02, reached: share(movable, error, 0.35) },
        Target { target: "share of all with a pose error above 0.1 m + the hand's way in a round trip", wanted: 0.0, reached: share(all, |row| Some(row.reached.pose_excess_m), 0.0) },
        Target { target: "share of all with tool work above hand work + budget", wanted: 0.0, reached: share(all, |row| Some(row.reached.work_excess_j), 1e-6) },
        Target { target: "share of all with energy injected by updates", wanted: 0.0, reached: share(all, |row| Some(row.reached.injected_j), 1e-6) },
        Target { target: "share of all in which f_m opposes the true force for 1 % of the time", wanted: 0.0, reached: share(all, |row| row.reached.opposed_share, 0.01) },
        Target { target: "share of all in which an invariant is broken", wanted: 0.0, reached: share(all, broken, 0.5) },
    ];
    let columns: [Column<Target>; 4] = [
        column("target", "", 0, |target: &Target| target.target),
        column("at_most", "", 3, |target| target.wanted),
        column("reached", "", 3, |target| target.reached),
        column("met", "", 0, |target| {
            if target
                .reached
                .is_some_and(|reached| reached <= target.wanted)
            {
                "yes"
            } else {
                "no"
            }
        }),
    ];
    Table::of("Targets", &targets, &columns)
}

/// A count of worlds.
struct Count {
    of: &'static str,
    worlds: u64,
}

/// The worlds that break the target of pose, and what of them nobody could know sooner.
pub(super) fn poses(rows: &[Row]) -> Table {
    let broken = |row: &&Row| row.reached.pose_excess_m > 0.0;
    let beyond = |row: &&Row| row.reached.pose_beyond_object_m > 0.0;
    let lasts = |row: &&Row| row.reached.pose_excess_s > LASTS_S;
    let worlds = |chosen: &dyn Fn(&&Row) -> bool| rows.iter().filter(chosen).count() as u64;
    #[rustfmt::skip]
    let counts = [
        Count { of: "pose error above 0.1 m + the hand's way in a round trip", worlds: worlds(&broken) },
        Count { of: "of these: above 0.1 m + the object's way in it, too", worlds: worlds(&|row| broken(row) && beyond(row)) },
        Count { of: "of those: for more than 50 ms in all", worlds: worlds(&|row| broken(row) && beyond(row) && lasts(row)) },
    ];
    let columns: [Column<Count>; 2] = [
        column("of", "", 0, |count: &Count| count.of),
        column("worlds", "", 0, |count| count.worlds),
    ];
    Table::of("Poses that are off", &counts, &columns)
}

/// The ten movable worlds with the largest error, each with what runs it again with these `options`.
pub(super) fn worst(rows: &[Row], options: &str) -> Table {
    let mut worst: Vec<&Row> = rows.iter().filter(|row| row.world.is_movable()).collect();
    worst.sort_by(|a, b| {
        let error = |row: &Row| row.reached.relative_error.unwrap_or_default();
        error(b).total_cmp(&error(a))
    });
    worst.truncate(WORST);
    #[rustfmt::skip]
    let columns: Vec<Column<&Row>> = vec![
        column("relative_error_true", "", 3, |row: &&Row| row.reached.relative_error),
        column("friction_n", "N", 2, |row: &&Row| row.world.friction_n),
        column("delay_ms", "ms", 0, |row: &&Row| row.world.delay_ms),
        column("obstacle", "", 0, |row: &&Row| row.world.obstacle.name()),
        column("pose_rms_mm", "mm", 1, |row: &&Row| row.reached.pose_rms_m.map(mm)),
        Column::new("again", "", 0, |row: &&Row| Cell::from(format!("mmt reproduce worlds --world {}{options}", row.world.number))),
    ];
    Table::of("The worst ten", &worst, &columns)
}

/// Share of the worlds below each relative error.
pub(super) fn figure(rows: &[Row]) -> Figure {
    let [(all, movable), (near, chosen), ..] = PARTS;
    let of = [
        (all, movable, Colour::BLUE),
        (near, chosen, Colour::VERMILION),
    ];
    let series = of.map(|(label, chosen, colour)| {
        let values = sorted(rows, chosen, |row| row.reached.relative_error);
        let worlds = values.len() as f64;
        let dots = values.iter().enumerate();
        let dots = dots
            .map(|(n, error)| Dot::at(*error, (n + 1) as f64 / worlds))
            .collect();
        Series::line(label, colour, dots)
    });
    let panel = Panel::new(
        "Random worlds",
        Axis::linear("relative error against the true force"),
        Axis::linear("share of the worlds"),
        series,
    );
    Figure::of_alike([panel], Legend::LowerRight, 1, (560, 420))
}
