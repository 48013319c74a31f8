//! The bound's figure: the error that the schemes reach at each deadband, the updates of the schemes and of the oracle, and the
//! one over the other.

use super::case::{Group, Rule, TARGET, ratio};
use super::trace::Bounded;
use crate::experiment::prelude::*;

/// How far the schemes stand apart at a deadband, in per cent: intervals that lie on each other cannot be read.
const APART: f64 = 0.3;
/// The deadbands that are shown, per cent.
const SHOWN: (f64, f64) = (0.0, 25.0);

/// Left the error, in the middle both rates, right their ratio with what is demanded of it.
pub(super) fn figure(groups: &[Group]) -> Figure {
    let deadband = || Axis::linear("deadband, %").over(SHOWN.0..SHOWN.1);
    let (mut errors, mut rates, mut ratios) = (Vec::new(), Vec::new(), Vec::new());
    for rule in Rule::ALL {
        let (colour, mark, apart) = match rule {
            Rule::Useful => (Colour::BLUE, Mark::Circle, -APART),
            Rule::Adaptive => (Colour::VERMILION, Mark::Square, APART),
        };
        let curve = |name: &str, of: fn(&Group) -> Option<Interval>| {
            let own = groups.iter().filter(|group| group.case.rule == rule);
            let dots = own.filter_map(|group| {
                let mean = of(group)?;
                Some(Dot {
                    y_interval: Some((mean.low, mean.high)),
                    ..Dot::at(group.case.deadband * 100.0 + apart, mean.mean)
                })
            });
            Series::line(name, colour, dots.collect()).marked(mark)
        };
        let name = rule.name();
        errors.push(curve(name, |group| group.interval(|run| run.epsilon_n)));
        rates.push(curve(name, rate));
        let least = curve(&format!("fewest, for {name}"), fewest_rate);
        rates.push(least.stroked(Stroke::Dashed, 2));
        ratios.push(curve(name, ratio));
    }
    let target = vec![Dot::at(SHOWN.0, TARGET), Dot::at(SHOWN.1, TARGET)];
    ratios.push(Series::line("demanded", Colour::GREY, target).stroked(Stroke::Dashed, 2));
    let error = Axis::linear("force error, N").over(0.0..0.1);
    let rate = Axis::log("updates per second").over(0.05..10.0);
    let ratio = Axis::linear("updates over the fewest");
    let panels = [
        ("95 % of contact within", error, errors, Legend::LowerRight),
        ("Updates", rate, rates, Legend::UpperRight),
        (
            "Over the fewest with hindsight",
            ratio,
            ratios,
            Legend::LowerRight,
        ),
    ];
    let panels = panels.map(|(title, y, series, legend)| {
        Panel::new(title, deadband(), y, series).with_legend(legend)
    });
    Figure {
        panels: panels.to_vec(),
        columns: 3,
        panel_size: (400, 360),
    }
}

fn rate(group: &Group) -> Option<Interval> {
    group.interval(|run| Some(run.updates as f64 / run.duration_s))
}

fn fewest_rate(group: &Group) -> Option<Interval> {
    let rate = |run: &Bounded| Some(run.fewest? as f64 / run.duration_s);
    group.interval(rate)
}
