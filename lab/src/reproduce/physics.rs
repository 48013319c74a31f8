//! The reference motions of a body: what the environment does against what it should do.

use super::{Extent, Findings, Laboratory, ReproduceError};
use crate::figure::{Axis, Colour, Dot, Figure, Legend, Panel, Series, Stroke};
use crate::physics::{Body, PhysicsCase, PhysicsTrace, TracePoint, cases, traces};
use crate::table::Table;

/// Runs every motion of a body and keeps `physics.csv` and `physics.svg`.
///
/// # Errors
/// When the body is not accepted or has no friction; as [`Laboratory::keep`].
pub fn reproduce(
    laboratory: &dyn Laboratory,
    extent: Extent,
    body: &Body,
) -> Result<Findings, ReproduceError> {
    let (cases, traces) = (cases(body)?, traces(body)?);
    laboratory.keep("physics.csv", &rows(&cases).to_csv())?;
    laboratory.keep_figure("physics.svg", &figure(&traces))?;
    Ok(Findings {
        experiment: "physics",
        extent,
        digest: String::new(),
        configuration: Vec::new(),
        tables: vec![shown(body, &cases)],
    })
}

fn rows(cases: &[PhysicsCase]) -> Table {
    let columns = [
        ("case", 0),
        ("reference", 6),
        ("measured", 6),
        ("relative_error", 6),
    ];
    let mut table = Table::new("Reference motions", &columns);
    for case in cases {
        table.push([
            case.case.into(),
            case.reference.into(),
            case.measured.into(),
            case.relative_error.into(),
        ]);
    }
    table
}

fn shown(body: &Body, cases: &[PhysicsCase]) -> Table {
    let mut table = Table::new(
        format!(
            "Reference motions of {} kg, {} m, mu {}, {} N s/m",
            body.mass_kg, body.side_m, body.friction_coefficient, body.damping_ns_per_m
        ),
        &[
            ("case", 0),
            ("motion", 0),
            ("reference", 6),
            ("measured", 6),
            ("unit", 0),
            ("error_percent", 4),
        ],
    );
    for case in cases {
        table.push([
            case.case.into(),
            case.motion.clone().into(),
            case.reference.into(),
            case.measured.into(),
            case.unit.into(),
            (100.0 * case.relative_error).into(),
        ]);
    }
    table
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
            Series::line("measured", Colour::Sky, curve(&|point| point.measured))
                .stroked(Stroke::Solid, 4),
            Series::line("reference", Colour::Black, curve(&|point| point.reference))
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
