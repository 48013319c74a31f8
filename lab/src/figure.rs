//! Figures: panels of curves with error bars, drawn as SVG.
//!
//! An experiment decides what is to be seen; this file and its drawing decide how. The same data must give the same
//! bytes on every machine.

mod draw;
mod ticks;

use std::ops::Range;

use plotters::style::RGBColor;

use crate::statistics::Interval;

/// Why a figure could not be drawn, in the words of plotters.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct DrawError(String);

/// One figure: panels side by side, in rows.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// Panels, row by row.
    pub panels: Vec<Panel>,
    /// Panels in a row.
    pub columns: usize,
    /// Width and height of a panel, in pixels.
    pub panel_size: (u32, u32),
}

impl Figure {
    /// Panels whose curves look alike, so that one legend, in the first, serves them all.
    #[must_use]
    pub fn of_alike(
        panels: impl IntoIterator<Item = Panel>,
        legend: Legend,
        columns: usize,
        panel_size: (u32, u32),
    ) -> Self {
        let mut panels: Vec<Panel> = panels.into_iter().collect();
        if let Some(first) = panels.first_mut() {
            first.legend = Some(legend);
        }
        Self {
            panels,
            columns,
            panel_size,
        }
    }
}

/// How numbers are laid out along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Evenly.
    Linear,
    /// By their logarithm; what is not positive is not drawn.
    Log,
}

/// An axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Quantity and unit.
    pub label: String,
    /// Layout.
    pub scale: Scale,
    /// What is shown; of the data if absent.
    pub range: Option<Range<f64>>,
    /// What is written at 0, 1, 2, … in place of the numbers; empty where the numbers are.
    pub names: Vec<String>,
}

impl Axis {
    /// A linear axis from zero, or from the least value below it, to the largest value.
    #[must_use]
    pub fn linear(label: &str) -> Self {
        Self {
            label: label.to_owned(),
            scale: Scale::Linear,
            range: None,
            names: Vec::new(),
        }
    }

    /// An axis of things without an order, at 0, 1, 2, ….
    #[must_use]
    pub fn named(names: Vec<String>) -> Self {
        Self {
            range: Some(-0.6..names.len() as f64 - 0.4),
            names,
            ..Self::linear("")
        }
    }

    /// A logarithmic axis.
    #[must_use]
    pub fn log(label: &str) -> Self {
        Self {
            scale: Scale::Log,
            ..Self::linear(label)
        }
    }

    /// The same with a fixed range.
    #[must_use]
    pub fn over(self, range: Range<f64>) -> Self {
        Self {
            range: Some(range),
            ..self
        }
    }
}

/// The corner or side of a panel where its legend stands.
pub use plotters::chart::SeriesLabelPosition as Legend;

/// One panel.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// What it shows.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// The curves, later ones on top.
    pub series: Vec<Series>,
    /// Where the legend stands; none for no legend.
    pub legend: Option<Legend>,
}

impl Panel {
    /// A panel without a legend.
    #[must_use]
    pub fn new(
        title: impl Into<String>,
        x: Axis,
        y: Axis,
        series: impl IntoIterator<Item = Series>,
    ) -> Self {
        Self {
            title: title.into(),
            x,
            y,
            series: series.into_iter().collect(),
            legend: None,
        }
    }

    /// The same with a legend.
    #[must_use]
    pub fn with_legend(self, legend: Legend) -> Self {
        Self {
            legend: Some(legend),
            ..self
        }
    }
}

/// How a curve's line is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stroke {
    /// Continuous.
    Solid,
    /// In dashes.
    Dashed,
    /// A thin vertical line from the foot of the panel at each point: events.
    Events,
}

/// How a curve's points are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// A filled circle.
    Circle,
    /// A filled square.
    Square,
    /// A filled triangle.
    Triangle,
    /// A cross.
    Cross,
}

/// A colour that most colour-blind readers can tell from the others here (Okabe and Ito 2008).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Colour(RGBColor);

#[expect(missing_docs, reason = "a colour is named by its name")]
impl Colour {
    pub const BLUE: Self = Self(RGBColor(0x00, 0x72, 0xB2));
    pub const VERMILION: Self = Self(RGBColor(0xD5, 0x5E, 0x00));
    pub const GREEN: Self = Self(RGBColor(0x00, 0x9E, 0x73));
    pub const PURPLE: Self = Self(RGBColor(0xCC, 0x79, 0xA7));
    pub const ORANGE: Self = Self(RGBColor(0xE6, 0x9F, 0x00));
    pub const SKY: Self = Self(RGBColor(0x56, 0xB4, 0xE9));
    pub const BLACK: Self = Self(RGBColor(0, 0, 0));
    pub const GREY: Self = Self(RGBColor(0x99, 0x99, 0x99));
}

/// A point of a curve with its intervals.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Dot {
    /// Horizontal.
    pub x: f64,
    /// Vertical.
    pub y: f64,
    /// Interval of x.
    pub x_interval: Option<(f64, f64)>,
    /// Interval of y.
    pub y_interval: Option<(f64, f64)>,
    /// What stands beside it.
    pub note: Option<String>,
}

impl Dot {
    /// A point without intervals.
    #[must_use]
    pub fn at(x: f64, y: f64) -> Self {
        Self {
            x,
            y,
            ..Self::default()
        }
    }

    /// A point of means with their intervals.
    #[must_use]
    pub fn of_intervals(x: Interval, y: Interval) -> Self {
        Self {
            x_interval: Some((x.low, x.high)),
            y_interval: Some((y.low, y.high)),
            ..Self::at(x.mean, y.mean)
        }
    }
}

/// A curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Its name in the legend; empty for none.
    pub label: String,
    /// Its colour.
    pub colour: Colour,
    /// Its line.
    pub stroke: Stroke,
    /// Width of the line, pixels.
    pub width: u32,
    /// Its points' marks; none for a line alone.
    pub mark: Option<Mark>,
    /// Its points, in the order in which they are joined.
    pub dots: Vec<Dot>,
}

impl Series {
    /// A plain line.
    #[must_use]
    pub fn line(label: &str, colour: Colour, dots: Vec<Dot>) -> Self {
        Self {
            label: label.to_owned(),
            colour,
            stroke: Stroke::Solid,
            width: 2,
            mark: None,
            dots,
        }
    }

    /// The same with marks.
    #[must_use]
    pub fn marked(self, mark: Mark) -> Self {
        Self {
            mark: Some(mark),
            ..self
        }
    }

    /// The same with another line.
    #[must_use]
    pub fn stroked(self, stroke: Stroke, width: u32) -> Self {
        Self {
            stroke,
            width,
            ..self
        }
    }
}

#[cfg(test)]
mod tests;
