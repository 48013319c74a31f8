//! Whether the recommended mode is worth its name on every scenario, not on boxes alone.
//!
//! The trials of `mmt reproduce scenarios`, fewer and shorter.

use super::super::*;
use crate::experiments::scenarios::{SCENARIOS, Scenario};
use crate::setting::Curve;
use crate::statistics::Interval;
use crate::trial::{Measured, Trial};
use mmt_shared::model::settings::Mode;

const SEEDS: std::ops::RangeInclusive<u64> = 1..=3;
const SECONDS: u64 = 20;
/// Highest relative error and packet rate, 1/s, where the square that the slave begins with is far from the
/// object. The brick's is mostly that of first touches: its unknown faces are up to 8 cm too far out. At the wall the time
/// in which the tool is held back does not count, so what is left is the way there.
const OTHERS: [(&str, f64, f64); 4] = [
    ("brick", 0.36, 5.0),
    ("disc", 0.20, 10.0),
    ("polygon", 0.26, 10.0),
    ("wall", 0.27, 10.0),
];
/// The same for all the others.
const BOX: (f64, f64) = (0.19, 5.0);

/// What the runs of a scenario come to on average.
struct Found {
    relative_error: f64,
    rate_hz: f64,
    position_mm: f64,
    pushes: u64,
}

fn measured(scenario: &Scenario, mode: Mode, curve: Curve) -> Found {
    let run = |seed| {
        let world = scenario.world(mode, curve, 0.10).seeded(seed);
        let trial = Trial {
            change: Some(scenario.change()),
            ..Trial::new(world, Duration::from_secs(SECONDS))
        };
        trial.run().unwrap()
    };
    let runs: Vec<Measured> = SEEDS.map(run).collect();
    let mean = |of: fn(&Measured) -> Option<f64>| {
        let interval = Interval::of(runs.iter().filter_map(of)).unwrap();
        assert_eq!(interval.n, runs.len());
        interval.mean
    };
    Found {
        relative_error: mean(|run| run.force.relative_error),
        rate_hz: mean(|run| run.updates.rate_hz()),
        position_mm: mean(|run| run.position_rms_m.map(|m| m * 1e3)),
        pushes: runs.iter().map(|run| run.pushes).min().unwrap(),
    }
}

#[test]
fn recommended_is_no_worse_than_paper_on_any_scenario_and_good_on_boxes() {
    for scenario in &SCENARIOS {
        let name = scenario.name;
        let paper = measured(scenario, Mode::Paper, Curve::Hybrid(150));
        let found = measured(scenario, Mode::Recommended, Curve::Useful(150));
        println!(
            "{name}: relative error {:.3} (paper {:.3}), {:.1} packets/s ({:.0}), {:.1} mm ({:.0}), at least {} pushes ({})",
            found.relative_error,
            paper.relative_error,
            found.rate_hz,
            paper.rate_hz,
            found.position_mm,
            paper.position_mm,
            found.pushes,
            paper.pushes,
        );
        assert!(found.relative_error <= paper.relative_error, "{name}");
        let other = OTHERS.iter().find(|(other, ..)| *other == name);
        let (error, rate) = other.map_or(BOX, |(_, error, rate)| (*error, *rate));
        assert!(
            found.relative_error <= error && found.rate_hz <= rate,
            "{name}"
        );
        assert!(found.pushes >= 1, "{name}: jammed");
    }
}
