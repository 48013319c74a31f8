//! The reference motions of a body: what the environment does against what it should do.

use crate::experiment::prelude::*;
use crate::physics::{Body, PhysicsCase, PhysicsTrace, TracePoint, cases, traces};

/// The reference motions.
pub(super) const PHYSICS: Experiment = Experiment {
    arguments: &ARGUMENTS,
    ..Experiment::new(
        "physics",
        "What the environment does against closed forms and a fine reference, for any body",
        1,
        run,
    )
};

#[rustfmt::skip]
const ARGUMENTS: [Argument; 4] = [
    Argument { name: "mass", help: "Mass m, kg", number: Some(("KG", Body::DEFAULT.mass_kg)) },
    Argument { name: "side", help: "Side l of the square footprint, m", number: Some(("M", Body::DEFAULT.side_m)) },
    Argument { name: "mu", help: "Friction coefficient between body and ground", number: Some(("MU", Body::DEFAULT.friction_coefficient)) },
    Argument { name: "damping", help: "Viscous damping b, N s/m", number: Some(("NS_PER_M", Body::DEFAULT.damping_ns_per_m)) },
];

/// Keeps `physics.csv` and `physics.svg`.
fn run(runner: &Runner, request: &Request) -> Result<Findings, ExperimentError> {
    let given = |name, default| request.number(name).unwrap_or(default);
    let body = Body {
        mass_kg: given("mass", Body::DEFAULT.mass_kg),
        side_m: given("side", Body::DEFAULT.side_m),
        friction_coefficient: given("mu", Body::DEFAULT.friction_coefficient),
        damping_ns_per_m: given("damping", Body::DEFAULT.damping_ns_per_m),
    };
    let (cases, traces) = (cases(&body)?, traces(&body)?);
    let (all, shown) = tables(&body, &cases);
    runner.keep_table("physics.csv", &all)?;
    runner.keep_figure("physics.svg", &figure(&traces))?;
    Ok(Findings {
        tables: vec![shown],
        ..Findings::default()
    })
}

/// For the file and for people.
fn tables(body: &Body, cases: &[PhysicsCase]) -> (Table, Table) {
    let title = format!(
        "Reference motions of {} kg, {} m, mu {}, {} N s/m",
        body.mass_kg, body.side_m, body.friction_coefficient, body.damping_ns_per_m
    );
    let table = Table::of(
        title,
        cases,
        &[
            column("case", "", 0, |case| case.case),
            column("motion", "", 0, |case| case.motion.clone()),
            column("reference", "", 6, |case| case.reference),
            column("measured", "", 6, |case| case.measured),
            column("unit", "", 0, |case| case.unit),
            column("relative_error", "", 6, |case| case.relative_error),
            column("error_percent", "%", 4, |case| 100.0 * case.relative_error),
        ],
    );
    let all = table.selected(&["case", "reference", "measured", "relative_error"]);
    (all, table.without(&["relative_error"]))
}

fn figure(traces: &[PhysicsTrace]) -> Figure {
    let panels = traces.iter().map(|trace| {
        let curve = |of: &dyn Fn(&TracePoint) -> f64| {
            trace
                .points
                .iter()
                .map(|point| Dot::at(point.t_s, of(point)))
                .collect()
        };
        let series = [
            Series::line("measured", Colour::SKY, curve(&|point| point.measured))
                .stroked(Stroke::Solid, 4),
            Series::line("reference", Colour::BLACK, curve(&|point| point.reference))
                .stroked(Stroke::Dashed, 1),
        ];
        Panel::new(trace.case, Axis::linear("time, s"), vertical(trace), series)
    });
    Figure::of_alike(panels, Legend::UpperLeft, 5, (300, 260))
}

/// A body that is held moves by less than can be drawn: within a millimetre or a milliradian, as errors are given.
fn vertical(trace: &PhysicsTrace) -> Axis {
    let axis = Axis::linear(if trace.unit == "rad" {
        "angle, rad"
    } else {
        "displacement, m"
    });
    let still = |point: &TracePoint| point.reference.abs().max(point.measured.abs()) < 1e-3;
    if trace.points.iter().all(still) {
        axis.over(-1e-3..1e-3)
    } else {
        axis
    }
}
