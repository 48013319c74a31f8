//! The drawing itself, by plotters.
//!
//! Logarithmic axes are drawn as logarithms with their own marks, so that one kind of coordinates serves all.

use std::fmt::Display;
use std::ops::Range;

use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, ValueFormatter};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::symbol::Symbol;
use super::{Axis, Dot, Figure, Legend, Panel, Scale, Series, Stroke, ticks};
use crate::reproduce::ReproduceError;

/// Family of every text.
const FAMILY: &str = "sans-serif";
/// Size of a panel's title, pixels.
const TITLE: u32 = 17;
/// Size of an axis' label, of the legend and of the numbers at the marks, pixels.
const LABEL: u32 = 15;
const NUMBER: u32 = 13;

type Plane = Cartesian2d<View, View>;
type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Plane>;
type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

impl Figure {
    /// The figure as SVG.
    ///
    /// # Errors
    /// When plotters cannot draw it; `name` says which figure.
    pub fn draw(&self, name: &str) -> Result<String, ReproduceError> {
        let columns = self.columns.clamp(1, self.panels.len().max(1));
        let rows = self.panels.len().div_ceil(columns);
        let (width, height) = self.panel_size;
        let size = (width * columns as u32, height * rows.max(1) as u32);
        let mut svg = String::new();
        {
            let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
            let drawn = self.draw_panels(&root, rows, columns);
            drawn.map_err(|why| ReproduceError::Draw {
                name: name.to_owned(),
                why,
            })?;
        }
        Ok(svg)
    }

    fn draw_panels(&self, root: &Area, rows: usize, columns: usize) -> Result<(), String> {
        root.fill(&WHITE).map_err(told)?;
        let areas = root.split_evenly((rows.max(1), columns));
        for (area, panel) in areas.iter().zip(&self.panels) {
            draw_panel(area, panel)?;
        }
        root.present().map_err(told)
    }
}

fn told(error: impl Display) -> String {
    error.to_string()
}

fn draw_panel(area: &Area, panel: &Panel) -> Result<(), String> {
    let (x, y) = (View::of(panel, Side::X), View::of(panel, Side::Y));
    let mut chart = ChartBuilder::on(area)
        .caption(&panel.title, (FAMILY, TITLE))
        .margin(12)
        .x_label_area_size(46)
        .y_label_area_size(64)
        .build_cartesian_2d(x.clone(), y.clone())
        .map_err(told)?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(BLACK.mix(0.09))
        .axis_style(BLACK.mix(0.6))
        .label_style((FAMILY, NUMBER))
        .axis_desc_style((FAMILY, LABEL))
        .x_desc(panel.x.label.as_str())
        .y_desc(panel.y.label.as_str())
        .x_labels(20)
        .y_labels(20)
        .draw()
        .map_err(told)?;
    for series in &panel.series {
        draw_series(&mut chart, series, &x, &y)?;
    }
    draw_legend(&mut chart, panel)
}

/// Which axis.
#[derive(Clone, Copy)]
enum Side {
    X,
    Y,
}

/// An axis with what it shows, in drawn numbers: logarithms on a logarithmic axis.
#[derive(Clone)]
struct View {
    scale: Scale,
    range: Range<f64>,
}

impl View {
    fn of(panel: &Panel, side: Side) -> Self {
        let axis = match side {
            Side::X => &panel.x,
            Side::Y => &panel.y,
        };
        let dots = panel
            .series
            .iter()
            .filter(|s| s.stroke != Stroke::Events || matches!(side, Side::X));
        let values = dots.flat_map(|series| &series.dots).flat_map(|dot| {
            let (value, interval) = match side {
                Side::X => (dot.x, dot.x_interval),
                Side::Y => (dot.y, dot.y_interval),
            };
            let (low, high) = interval.unwrap_or((value, value));
            [value, low, high]
        });
        let range = axis.range.clone().unwrap_or_else(|| range_of(axis, values));
        Self {
            scale: axis.scale,
            range: drawn(axis.scale, range.start)..drawn(axis.scale, range.end),
        }
    }

    fn at(&self, value: f64) -> Option<f64> {
        let at = drawn(self.scale, value);
        at.is_finite().then_some(at)
    }

    /// Within the panel, or at its edge.
    fn clipped(&self, value: f64) -> f64 {
        let at = drawn(self.scale, value);
        if at.is_nan() {
            self.range.start
        } else {
            at.clamp(self.range.start, self.range.end)
        }
    }

    fn shows(&self, at: f64) -> bool {
        let room = 1e-9 * (self.range.end - self.range.start);
        (self.range.start - room..=self.range.end + room).contains(&at)
    }
}

impl Ranged for View {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, at: &f64, (first, last): (i32, i32)) -> i32 {
        let share = (at - self.range.start) / (self.range.end - self.range.start);
        first + libm::round(share * f64::from(last - first)) as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        match self.scale {
            Scale::Linear => ticks::linear(&self.range),
            Scale::Log => ticks::log(&self.range),
        }
    }

    fn range(&self) -> Range<f64> {
        self.range.clone()
    }
}

impl ValueFormatter<f64> for View {
    fn format(at: &f64) -> String {
        ticks::written(*at)
    }

    fn format_ext(&self, at: &f64) -> String {
        match self.scale {
            Scale::Linear => ticks::written(*at),
            Scale::Log => ticks::written(libm::pow(10.0, *at)),
        }
    }
}

fn drawn(scale: Scale, value: f64) -> f64 {
    match scale {
        Scale::Linear => value,
        Scale::Log => libm::log10(value),
    }
}

