//! The mark of a point, alone on a curve or with a piece of its line in the legend.

use std::iter::{Once, once};

use plotters::element::{Drawable, PointCollection};
use plotters::style::{Color, RGBColor};
use plotters_backend::{BackendCoord, DrawingBackend, DrawingErrorKind};

use super::{Mark, Stroke};

/// Half of a mark's size, pixels.
const HALF: i32 = 4;
/// Half of the length of the legend's line, pixels.
const REACH: i32 = 13;

/// A mark at a place, with a piece of line through it if it stands in the legend.
pub(super) struct Symbol<Place> {
    pub(super) at: Place,
    pub(super) mark: Mark,
    pub(super) colour: RGBColor,
    pub(super) line: Option<(Stroke, u32)>,
}

impl<Place> Symbol<Place> {
    /// A mark alone.
    pub(super) fn mark(at: Place, mark: Mark, colour: RGBColor) -> Self {
        Self {
            at,
            mark,
            colour,
            line: None,
        }
    }
}

impl<'a, Place> PointCollection<'a, Place> for &'a Symbol<Place> {
    type Point = &'a Place;
    type IntoIter = Once<&'a Place>;

    fn point_iter(self) -> Self::IntoIter {
        once(&self.at)
    }
}

impl<Place, DB: DrawingBackend> Drawable<DB> for Symbol<Place> {
    fn draw<I: Iterator<Item = BackendCoord>>(
        &self,
        mut places: I,
        backend: &mut DB,
        _: (u32, u32),
    ) -> Result<(), DrawingErrorKind<DB::ErrorType>> {
        let Some((x, y)) = places.next() else {
            return Ok(());
        };
        if let Some((stroke, width)) = self.line {
            let style = self.colour.stroke_width(width);
            for (from, to) in pieces(stroke) {
                backend.draw_line((x + from.0, y + from.1), (x + to.0, y + to.1), &style)?;
            }
        }
        let (filled, stroked) = (self.colour.filled(), self.colour.stroke_width(2));
        match self.mark {
            Mark::None => Ok(()),
            Mark::Circle => backend.draw_circle((x, y), HALF as u32, &filled, true),
            Mark::Square => {
                let half = HALF - 1;
                backend.draw_rect((x - half, y - half), (x + half, y + half), &filled, true)
            }
            Mark::Triangle => {
                let corners = [
                    (x, y - HALF - 1),
                    (x + HALF, y + HALF - 1),
                    (x - HALF, y + HALF - 1),
                ];
                backend.fill_polygon(corners, &filled)
            }
            Mark::Cross => {
                backend.draw_line((x - HALF, y - HALF), (x + HALF, y + HALF), &stroked)?;
                backend.draw_line((x - HALF, y + HALF), (x + HALF, y - HALF), &stroked)
            }
        }
    }
}

/// The lines of the legend's sample, from the mark's place.
fn pieces(stroke: Stroke) -> Vec<((i32, i32), (i32, i32))> {
    match stroke {
        Stroke::Solid => vec![((-REACH, 0), (REACH, 0))],
        Stroke::Dashed => vec![((-REACH, 0), (-REACH + 8, 0)), ((REACH - 8, 0), (REACH, 0))],
        Stroke::Events => vec![((0, -7), (0, 7))],
        Stroke::None => Vec::new(),
    }
}
