//! Environments beyond the cube on plain ground: how soon the model follows, at what cost, with what error.
//!
//! Each scenario is the paper's experiment with one thing made otherwise, in both modes. Recovery is counted from
//! the change where there is one, else from the first touch, since the model starts wrong.

use mmt_server::environment::{Bounded, EnvironmentConfig, GroundPatch, Ripple, Shape, Wall};
use mmt_shared::model::geometry::Vec2;
use mmt_shared::model::settings::Mode;

use super::{
    Curve, Extent, Findings, Laboratory, ReproduceError, digest, mode_name, nothing, paper_world,
};
use crate::statistics::{Interval, median};
use crate::table::{Cell, Table};
use crate::trial::{Alteration, Change, Measured, Trial};
use crate::world::WorldConfig;

/// The cube's side, m: side errors are shares of it.
const SIDE_M: f64 = 0.36;

/// A named environment.
pub struct Scenario {
    /// Its name.
    pub name: &'static str,
    /// What is otherwise than in the default scenario.
    pub what: &'static str,
    apply: fn(&mut WorldConfig),
    change: Option<Alteration>,
}

/// All scenarios.
pub const SCENARIOS: [Scenario; 16] = [
    plain("cube", "the default scenario", |_| {}),
    plain("brick", "36 by 24 cm", |world| {
        shape(
            world,
            Shape::Brick {
                length_m: 0.36,
                width_m: 0.24,
            },
        );
    }),
    plain("disc", "36 cm across", |world| {
        shape(world, Shape::Disc { diameter_m: 0.36 });
    }),
    plain("polygon", "an irregular hexagon, 36 by 34 cm", |world| {
        shape(
            world,
            Shape::Polygon {
                vertices_m: hexagon(),
            },
        );
    }),
    plain("ripple", "friction varies by 30 % over 0.2 m", |world| {
        environment(world).ripple = Some(Ripple::default());
    }),
    plain("patches", "two strips of mu 0.20 and 0.45", |world| {
        environment(world).patches = strips();
    }),
    plain(
        "static-friction",
        "static friction 1.5 times the sliding one",
        |world| {
            environment(world).static_ratio = 1.5;
        },
    ),
    plain(
        "wall",
        "a wall that stops the first push, unknown to the model",
        |world| {
            environment(world).wall = Some(Wall {
                distance_m: 0.38,
                angle_rad: 0.0,
            });
        },
    ),
    plain("centre-of-mass", "3 cm off the centre", |world| {
        environment(world).centre_of_mass_m = Vec2::new(0.03, 0.0);
    }),
    plain("side-0", "the model has the true side", |world| {
        side_error(world, 0.00)
    }),
    plain("side-5", "the model's side is 5 % too long", |world| {
        side_error(world, 0.05)
    }),
    plain("side-10", "the model's side is 10 % too long", |world| {
        side_error(world, 0.10)
    }),
    plain("side-20", "the model's side is 20 % too long", |world| {
        side_error(world, 0.20)
    }),
    changing(
        "friction-step",
        "mu steps from 0.30 to 0.45 in the second push",
        Alteration::FrictionCoefficient(0.45),
    ),
    changing(
        "friction-drop",
        "mu steps from 0.30 to 0.15 in the second push",
        Alteration::FrictionCoefficient(0.15),
    ),
    changing(
        "mass-step",
        "m steps from 0.7 to 1.2 kg in the second push",
        Alteration::MassKg(1.2),
    ),
];

const fn plain(name: &'static str, what: &'static str, apply: fn(&mut WorldConfig)) -> Scenario {
    Scenario {
        name,
        what,
        apply,
        change: None,
    }
}

const fn changing(name: &'static str, what: &'static str, change: Alteration) -> Scenario {
    Scenario {
        name,
        what,
        apply: |_| {},
        change: Some(change),
    }
}

impl Scenario {
    /// The world of the scenario in a mode with a scheme.
    #[must_use]
    pub fn world(&self, mode: Mode, curve: Curve, deadband: f64) -> WorldConfig {
        let mut world = paper_world(mode, curve.at(deadband));
        (self.apply)(&mut world);
        world
    }

    /// What changes on the way.
    pub(crate) fn change(&self) -> Change {
        let (after_pushes, contact_s) = match self.change {
            Some(_) => (1, 1.0),
            None => (0, 0.0),
        };
        Change {
            after_pushes,
            contact_s,
            to: self.change.unwrap_or(Alteration::Nothing),
        }
    }
}

fn environment(world: &mut WorldConfig) -> &mut EnvironmentConfig {
    &mut world.slave.environment
}

fn shape(world: &mut WorldConfig, shape: Shape) {
    environment(world).shape = shape;
}

