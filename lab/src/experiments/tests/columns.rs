//! A column shows what its key names.

use mmt_shared::model::geometry::Vec2;

use super::*;
use crate::experiment::grid::Run;
use crate::setting::{Curve, Point, Senses};
use crate::table::{Cell, Column};
use crate::trial::{Measured, Trial};

/// What the columns of a run of fig. 5 must show of its samples, by (13) to (15).
fn recomputed(run: &Run<Point, Measured>) -> BTreeMap<&'static str, Cell> {
    let rows = &run.measured.trace;
    let pairs = rows.iter().filter_map(|row| Some((row.f_s, row.f_m?)));
    let pairs: Vec<_> = pairs.collect();
    let felt = |f: f64| f > 0.04;
    let pmse = |of: fn(&Vec2) -> f64| {
        let both = pairs
            .iter()
            .map(|(f_s, f_m)| (of(f_s).abs(), of(f_m).abs()));
        let logs = both.filter(|(s, m)| felt(*s) && felt(*m));
        mmt_shared::stats::values::mean(logs.map(|(s, m)| libm::log(s / m).powi(2)))
    };
    let (x, y) = (pmse(|f| f.x), pmse(|f| f.y));
    let touching = pairs
        .iter()
        .filter(|(s, m)| felt(s.norm()) || felt(m.norm()));
    let touching: Vec<_> = touching.collect();
    let sum = |of: fn(&(_, _)) -> f64| touching.iter().map(|pair| of(pair)).sum::<f64>();
    type Pair = (Vec2, Vec2);
    let error: fn(&Pair) -> f64 = |(s, m)| (s - m).norm_squared();
    let force: fn(&Pair) -> f64 = |(s, _)| s.norm_squared();
    let outside: fn(&Pair) -> f64 = |(s, m)| f64::from((s - m).norm() > 0.07 * s.norm());
    let duration_s = rows.len() as f64 * 1e-3;
    let packets = rows.iter().filter(|row| row.update.is_some()).count() as u64;
    let contact_s = run.measured.contact_s;
    BTreeMap::from([
        ("mode", Cell::from("paper")),
        ("scheme", "hybrid".into()),
        ("t_update_ms", 150_u64.into()),
        ("deadband", 0.15.into()),
        ("seed", 3_u64.into()),
        ("duration_s", duration_s.into()),
        ("packet_rate_hz", (packets as f64 / duration_s).into()),
        (
            "contact_packet_rate_hz",
            (packets as f64 / contact_s).into(),
        ),
        ("pmse", (x.unwrap() + y.unwrap()).into()),
        ("pmse_x", x.into()),
        ("pmse_y", y.into()),
        ("pmse_magnitude", pmse(|f| f.norm()).into()),
        ("relative_error", (sum(error) / sum(force)).sqrt().into()),
        ("jnd7_share", (sum(outside) / touching.len() as f64).into()),
        ("packets", packets.into()),
        ("contact_s", contact_s.into()),
        ("sensing", "touch".into()),
    ])
}

/// The first column that shows something else than the samples.
fn wrong<'a>(
    columns: &[Column<'a, Run<'a, Point, Measured>>],
    run: &Run<'a, Point, Measured>,
    expected: &BTreeMap<&str, Cell>,
) -> Option<&'static str> {
    let same = |a: &Cell, b: &Cell| match (a, b) {
        (Cell::Number(a), Cell::Number(b)) => (a - b).abs() < 1e-9 * b.abs().max(1.0),
        (a, b) => a == b,
    };
    let differs = |column: &&Column<_>| !same(&column.cell(run), &expected[column.key]);
    columns.iter().find(differs).map(|column| column.key)
}

#[test]
fn columns_show_what_the_samples_are_and_two_that_are_swapped_are_seen() {
    let point = Point {
        mode: Mode::Paper,
        senses: Senses::Touch,
        curve: Curve::Hybrid(150),
        deadband: 0.15,
    };
    let trial = Trial {
        traced: true,
        ..point.trial(Duration::from_secs(6)).seeded(3)
    };
    let measured = trial.run().unwrap();
    let run = Run {
        case: &point,
        seed: 3,
        measured: &measured,
    };
    let expected = recomputed(&run);
    let columns = fig5::columns();
    assert_eq!(wrong(&columns, &run, &expected), None);
    for k in 0..columns.len() {
        for other in 0..k {
            let mut swapped = fig5::columns();
            // the functions trade places, the keys stay
            swapped.swap(k, other);
            let (first, second) = (columns[other].key, columns[k].key);
            (swapped[other].key, swapped[k].key) = (first, second);
            let seen = wrong(&swapped, &run, &expected);
            assert!(seen.is_some(), "{first} and {second} swapped");
        }
    }
}

#[test]
fn a_key_ends_with_its_unit() {
    let ending = |unit: &str| match unit {
        "ms" => "_ms",
        "s" => "_s",
        "Hz" => "_hz",
        _ => "",
    };
    let columns = fig5::columns();
    let keys = columns.iter().map(|column| (column.key, column.unit));
    let measures = crate::sweep::columns();
    let keys = keys.chain(measures.iter().map(|column| (column.key, column.unit)));
    for (key, unit) in keys {
        assert!(key.ends_with(ending(unit)), "{key} is in {unit}");
    }
}
