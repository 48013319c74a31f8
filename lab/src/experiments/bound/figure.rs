//! The bound's figure: updates of the schemes and of the oracle over the force error, and the one over the other.

use super::trace::Bounded;
use super::{Group, Rule, TARGET, ratio};
use crate::experiment::prelude::*;

/// Left both rates, right their ratio with what is demanded of it.
pub(super) fn figure(groups: &[Group]) -> Figure {
    let error = || Axis::linear("force error that 95 % of contact stay within, N");
    let mut rates = Vec::new();
    let mut ratios = Vec::new();
    for rule in Rule::ALL {
        let of_rule: Vec<&Group> = groups.iter().filter(|g| g.case.rule == rule).collect();
        let (colour, mark) = match rule {
            Rule::Useful => (Colour::BLUE, Mark::Circle),
            Rule::Adaptive => (Colour::VERMILION, Mark::Square),
        };
        let curve = |of: fn(&Group) -> Option<Interval>, is_noted: bool| {
            let dots = of_rule.iter().filter_map(|group| {
                let note = format!("{} %", group.case.deadband * 100.0);
                Some(Dot {
                    note: is_noted.then_some(note),
                    ..Dot::of_intervals(group.interval(|run| run.epsilon_n)?, of(group)?)
                })
            });
            dots.collect::<Vec<_>>()
        };
        let (name, least) = (rule.name(), format!("fewest, for {}", rule.name()));
        rates.push(Series::line(name, colour, curve(rate, true)).marked(mark));
        let of_oracle = Series::line(&least, colour, curve(fewest_rate, false));
        rates.push(of_oracle.marked(mark).stroked(Stroke::Dashed, 2));
        ratios.push(Series::line(name, colour, curve(ratio, true)).marked(mark));
    }
    let ends = groups
        .iter()
        .filter_map(|group| group.largest(|run| run.epsilon_n));
    let most = ends.fold(0.0, f64::max);
    let target = vec![Dot::at(0.0, TARGET), Dot::at(most, TARGET)];
    ratios.push(Series::line("demanded", Colour::GREY, target).stroked(Stroke::Dashed, 2));
    Figure {
        panels: vec![
            Panel::new("Updates", error(), Axis::log("updates per second"), rates)
                .with_legend(Legend::UpperRight),
            Panel::new(
                "Updates over the fewest with hindsight",
                error(),
                Axis::linear("ratio"),
                ratios,
            )
            .with_legend(Legend::UpperRight),
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
