//! Random worlds with one thing at a time ideal: which difficulty costs how much.

use mmt_netem::LinkConfig;
use mmt_netem::config::Delay;
use mmt_server::environment::SceneConfig;
use mmt_server::sensing::SensingConfig;
use mmt_server::slave::StartModel;
use mmt_server::trigger::Scheme;
use mmt_shared::stats::values::quantile;

use super::row::Row;
use super::run::reach;
use super::tables::share_above;
use crate::experiment::findings::Extent;
use crate::experiment::grid::Group;
use crate::experiment::prelude::*;
use crate::worlds::RandomWorld;

/// A difficulty, and what takes it away.
struct Ideal {
    name: &'static str,
    make: fn(&mut RandomWorld),
    /// From how much contact on the slave's estimator is given the true m, b and c of the body that is touched.
    truth: Option<Duration>,
}

const fn ideal(name: &'static str, make: fn(&mut RandomWorld)) -> Ideal {
    Ideal {
        name,
        make,
        truth: None,
    }
}

/// In this time of contact anybody could have found m, b and c.
const FOUND: Duration = Duration::from_millis(400);

const IDEALS: [Ideal; 12] = [
    ideal("nothing", |_| {}),
    ideal("the force sensor", |world| {
        let sensing = &mut world.config.slave.sensing;
        *sensing = SensingConfig {
            vision: sensing.vision,
            ..SensingConfig::default()
        };
    }),
    ideal("the contact's stiffness", |world| {
        world.config.slave.environment.contact = None;
        world.config.slave.tool_compliance = None;
    }),
    ideal("the hand: no tremor", |world| {
        world.config.operator.hand.tremor_m = 0.0;
    }),
    ideal("the network: no jitter, no loss", |world| {
        for link in [&mut world.config.up, &mut world.config.down] {
            *link = LinkConfig {
                delay: Delay::constant(link.delay.middle()),
                ..LinkConfig::default()
            };
        }
    }),
    ideal("the network: no delay either", |world| {
        world.config.up = LinkConfig::default();
        world.config.down = LinkConfig::default();
    }),
    ideal("the room: nothing in the way", |world| {
        world.config.slave.environment.wall = None;
        world.config.slave.scene = SceneConfig::default();
    }),
    ideal("the first model: m, b and c", known),
    Ideal {
        truth: Some(FOUND),
        ..ideal("each update after 0.4 s of contact", |_| {})
    },
    Ideal {
        truth: Some(Duration::ZERO),
        ..ideal("each update: m, b and c", |_| {})
    },
    Ideal {
        truth: Some(Duration::ZERO),
        ..ideal("first model and each update", known)
    },
    Ideal {
        truth: Some(Duration::ZERO),
        ..ideal("both, and an update in every tick", |world| {
            known(world);
            world.config.slave.trigger.scheme = Scheme::EverySample;
        })
    },
];

/// The local model begins with the object's m, b and c.
fn known(world: &mut RandomWorld) {
    let object = &world.config.slave.environment;
    let (mass_kg, damping_ns_per_m) = (object.mass_kg, object.damping_ns_per_m);
    let start = &mut world.config.slave.start;
    *start = StartModel {
        mass_kg,
        damping_ns_per_m,
        friction_n: world.friction_n,
        ..*start
    };
}

/// The relative errors of the movable worlds and their packets a second, each rising.
struct Reached {
    name: &'static str,
    errors: Vec<f64>,
    near: Vec<f64>,
    packets_hz: Vec<f64>,
}

/// The same worlds with one thing at a time ideal. Keeps `worlds-ideal.csv`.
pub(super) fn compare(
    runner: &Runner,
    extent: Extent,
    first: u64,
) -> Result<Findings, ExperimentError> {
    let cases = IDEALS.iter().collect();
    let groups = runner.grid_from(first, "worlds", extent.seeds, cases, |ideal: &&Ideal, n| {
        let mut world = RandomWorld::new(n);
        (ideal.make)(&mut world);
        let reached = reach(&world.config, ideal.truth, extent.duration)?;
        Ok(Row { world, reached })
    })?;
    let runs = groups.iter().flat_map(|group| &group.runs);
    let digest = crate::digest::of_runs(runs.map(|row| row.reached.digest.as_str()));
    let reached: Vec<Reached> = groups.iter().map(Reached::of).collect();
    let columns: [Column<Reached>; 6] = [
        column("ideal", "", 0, |of: &Reached| of.name),
        column("worlds", "", 0, |of| of.errors.len() as u64),
        column("median", "", 3, |of| median(&of.errors)),
        column("median_near", "", 3, |of| median(&of.near)),
        column("above_0.35", "", 3, |of| share_above(&of.errors, 0.35)),
        column("packet_rate_hz", "1/s", 2, |of| median(&of.packets_hz)),
    ];
    let title = format!(
        "One thing ideal: relative error of the movable of worlds {first} to {}",
        first + extent.seeds.saturating_sub(1)
    );
    let table = Table::of(title, &reached, &columns);
    runner.keep_table("worlds-ideal.csv", &table)?;
    Ok(Findings {
        digest,
        tables: vec![table],
        ..Findings::default()
    })
}

impl Reached {
    fn of(group: &Group<&Ideal, Row>) -> Self {
        let movable = || group.runs.iter().filter(|row| row.world.is_movable());
        let near = movable().filter(|row| row.world.round_trip_ms() <= 100.0);
        Self {
            name: group.case.name,
            errors: rising(movable().filter_map(|row| row.reached.relative_error)),
            near: rising(near.filter_map(|row| row.reached.relative_error)),
            packets_hz: rising(movable().filter_map(|row| row.reached.packets_hz)),
        }
    }
}

fn median(sorted: &[f64]) -> Option<f64> {
    quantile(sorted, 0.5)
}

fn rising(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values
}
