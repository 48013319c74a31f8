//! The drawing itself, by plotters: its axes and its error bars.

use std::fmt::Display;
use std::ops::Range;

use plotters::coord::combinators::{BindKeyPoints, IntoLogRange, LogCoord, WithKeyPoints};
use plotters::coord::ranged1d::ValueFormatter;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::{Axis, Dot, DrawError, Figure, Mark, Panel, Scale, Series, Stroke, ticks};

/// Family of every text.
const FAMILY: &str = "sans-serif";
/// Size of a panel's title, pixels.
const TITLE: u32 = 17;
/// Size of an axis' label, of the legend and of the numbers at the marks, pixels.
const LABEL: u32 = 15;
const NUMBER: u32 = 13;
/// Half of the size of a point's mark, pixels, and a square of about that size.
const HALF: i32 = 4;
const SQUARE: [(i32, i32); 2] = [(-3, -3), (3, 3)];
/// Most marks of a linear axis.
const MARKS: usize = 9;

type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;
type Chart<'a, 'b, X, Y> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<X, Y>>;

/// An axis of plotters that shows numbers.
trait Numbers: Ranged<ValueType = f64> + ValueFormatter<f64> {}

impl<T: Ranged<ValueType = f64> + ValueFormatter<f64>> Numbers for T {}

impl Figure {
    /// The figure as SVG.
    ///
    /// # Errors
    /// When plotters cannot draw it.
    pub fn draw(&self) -> Result<String, DrawError> {
        let columns = self.columns.clamp(1, self.panels.len().max(1));
        let rows = self.panels.len().div_ceil(columns).max(1);
        let (width, height) = self.panel_size;
        let size = (width * columns as u32, height * rows as u32);
        let mut svg = String::new();
        {
            let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
            root.fill(&WHITE).map_err(failed)?;
            let areas = root.split_evenly((rows, columns));
            for (area, panel) in areas.iter().zip(&self.panels) {
                draw_panel(area, panel)?;
            }
            root.present().map_err(failed)?;
        }
        Ok(svg)
    }
}

fn failed(error: impl Display) -> DrawError {
    DrawError(error.to_string())
}

fn draw_panel(area: &Area, panel: &Panel) -> Result<(), DrawError> {
    let seen = panel.series.iter();
    // events reach up to a height but do not set it
    let measured = seen
        .clone()
        .filter(|series| series.stroke != Stroke::Events);
    let x = span(&panel.x, seen, |dot| (dot.x, dot.x_interval));
    let y = span(&panel.y, measured, |dot| (dot.y, dot.y_interval));
    match (panel.x.scale, panel.y.scale) {
        (Scale::Linear, Scale::Linear) => draw_on(area, panel, linear(x), linear(y)),
        (Scale::Linear, Scale::Log) => draw_on(area, panel, linear(x), log(y)),
        (Scale::Log, Scale::Linear) => draw_on(area, panel, log(x), linear(y)),
        (Scale::Log, Scale::Log) => draw_on(area, panel, log(x), log(y)),
    }
}

fn linear(span: Range<f64>) -> RangedCoordf64 {
    span.into()
}

fn log(span: Range<f64>) -> WithKeyPoints<LogCoord<f64>> {
    let marks = ticks::log(&span);
    span.log_scale().with_key_points(marks)
}

/// A number with its interval.
type Reach = (f64, Option<(f64, f64)>);

/// What an axis shows: the given range, or a little more than the dots. Never empty.
fn span<'a>(
    axis: &Axis,
    series: impl Iterator<Item = &'a Series>,
    of: fn(&Dot) -> Reach,
) -> Range<f64> {
    if let Some(range) = &axis.range {
        return range.clone();
    }
    let values = series.flat_map(|series| &series.dots).flat_map(|dot| {
        let (value, interval) = of(dot);
        let (low, high) = interval.unwrap_or((value, value));
        [value, low, high]
    });
    let shown = values.filter(|value| axis.scale.shows(*value));
    let (low, high) = shown.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
        (low.min(value), high.max(value))
    });
    if low > high {
        return 0.1..1.0;
    }
    match axis.scale {
        Scale::Log => low / 1.3..high * 1.3,
        Scale::Linear => {
            let low = low.min(0.0);
            let room = if high > low { 0.05 * (high - low) } else { 1.0 };
            (if low < 0.0 { low - room } else { low })..high + room
        }
    }
}

impl Scale {
    /// Whether a number has a place on it.
    fn shows(self, value: f64) -> bool {
        value.is_finite() && (self == Self::Linear || value > 0.0)
    }
}