fn side_error(world: &mut WorldConfig, share: f64) {
    world.slave.start.side_m = SIDE_M * (1.0 + share);
}

fn hexagon() -> Bounded<Vec2, { mmt_server::environment::VERTICES_MAX }> {
    let corners = [
        (0.18, -0.06),
        (0.18, 0.09),
        (0.04, 0.17),
        (-0.15, 0.13),
        (-0.18, -0.05),
        (-0.02, -0.17),
    ];
    Bounded::try_new(&corners.map(|(x, y)| Vec2::new(x, y))).unwrap_or_default()
}

/// Strips across the way of the pushes, 10 cm wide, on both sides of the start.
pub(super) fn strips() -> Bounded<GroundPatch, { mmt_server::environment::PATCHES_MAX }> {
    let strip = |x: f64, mu: f64| GroundPatch {
        from_m: Vec2::new(x, -3.0),
        to_m: Vec2::new(x + 0.10, 3.0),
        friction_coefficient: mu,
    };
    let places = [(-0.45, 0.45), (-0.25, 0.20), (0.15, 0.45), (0.35, 0.20)];
    Bounded::try_new(&places.map(|(x, mu)| strip(x, mu))).unwrap_or_default()
}

/// The two modes with the schemes that they default to.
const MODES: [(Mode, Curve); 2] = [
    (Mode::Paper, Curve::Hybrid(150)),
    (Mode::Recommended, Curve::Useful(150)),
];

/// Runs every scenario in both modes and keeps `scenarios.csv`.
///
/// # Errors
/// As [`Laboratory::run`] and [`Laboratory::keep`].
pub fn reproduce(laboratory: &dyn Laboratory, extent: Extent) -> Result<Findings, ReproduceError> {
    let cases = || {
        SCENARIOS
            .iter()
            .flat_map(|scenario| MODES.map(|(mode, curve)| (scenario, mode, curve)))
    };
    let mut trials = Vec::new();
    for (scenario, mode, curve) in cases() {
        let world = scenario.world(mode, curve, 0.10);
        trials.extend((1..=extent.seeds).map(|seed| Trial {
            change: Some(scenario.change()),
            ..Trial::new(world.clone().seeded(seed), extent.duration)
        }));
    }
    let measured = laboratory.run("scenarios", &trials, &nothing)?;
    let mut table = Table::new(
        format!(
            "Scenarios, {} seeds: paper (hybrid 10 %, 150 ms) against recommended (useful 10 %, 150 ms)",
            extent.seeds
        ),
        &[
            ("scenario", 0),
            ("what", 0),
            ("mode", 0),
            ("recovered_share", 2),
            ("recovery_contact_s", 2),
            ("recovery_packets", 0),
            ("packet_rate_hz", 1),
            ("relative_error", 3),
            ("pmse", 4),
            ("pmse_magnitude", 4),
            ("position_rms_mm", 1),
            ("pushes", 1),
        ],
    );
    for ((scenario, mode, _), runs) in cases().zip(measured.chunks(extent.seeds.max(1) as usize)) {
        table.push(row(scenario, mode, runs));
    }
    laboratory.keep("scenarios.csv", &table.to_csv())?;
    let shown = table.selected(&[
        "scenario",
        "mode",
        "recovered_share",
        "recovery_contact_s",
        "recovery_packets",
        "packet_rate_hz",
        "relative_error",
        "pmse",
        "position_rms_mm",
    ]);
    Ok(Findings {
        experiment: "scenarios",
        extent,
        digest: digest(&measured),
        configuration: MODES
            .map(|(mode, curve)| paper_world(mode, curve.at(0.10)))
            .to_vec(),
        tables: vec![shown],
    })
}

fn row(scenario: &Scenario, mode: Mode, runs: &[Measured]) -> Vec<Cell> {
    let mean = |of: &dyn Fn(&Measured) -> Option<f64>| {
        Cell::from(Interval::of(runs.iter().filter_map(of)).map(|interval| interval.mean))
    };
    let recoveries = || runs.iter().filter_map(|run| run.recovery);
    let recovered = recoveries()
        .filter(|recovery| recovery.contact_s.is_some())
        .count();
    vec![
        scenario.name.into(),
        scenario.what.into(),
        mode_name(mode).into(),
        (recovered as f64 / recoveries().count() as f64).into(),
        median(recoveries().filter_map(|recovery| recovery.contact_s)).into(),
        median(recoveries().map(|recovery| recovery.updates as f64)).into(),
        mean(&|run| run.updates.rate_hz()),
        mean(&|run| run.force.relative_error),
        mean(&|run| run.force.pmse),
        mean(&|run| run.force.pmse_magnitude),
        mean(&|run| run.position_rms_m.map(|m| m * 1e3)),
        mean(&|run| Some(run.pushes as f64)),
    ]
}
