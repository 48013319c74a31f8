//! The bound's figure: updates of the schemes and of the oracle at each deadband, and the one over the other.

use super::trace::Bounded;
use super::{Group, Rule, TARGET, ratio};
use crate::experiment::prelude::*;

/// How far the schemes stand apart at a deadband, in per cent of it: intervals that lie on each other cannot be read.
const APART: f64 = 0.3;

/// Left both rates, right their ratio with what is demanded of it.
pub(super) fn figure(groups: &[Group]) -> Figure {
    let deadband = || Axis::linear("deadband, %").over(0.0..25.0);
    let (mut rates, mut ratios) = (Vec::new(), Vec::new());
    for rule in Rule::ALL {
        let (colour, mark, apart) = match rule {
            Rule::Useful => (Colour::BLUE, Mark::Circle, -APART),
            Rule::Adaptive => (Colour::VERMILION, Mark::Square, APART),
        };
        let curve = |of: fn(&Group) -> Option<Interval>, is_noted: bool| {
            let own = groups.iter().filter(|group| group.case.rule == rule);
            let dots = own.filter_map(|group| {
                let (mean, epsilon_n) = (of(group)?, group.mean(|run| run.epsilon_n)?);
                Some(Dot {
                    y_interval: Some((mean.low, mean.high)),
                    note: is_noted.then(|| format!("{epsilon_n:.3} N")),
                    ..Dot::at(group.case.deadband * 100.0 + apart, mean.mean)
                })
            });
            dots.collect::<Vec<_>>()
        };
        let (name, least) = (
            rule.name(),
            format!("fewest, at the error of {}", rule.name()),
        );
        rates.push(Series::line(name, colour, curve(rate, true)).marked(mark));
        let of_oracle = Series::line(&least, colour, curve(fewest_rate, false));
        rates.push(of_oracle.marked(mark).stroked(Stroke::Dashed, 2));
        ratios.push(Series::line(name, colour, curve(ratio, false)).marked(mark));
    }
    let target = vec![Dot::at(0.0, TARGET), Dot::at(25.0, TARGET)];
    ratios.push(Series::line("demanded", Colour::GREY, target).stroked(Stroke::Dashed, 2));
    let rate = Axis::log("updates per second").over(0.05..10.0);
    Figure {
        panels: vec![
            Panel::new(
                "Updates, with the error that they reach",
                deadband(),
                rate,
                rates,
            )
            .with_legend(Legend::UpperRight),
            Panel::new(
                "Updates over the fewest with hindsight",
                deadband(),
                Axis::linear("ratio"),
                ratios,
            )
            .with_legend(Legend::LowerLeft),
        ],
        columns: 2,
        panel_size: (560, 400),
    }
}

fn rate(group: &Group) -> Option<Interval> {
    group.interval(|run| Some(run.updates as f64 / run.duration_s))
}

fn fewest_rate(group: &Group) -> Option<Interval> {
    let rate = |run: &Bounded| Some(run.fewest? as f64 / run.duration_s);
    group.interval(rate)
}