impl Axis {
    /// What is written at a mark.
    fn written(&self, value: f64) -> String {
        match self.names.as_slice() {
            [] => ticks::written(value),
            names => (names.get(value.round() as usize).cloned()).unwrap_or_default(),
        }
    }

    /// Most marks; each name has one.
    fn marks(&self) -> usize {
        match &self.range {
            Some(range) if !self.names.is_empty() => (range.end - range.start) as usize + 2,
            _ => MARKS,
        }
    }

    /// Width that is left for what is written beside a vertical axis and for its label, pixels.
    fn room(&self) -> u32 {
        let longest = self.names.iter().map(|name| name.chars().count()).max();
        // a letter is a little wider than half of its height
        64.max(longest.unwrap_or_default() as u32 * NUMBER * 11 / 20 + 20)
    }
}

fn draw_on<X: Numbers, Y: Numbers>(
    area: &Area,
    panel: &Panel,
    x: X,
    y: Y,
) -> Result<(), DrawError> {
    let mut chart = ChartBuilder::on(area)
        .caption(&panel.title, (FAMILY, TITLE))
        .margin(12)
        .x_label_area_size(46)
        .y_label_area_size(panel.y.room())
        .build_cartesian_2d(x, y)
        .map_err(failed)?;
    let (on_x, on_y) = (
        |value: &f64| panel.x.written(*value),
        |value: &f64| panel.y.written(*value),
    );
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(BLACK.mix(0.09))
        .axis_style(BLACK.mix(0.6))
        .label_style((FAMILY, NUMBER))
        .axis_desc_style((FAMILY, LABEL))
        .x_desc(panel.x.label.as_str())
        .y_desc(panel.y.label.as_str())
        .x_labels(panel.x.marks())
        .y_labels(panel.y.marks())
        .x_label_formatter(&on_x)
        .y_label_formatter(&on_y)
        .draw()
        .map_err(failed)?;
    for series in &panel.series {
        draw_series(&mut chart, panel, series)?;
    }
    draw_legend(&mut chart, panel)
}

fn draw_series<X: Numbers, Y: Numbers>(
    chart: &mut Chart<X, Y>,
    panel: &Panel,
    series: &Series,
) -> Result<(), DrawError> {
    let (x, y) = (chart.x_range(), chart.y_range());
    let within = |range: &Range<f64>, value| (range.start..=range.end).contains(&value);
    let (scale_x, scale_y) = (panel.x.scale, panel.y.scale);
    let on_x = |dot: &Dot| scale_x.shows(dot.x) && within(&x, dot.x);
    let shown = |dot: &Dot| on_x(dot) && scale_y.shows(dot.y) && within(&y, dot.y);
    let colour = series.colour.0;
    if series.stroke == Stroke::Events {
        let lines = series.dots.iter().filter(|dot| on_x(dot)).map(|dot| {
            let top = dot.y.clamp(y.start, y.end);
            let ends = vec![(dot.x, y.start), (dot.x, top)];
            PathElement::new(ends, colour.stroke_width(series.width))
        });
        return chart.draw_series(lines).map(drop).map_err(failed);
    }
    // neighbours that can both be drawn are joined
    for run in series.dots.split(|dot| !shown(dot)) {
        draw_line(chart, series, run)?;
    }
    for dot in series.dots.iter().filter(|dot| shown(dot)) {
        let bar = colour.mix(0.75);
        if let Some((low, high)) = dot.x_interval {
            let (low, high) = (low.max(x.start), high.min(x.end));
            let bar = ErrorBar::new_horizontal(dot.y, low, dot.x, high, bar, 4);
            chart.draw_series([bar]).map_err(failed)?;
        }
        if let Some((low, high)) = dot.y_interval {
            let (low, high) = (low.max(y.start), high.min(y.end));
            let bar = ErrorBar::new_vertical(dot.x, low, dot.y, high, bar, 4);
            chart.draw_series([bar]).map_err(failed)?;
        }
        draw_note(chart, dot, colour)?;
    }
    let places = series.dots.iter().filter(|dot| shown(dot));
    draw_marks(chart, series, places.map(|dot| (dot.x, dot.y)))
}

