//! Environments beyond the cube on plain ground: how soon the model follows, at what cost, with what error.
//!
//! Each scenario is the paper's experiment with one thing made otherwise, in both modes. Recovery is counted from
//! the change where there is one, else from the first touch, since the model starts wrong.

use mmt_server::environment::{Bounded, EnvironmentConfig, GroundPatch, Ripple, Shape, Wall};
use mmt_shared::model::geometry::Vec2;

use super::recovery;
use crate::experiment::prelude::*;
use crate::trial::{Alteration, Change};

/// The scenarios in both modes.
pub(super) const EXPERIMENT: Experiment = Experiment::new(
    "scenarios",
    "Other bodies, other grounds, changes in mid-run: recovery, packets and force error in both modes",
    10,
    run,
);

/// The cube's side, m: side errors are shares of it.
const SIDE_M: f64 = 0.36;

/// A named environment.
pub struct Scenario {
    /// Its name.
    pub name: &'static str,
    /// What is otherwise than in the default scenario.
    pub what: &'static str,
    apply: fn(&mut EnvironmentConfig),
    /// By how much the model's side is too long when the object is first touched, as a share of it.
    side_error: Option<f64>,
    change: Option<Alteration>,
}

/// All scenarios.
#[rustfmt::skip]
pub static SCENARIOS: [Scenario; 16] = [
    plain("cube", "the default scenario", |_| {}),
    plain("brick", "36 by 24 cm", |world| world.shape = Shape::Brick { length_m: 0.36, width_m: 0.24 }),
    plain("disc", "36 cm across", |world| world.shape = Shape::Disc { diameter_m: 0.36 }),
    plain("polygon", "an irregular hexagon, 36 by 34 cm", |world| world.shape = hexagon()),
    plain("ripple", "friction varies by 30 % over 0.2 m", |world| world.ripple = Some(Ripple::default())),
    plain("patches", "two strips of mu 0.20 and 0.45", |world| world.patches = strips()),
    plain("static-friction", "static friction 1.5 times the sliding one", |world| world.static_ratio = 1.5),
    plain("wall", "a wall that stops the first push, unknown to the model", |world| {
        world.wall = Some(Wall { distance_m: 0.38, angle_rad: 0.0 });
    }),
    plain("centre-of-mass", "3 cm off the centre", |world| world.centre_of_mass_m = Vec2::new(0.03, 0.0)),
    side("side-0", "the model has the true side", 0.00),
    side("side-5", "the model's side is 5 % too long", 0.05),
    side("side-10", "the model's side is 10 % too long", 0.10),
    side("side-20", "the model's side is 20 % too long", 0.20),
    changing("friction-step", "mu steps from 0.30 to 0.45 in the second push", Alteration::FrictionCoefficient(0.45)),
    changing("friction-drop", "mu steps from 0.30 to 0.15 in the second push", Alteration::FrictionCoefficient(0.15)),
    changing("mass-step", "m steps from 0.7 to 1.2 kg in the second push", Alteration::MassKg(1.2)),
];

const fn plain(
    name: &'static str,
    what: &'static str,
    apply: fn(&mut EnvironmentConfig),
) -> Scenario {
    Scenario {
        name,
        what,
        apply,
        side_error: None,
        change: None,
    }
}

const fn side(name: &'static str, what: &'static str, error: f64) -> Scenario {
    Scenario {
        side_error: Some(error),
        ..plain(name, what, |_| {})
    }
}

const fn changing(name: &'static str, what: &'static str, change: Alteration) -> Scenario {
    Scenario {
        change: Some(change),
        ..plain(name, what, |_| {})
    }
}

impl Scenario {
    /// The world of the scenario in a mode with a scheme.
    #[must_use]
    pub fn world(&self, mode: Mode, curve: Curve, deadband: f64) -> WorldConfig {
        let mut world = paper_world(mode, curve.at(deadband));
        (self.apply)(&mut world.slave.environment);
        if let Some(error) = self.side_error {
            world.slave.start.side_m = SIDE_M * (1.0 + error);
        }
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

fn hexagon() -> Shape {
    let corners = [
        (0.18, -0.06),
        (0.18, 0.09),
        (0.04, 0.17),
        (-0.15, 0.13),
        (-0.18, -0.05),
        (-0.02, -0.17),
    ];
    let corners = corners.map(|(x, y)| Vec2::new(x, y));
    Shape::Polygon {
        vertices_m: Bounded::try_new(&corners).unwrap_or_default(),
    }
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

type Case = (&'static Scenario, Mode, Curve);
type Group = grid::Group<Case, Measured>;

/// Keeps `scenarios.csv`.
fn run(runner: &Runner, request: &Request) -> Result<Findings, ExperimentError> {
    let extent = request.extent;
    let of = |scenario| MODES.map(|(mode, curve)| (scenario, mode, curve));
    let cases = SCENARIOS.iter().flat_map(of).collect();
    let trial = |(scenario, mode, curve): &Case| Trial {
        change: Some(scenario.change()),
        ..Trial::new(scenario.world(*mode, *curve, 0.10), extent.duration)
    };
    let groups = runner.trials("scenarios", extent.seeds, cases, trial)?;
    let title = format!(
        "Scenarios, {} seeds: paper (hybrid 10 %, 150 ms) against recommended (useful 10 %, 150 ms)",
        extent.seeds
    );
    let table = Table::of(title, &groups, &columns());
    runner.keep_table("scenarios.csv", &table)?;
    let shown = table.without(&["what", "pmse_magnitude", "pushes"]);
    Ok(Findings {
        digest: digest(&groups),
        configuration: paper_worlds(0.10),
        tables: vec![shown],
    })
}

#[rustfmt::skip]
fn columns<'a>() -> Vec<Column<'a, Group>> {
    let mut columns: Vec<Column<Group>> = vec![
        column("scenario", "", 0, |group| group.case.0.name),
        column("what", "", 0, |group| group.case.0.what),
        column("mode", "", 0, |group| mode_name(group.case.1)),
    ];
    columns.extend(recovery::columns());
    let rest: [Column<Group>; 6] = [
        mean("packet_rate_hz", "Hz", 1, |run| run.updates.rate_hz()),
        mean("relative_error", "", 3, |run| run.force.relative_error),
        mean("pmse", "", 4, |run| run.force.pmse),
        mean("pmse_magnitude", "", 4, |run| run.force.pmse_magnitude),
        mean("position_rms_mm", "mm", 1, |run| Some(run.position_rms_m? * 1e3)),
        mean("pushes", "", 1, |run| Some(run.pushes as f64)),
    ];
    columns.extend(rest);
    columns
}
