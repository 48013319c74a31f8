//! A contact whose stiffness nobody knows: from a third to ten times the rendered one, with a stiff and a compliant tool;
//! and a soft one whose stiffness the device is given.

use mmt_server::tool::compliance::spring_for;
use mmt_shared::model::contact::Coupling;

use crate::experiment::prelude::*;

/// The stiffnesses.
pub(super) const EXPERIMENT: Experiment = Experiment::new(
    "stiffness",
    "What a real contact that is stiffer or softer than the rendered one costs, and what a compliant tool or a device that is given it mends",
    10,
    run,
);

/// Stiffness of the real contact over k_p of the default device.
const TIMES: [f64; 7] = [0.3, 0.5, 1.0, 2.0, 3.0, 5.0, 10.0];
/// Those of them whose stiffness the device is given: the softer ones, and its own, which must change nothing.
const TOLD: [f64; 3] = [0.3, 0.5, 1.0];
/// k_p and k_d of the default device, and k_d of every real contact.
const DEVICE: Coupling = Coupling {
    stiffness_n_per_m: 1000.0,
    damping_ns_per_m: 10.0,
};
const CURVE: Curve = Curve::Useful(150);
const DELTA: f64 = 0.10;

/// What meets the contact.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Tool {
    Stiff,
    Compliant,
    /// Stiff, and the device renders with the k_p of the contact.
    Told,
}

impl Tool {
    const ALL: [Self; 3] = [Self::Stiff, Self::Compliant, Self::Told];

    fn name(self) -> &'static str {
        match self {
            Self::Stiff => "stiff",
            Self::Compliant => "compliant",
            Self::Told => "told",
        }
    }

    /// In legends.
    fn label(self) -> &'static str {
        match self {
            Self::Stiff => "stiff tool",
            Self::Compliant => "compliant tool",
            Self::Told => "stiff tool, told",
        }
    }

    fn times(self) -> &'static [f64] {
        match self {
            Self::Stiff | Self::Compliant => &TIMES,
            Self::Told => &TOLD,
        }
    }
}

struct Case {
    tool: Tool,
    times: f64,
}

type Group = grid::Group<Case, Measured>;

impl Case {
    fn world(&self) -> WorldConfig {
        let mut world = paper_world(Mode::Recommended, CURVE.at(DELTA));
        let stiffness_n_per_m = self.times * DEVICE.stiffness_n_per_m;
        world.slave.environment.contact = Some(Coupling {
            stiffness_n_per_m,
            ..DEVICE
        });
        match self.tool {
            Tool::Stiff => {}
            Tool::Compliant => world.slave.tool_compliance = Some(spring_for(DEVICE)),
            Tool::Told => {
                world.stiffness_n_per_m = Some(stiffness_n_per_m);
                // the mode's, over the device's coupling
                world.settings = None;
            }
        }
        world
    }
}

fn cases() -> Vec<Case> {
    let of_tool = |tool: Tool| {
        let times = tool.times().iter();
        times.map(move |&times| Case { tool, times })
    };
    Tool::ALL.into_iter().flat_map(of_tool).collect()
}

/// Keeps `stiffness.csv` and `stiffness.svg`.
fn run(runner: &Runner, request: &Request) -> Result<Findings, ExperimentError> {
    let extent = request.extent;
    let groups = runner.trials("stiffness", extent.seeds, cases(), |case| {
        Trial::new(case.world(), extent.duration)
    })?;
    let usual = |group: &&Group| group.case.times == 1.0 && group.case.tool == Tool::Stiff;
    let usual = groups.iter().find(usual);
    let title = format!(
        "Stiffness of the real contact, {} seeds (ratio: over the rendered stiffness and a stiff tool)",
        extent.seeds
    );
    let table = Table::of(title, &groups, &columns(usual));
    runner.keep_table("stiffness.csv", &table)?;
    runner.keep_figure("stiffness.svg", &figure(&groups))?;
    Ok(Findings {
        digest: digest(&groups),
        configuration: cases().iter().map(Case::world).collect(),
        tables: vec![table],
    })
}

fn pmse(run: &Measured) -> Option<f64> {
    run.true_force.pmse_true.get()
}

#[rustfmt::skip]
fn columns<'a>(usual: Option<&'a Group>) -> Vec<Column<'a, Group>> {
    let ratio = move |group: &Group, of: fn(&Interval) -> f64| {
        group.ratio(usual?, pmse).as_ref().map(of)
    };
    vec![
        column("tool", "", 0, |group: &Group| group.case.tool.name()),
        column("times_k_p", "", 1, |group| group.case.times),
        mean("packet_rate_hz", "Hz", 2, |run| run.updates.rate_hz()),
        mean("pmse_true", "", 4, pmse),
        Column::new("pmse_ratio", "", 2, move |group| ratio(group, |i| i.mean).into()),
        Column::new("pmse_low", "", 2, move |group| ratio(group, |i| i.low).into()),
        Column::new("pmse_high", "", 2, move |group| ratio(group, |i| i.high).into()),
        mean("relative_error_true", "", 3, |run| run.true_force.relative_error_true.get()),
        mean("position_rms_mm", "mm", 1, |run| Some(run.position_rms_m? * 1e3)),
        mean("breaks_per_push", "", 2, |run| run.breaks_per_push),
    ]
}

fn figure(groups: &[Group]) -> Figure {
    let styles = [
        (Colour::VERMILION, Mark::Cross),
        (Colour::BLUE, Mark::Circle),
        (Colour::GREY, Mark::Square),
    ];
    let of_tool = Tool::ALL.into_iter().zip(styles);
    let series = of_tool.map(|(tool, (colour, mark))| {
        let groups = groups.iter().filter(|group| group.case.tool == tool);
        let dots = groups.filter_map(|group| {
            let y = group.interval(pmse)?;
            let y_interval = Some((y.low, y.high));
            Some(Dot {
                y_interval,
                ..Dot::at(group.case.times, y.mean)
            })
        });
        Series::line(tool.label(), colour, dots.collect()).marked(mark)
    });
    let panel = Panel::new(
        "A contact that nobody knows, or the device is told",
        Axis::log("stiffness of the real contact over 1000 N/m, the device's unless it is told"),
        Axis::log("PMSE against the true force"),
        series,
    );
    Figure::of_alike([panel], Legend::UpperLeft, 1, (560, 420))
}