fn draw_marks<X: Numbers, Y: Numbers>(
    chart: &mut Chart<X, Y>,
    series: &Series,
    places: impl Iterator<Item = (f64, f64)>,
) -> Result<(), DrawError> {
    let (filled, crossed) = (series.colour.0.filled(), series.colour.0.stroke_width(2));
    let drawn = match series.mark {
        None => return Ok(()),
        Some(Mark::Circle) => chart.draw_series(places.map(|at| Circle::new(at, HALF, filled))),
        Some(Mark::Square) => chart
            .draw_series(places.map(|at| EmptyElement::at(at) + Rectangle::new(SQUARE, filled))),
        Some(Mark::Triangle) => {
            chart.draw_series(places.map(|at| TriangleMarker::new(at, HALF + 1, filled)))
        }
        Some(Mark::Cross) => chart.draw_series(places.map(|at| Cross::new(at, HALF, crossed))),
    };
    drawn.map(drop).map_err(failed)
}

fn draw_line<X: Numbers, Y: Numbers>(
    chart: &mut Chart<X, Y>,
    series: &Series,
    run: &[Dot],
) -> Result<(), DrawError> {
    let style = series.colour.0.stroke_width(series.width);
    let places = run.iter().map(|dot| (dot.x, dot.y));
    let drawn = match series.stroke {
        Stroke::Solid => chart.draw_series(LineSeries::new(places, style)).map(drop),
        Stroke::Dashed => chart
            .draw_series(DashedLineSeries::new(places, 7, 4, style))
            .map(drop),
        Stroke::Events => Ok(()),
    };
    drawn.map_err(failed)
}

/// Below and to the left of its dot: a rate–error curve falls to the right.
fn draw_note<X: Numbers, Y: Numbers>(
    chart: &mut Chart<X, Y>,
    dot: &Dot,
    colour: RGBColor,
) -> Result<(), DrawError> {
    let Some(note) = &dot.note else {
        return Ok(());
    };
    let style = (FAMILY, NUMBER - 2).into_font().color(&colour);
    let style = style.pos(Pos::new(HPos::Right, VPos::Top));
    let text = EmptyElement::at((dot.x, dot.y)) + Text::new(note.clone(), (-6, 6), style);
    chart.draw_series([text]).map(drop).map_err(failed)
}

/// A label with room behind it: plotters counts 0.46 of the font's size for a letter, and fonts take up to 0.55.
fn roomy(label: &str) -> String {
    let room = label.chars().count().div_ceil(5);
    format!("{label}{:room$}", "")
}

fn draw_legend<'a, 'b: 'a, X: Numbers + 'a, Y: Numbers + 'a>(
    chart: &mut Chart<'a, 'b, X, Y>,
    panel: &Panel,
) -> Result<(), DrawError> {
    let Some(position) = panel.legend.clone() else {
        return Ok(());
    };
    let labelled = panel.series.iter();
    for series in labelled.filter(|series| !series.label.is_empty()) {
        let (colour, stroke) = (series.colour.0, series.stroke);
        let line = colour.stroke_width(series.width);
        let (filled, crossed) = (colour.filled(), colour.stroke_width(2));
        let nobody: [Circle<(f64, f64), i32>; 0] = [];
        let item = chart.draw_series(nobody).map_err(failed)?;
        let item = item.label(roomy(&series.label));
        let sample = move |(x, y)| {
            let [first, second] = halves(stroke).map(|half| PathElement::new(half, line));
            EmptyElement::at((x + REACH, y)) + first + second
        };
        let centre = (0, 0);
        match series.mark {
            None => item.legend(sample),
            Some(Mark::Circle) => {
                item.legend(move |at| sample(at) + Circle::new(centre, HALF, filled))
            }
            Some(Mark::Square) => {
                item.legend(move |at| sample(at) + Rectangle::new(SQUARE, filled))
            }
            Some(Mark::Triangle) => {
                item.legend(move |at| sample(at) + TriangleMarker::new(centre, HALF + 1, filled))
            }
            Some(Mark::Cross) => {
                item.legend(move |at| sample(at) + Cross::new(centre, HALF, crossed))
            }
        };
    }
    chart
        .configure_series_labels()
        .position(position)
        .margin(8)
        .legend_area_size(30)
        .label_font((FAMILY, NUMBER))
        .background_style(WHITE.mix(0.85))
        .border_style(BLACK.mix(0.25))
        .draw()
        .map_err(failed)
}

/// Half of the length of a line's sample in the legend, pixels.
const REACH: i32 = 13;

/// Both halves of the sample of a line, around its middle.
fn halves(stroke: Stroke) -> [[(i32, i32); 2]; 2] {
    match stroke {
        Stroke::Solid => [[(-REACH, 0), (0, 0)], [(0, 0), (REACH, 0)]],
        Stroke::Dashed => [[(-REACH, 0), (5 - REACH, 0)], [(REACH - 5, 0), (REACH, 0)]],
        Stroke::Events => [[(0, -7), (0, 0)], [(0, 0), (0, 7)]],
    }
}
