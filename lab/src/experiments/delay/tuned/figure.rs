//! The figure of the tuned architectures over the delay.

use super::judged::Judged;
use crate::architecture::ComparedArchitecture;
use crate::experiment::prelude::*;
use crate::experiments::delay::figure::line;
use crate::experiments::delay::tuning::Tried;

/// Error untuned and tuned, aligned by the delay, and the apparent mass; means with their intervals.
pub(super) fn figure(judged: &[Judged<'_>]) -> Figure {
    type Measure = (&'static str, fn(&Judged<'_>) -> Option<Interval>, Axis);
    // below the curves there is room for the legend
    let error = |label| Axis::log(label).over(0.0003..10.0);
    #[rustfmt::skip]
    let measures: [Measure; 4] = [
        ("as they are where nobody tunes them", |judged| force_error(judged.untuned), error("relative error")),
        ("tuned", |judged| force_error(judged.tuned), error("relative error")),
        ("tuned, aligned by the delay", |judged| judged.tuned.interval(|row| row.aligned_error), error("aligned error")),
        ("tuned, apparent mass", |judged| judged.tuned.interval(|row| row.apparent_mass_ratio), Axis::linear("felt mass over the object's")),
    ];
    let panels = measures.into_iter().map(|(title, of, y)| {
        let series = ComparedArchitecture::ALL.into_iter().map(|architecture| {
            let own = judged
                .iter()
                .filter(|judged| judged.point().architecture == architecture);
            let dots = own.filter_map(|judged| {
                let (mean, one_way_ms) = (of(judged)?, judged.point().one_way_ms as f64);
                Some(Dot {
                    y_interval: Some((mean.low, mean.high)),
                    ..Dot::at(one_way_ms.max(2.0), mean.mean)
                })
            });
            line(architecture, dots.collect())
        });
        let x = Axis::log("one-way delay, ms (none at 2)");
        Panel::new(title, x, y, series)
    });
    Figure::of_alike(panels, Legend::LowerRight, 2, (560, 400))
}

fn force_error(tried: &Tried) -> Option<Interval> {
    tried.interval(|row| row.relative_error)
}