/// A little more than the data; never empty.
fn range_of(axis: &Axis, values: impl Iterator<Item = f64>) -> Range<f64> {
    let shown = values.filter(|v| v.is_finite() && (axis.scale == Scale::Linear || *v > 0.0));
    let (low, high) = shown.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
        (low.min(v), high.max(v))
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

fn draw_series(chart: &mut Chart, series: &Series, x: &View, y: &View) -> Result<(), String> {
    let colour = colour_of(series);
    if series.stroke == Stroke::Events {
        let lines = series.dots.iter().filter_map(|dot| {
            let at = x.at(dot.x).filter(|at| x.shows(*at))?;
            let ends = vec![(at, y.range.start), (at, y.clipped(dot.y))];
            Some(PathElement::new(ends, colour.stroke_width(series.width)))
        });
        return chart.draw_series(lines).map(drop).map_err(told);
    }
    let place = |dot: &Dot| {
        let (at_x, at_y) = (x.at(dot.x)?, y.at(dot.y)?);
        Some((at_x, at_y)).filter(|_| x.shows(at_x) && y.shows(at_y))
    };
    draw_lines(chart, series, colour, &place)?;
    draw_intervals(chart, series, colour, x, y)?;
    draw_marks(chart, series, colour, &place)
}

fn colour_of(series: &Series) -> RGBColor {
    let (r, g, b) = series.colour.rgb();
    RGBColor(r, g, b)
}

/// Joins neighbours that can both be drawn.
fn draw_lines(
    chart: &mut Chart,
    series: &Series,
    colour: RGBColor,
    place: &dyn Fn(&Dot) -> Option<(f64, f64)>,
) -> Result<(), String> {
    let style = colour.stroke_width(series.width);
    let places: Vec<Option<(f64, f64)>> = series.dots.iter().map(place).collect();
    for run in places.split(Option::is_none) {
        let run = run.iter().flatten().copied();
        let drawn = match series.stroke {
            Stroke::Solid => chart.draw_series(LineSeries::new(run, style)).map(drop),
            Stroke::Dashed => chart
                .draw_series(DashedLineSeries::new(run, 7, 4, style))
                .map(drop),
            Stroke::None | Stroke::Events => Ok(()),
        };
        drawn.map_err(told)?;
    }
    Ok(())
}

fn draw_intervals(
    chart: &mut Chart,
    series: &Series,
    colour: RGBColor,
    x: &View,
    y: &View,
) -> Result<(), String> {
    let style = colour.mix(0.75).stroke_width(1);
    let bars = series.dots.iter().filter_map(|dot| {
        let (at_x, at_y) = (x.at(dot.x)?, y.at(dot.y)?);
        if !(x.shows(at_x) && y.shows(at_y)) {
            return None;
        }
        let across = dot
            .x_interval
            .map(|(low, high)| vec![(x.clipped(low), at_y), (x.clipped(high), at_y)]);
        let along = dot
            .y_interval
            .map(|(low, high)| vec![(at_x, y.clipped(low)), (at_x, y.clipped(high))]);
        Some([across, along])
    });
    let paths = bars
        .flatten()
        .flatten()
        .map(|ends| PathElement::new(ends, style));
    chart.draw_series(paths).map(drop).map_err(told)
}

fn draw_marks(
    chart: &mut Chart,
    series: &Series,
    colour: RGBColor,
    place: &dyn Fn(&Dot) -> Option<(f64, f64)>,
) -> Result<(), String> {
    let places = series
        .dots
        .iter()
        .filter_map(|dot| place(dot).map(|at| (dot, at)));
    for (dot, at) in places {
        let symbol = Symbol::mark(at, series.mark, colour);
        chart.draw_series([symbol]).map(drop).map_err(told)?;
        if let Some(note) = &dot.note {
            let style = (FAMILY, NUMBER - 2)
                .into_font()
                .color(&colour)
                .pos(Pos::new(HPos::Right, VPos::Top));
            // below the falling front that a rate–error curve is
            let text = EmptyElement::at(at) + Text::new(note.clone(), (-6, 6), style);
            chart.draw_series([text]).map(drop).map_err(told)?;
        }
    }
    Ok(())
}

/// A label with room behind it: plotters counts 0.46 of the font's size for a letter, and fonts take up to 0.55.
fn roomy(label: &str) -> String {
    let room = label.chars().count().div_ceil(5);
    format!("{label}{:room$}", "")
}

fn draw_legend<'a, 'b: 'a>(chart: &mut Chart<'a, 'b>, panel: &Panel) -> Result<(), String> {
    let position = match panel.legend {
        Legend::None => return Ok(()),
        Legend::UpperRight => SeriesLabelPosition::UpperRight,
        Legend::UpperLeft => SeriesLabelPosition::UpperLeft,
        Legend::LowerLeft => SeriesLabelPosition::LowerLeft,
        Legend::LowerRight => SeriesLabelPosition::LowerRight,
    };
    for series in panel
        .series
        .iter()
        .filter(|series| !series.label.is_empty())
    {
        let (colour, width, mark, stroke) =
            (colour_of(series), series.width, series.mark, series.stroke);
        let nobody: Vec<(f64, f64)> = Vec::new();
        chart
            .draw_series(LineSeries::new(nobody, colour))
            .map_err(told)?
            .label(roomy(&series.label))
            .legend(move |(x, y)| Symbol {
                at: (x + 13, y),
                mark,
                colour,
                line: Some((stroke, width)),
            });
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
        .map_err(told)
}
