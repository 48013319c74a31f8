//! The outline of a body seen from above: what of it touches the ground, the tool and the wall.
//!
//! Everything is in the object's frame, whose origin is the centroid of the area. It must never hold an
//! outline that crosses itself.

use mmt_shared::model::geometry::{BoxFootprint, Face, Vec2, cross};
use mmt_shared::model::params::FACE_OFFSET_M;
use serde::{Deserialize, Serialize};

use super::bounded::Bounded;

/// Most vertices of a polygon.
pub const VERTICES_MAX: usize = 16;
/// Shortest accepted edge of a polygon, m: a tenth of the shortest accepted side.
const EDGE_MIN_M: f64 = 0.002;
/// Least turn from one edge to the next, as the sine of the angle: below, the outline is no corner.
const CORNER_MIN: f64 = 1e-3;

/// The shape of the body's footprint. The local model stands for it by its bounding box or a square.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
#[allow(
    clippy::large_enum_variant,
    reason = "a configuration is copied now and then, and stays `Copy` by holding its vertices"
)]
pub enum Shape {
    /// A square whose side is the configuration's `side_m`.
    #[default]
    Square,
    /// A rectangle.
    Brick {
        /// Extent along the object's x, m.
        length_m: f64,
        /// Extent along the object's y, m.
        width_m: f64,
    },
    /// A disc.
    Disc {
        /// Diameter, m.
        diameter_m: f64,
    },
    /// A convex polygon. Its vertices may be given about any point and in either sense.
    Polygon {
        /// 3 to 16 corners in order, m.
        vertices_m: Bounded<Vec2, VERTICES_MAX>,
    },
    /// A polygon that may have notches: a compound of convex parts. Its vertices are given likewise.
    Compound {
        /// 3 to 16 corners in order, m.
        vertices_m: Bounded<Vec2, VERTICES_MAX>,
    },
}

/// Why vertices are no outline.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum OutlineError {
    /// Fewer than three.
    #[error("polygon has {0} vertices; it needs 3 to 16")]
    TooFew(usize),
    /// A coordinate is not a number, or absurd.
    #[error("polygon vertex {0} is not a finite place within 10 m of the origin")]
    NotFinite(usize),
    /// An edge is too short.
    #[error("polygon edge after vertex {index} is {length} m long, the least accepted is 0.002 m")]
    ShortEdge {
        /// The vertex that the edge begins at, as sorted counter-clockwise.
        index: usize,
        /// Its length, m.
        length: f64,
    },
    /// Two edges meet elsewhere than at a common corner.
    #[error("polygon crosses itself")]
    Crossing,
    /// The outline turns back or runs straight on at a vertex, or goes round more than once.
    #[error("polygon is not convex at vertex {0}")]
    NotConvex(usize),
    /// The bounding box has a face too near to the centroid or too far from it.
    #[error(
        "polygon reaches {reach} m from its centroid towards {face:?}; accepted is 0.01 to 1 m"
    )]
    Reach {
        /// Which way.
        face: Face,
        /// How far, m.
        reach: f64,
    },
}

/// An outline about its centroid.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(
    clippy::large_enum_variant,
    reason = "there is one, and it never moves"
)]
pub(super) enum Outline {
    /// A circle of this radius, m.
    Circle(f64),
    /// Corners, counter-clockwise, m.
    Corners(Bounded<Vec2, VERTICES_MAX>),
}

impl Outline {
    /// A rectangle of these extents along x and y, m.
    pub(super) fn rectangle(length: f64, width: f64) -> Self {
        let (x, y) = (length / 2.0, width / 2.0);
        let corners = [(x, y), (-x, y), (-x, -y), (x, -y)].map(|(x, y)| Vec2::new(x, y));
        Self::Corners(Bounded::try_new(&corners).unwrap_or_default())
    }

    /// The polygon with these corners, turned counter-clockwise and moved to its centroid; `check` is [`convex`] or
    /// [`simple`].
    pub(super) fn polygon(
        vertices: &Bounded<Vec2, VERTICES_MAX>,
        check: fn(&[Vec2]) -> Result<(), OutlineError>,
    ) -> Result<Self, OutlineError> {
        let mut corners = *vertices;
        let given = corners.as_slice();
        if given.len() < 3 {
            return Err(OutlineError::TooFew(given.len()));
        }
        let near = |v: &Vec2| v.x.abs() <= 10.0 && v.y.abs() <= 10.0;
        if let Some(index) = given.iter().position(|v| !near(v)) {
            return Err(OutlineError::NotFinite(index));
        }
        if doubled_area(given) < 0.0 {
            corners.as_mut_slice().reverse();
        }
        check(corners.as_slice())?;
        let centroid = centroid(corners.as_slice());
        for corner in corners.as_mut_slice() {
            *corner -= centroid;
        }
        let outline = Self::Corners(corners);
        let bounds = outline.bounding_box();
        for face in Face::ALL {
            let reach = bounds.offset(face);
            if !(FACE_OFFSET_M.0..=FACE_OFFSET_M.1).contains(&reach) {
                return Err(OutlineError::Reach { face, reach });
            }
        }
        Ok(outline)
    }

    /// The bounding box along the object's axes.
    pub(super) fn bounding_box(&self) -> BoxFootprint {
        match self {
            Self::Circle(radius) => BoxFootprint::square(2.0 * radius),
            Self::Corners(corners) => {
                let mut bounds = BoxFootprint::square(0.0);
                for face in Face::ALL {
                    let reach = corners.as_slice().iter().map(|v| face.outward().dot(v));
                    bounds.set_offset(face, reach.fold(0.0, f64::max));
                }
                bounds
            }
        }
    }

    /// Mean of |r|² over the area, m²: I per mass under uniform density.
    pub(super) fn mean_square_arm(&self) -> f64 {
        match self {
            Self::Circle(radius) => radius * radius / 2.0,
            Self::Corners(corners) => {
                let second =
                    |(p, q): (Vec2, Vec2)| cross(p, q) * (p.dot(&p) + p.dot(&q) + q.dot(&q)) / 6.0;
                let corners = corners.as_slice();
                edges(corners).map(second).sum::<f64>() / doubled_area(corners)
            }
        }
    }

    /// Mean of |r| over the area, m: e per c under uniform pressure, the integral of (9) in closed form.
    pub(super) fn mean_arm(&self) -> f64 {
        match self {
            Self::Circle(radius) => radius * 2.0 / 3.0,
            Self::Corners(corners) => {
                let corners = corners.as_slice();
                2.0 * edges(corners).map(arm_of_edge).sum::<f64>() / doubled_area(corners)
            }
        }
    }

    /// Whether a point lies inside or on a convex outline.
    pub(super) fn holds(&self, point: Vec2) -> bool {
        match self {
            Self::Circle(radius) => point.norm() <= *radius,
            Self::Corners(corners) => {
                edges(corners.as_slice()).all(|(p, q)| cross(q - p, point - p) >= 0.0)
            }
        }
    }
}

/// The edges of a closed outline, each by its two ends.
pub(super) fn edges(corners: &[Vec2]) -> impl Iterator<Item = (Vec2, Vec2)> + Clone + '_ {
    let next = corners.iter().cycle().skip(1);
    corners.iter().copied().zip(next.copied())
}

/// Twice the area inside a closed outline, m²: positive counter-clockwise.
pub(super) fn doubled_area(corners: &[Vec2]) -> f64 {
    edges(corners).map(|(p, q)| cross(p, q)).sum()
}

/// The centroid of the area inside a closed outline.
pub(super) fn centroid(corners: &[Vec2]) -> Vec2 {
    let sum = edges(corners).fold(Vec2::zeros(), |sum, (p, q)| sum + (p + q) * cross(p, q));
    sum / (3.0 * doubled_area(corners))
}

/// Checks that an outline is convex.
pub(super) fn convex(corners: &[Vec2]) -> Result<(), OutlineError> {
    let mut turned = 0.0;
    let following = edges(corners).cycle().skip(1);
    for (index, ((p, q), (_, r))) in edges(corners).zip(following).enumerate() {
        let (this, next) = (q - p, r - q);
        let length = this.norm();
        if length < EDGE_MIN_M {
            return Err(OutlineError::ShortEdge { index, length });
        }
        let turn = cross(this, next);
        if turn < CORNER_MIN * length * next.norm() {
            return Err(OutlineError::NotConvex((index + 1) % corners.len()));
        }
        turned += libm::atan2(turn, this.dot(&next));
    }
    // a star turns left everywhere and goes round twice
    if turned > 1.5 * std::f64::consts::TAU {
        return Err(OutlineError::NotConvex(0));
    }
    Ok(())
}

/// Checks that an outline has no edge that is too short or meets another one.
pub(super) fn simple(corners: &[Vec2]) -> Result<(), OutlineError> {
    for (index, (p, q)) in edges(corners).enumerate() {
        let length = (q - p).norm();
        if length < EDGE_MIN_M {
            return Err(OutlineError::ShortEdge { index, length });
        }
        let apart = |(r, s): (Vec2, Vec2)| {
            let split = |p, q, r, s| cross(q - p, r - p) * cross(q - p, s - p) > 0.0;
            p == r || p == s || q == r || q == s || split(p, q, r, s) || split(r, s, p, q)
        };
        if !edges(corners).all(apart) {
            return Err(OutlineError::Crossing);
        }
    }
    Ok(())
}

/// The integral of |r| over the triangle of the origin and an edge, m³; negative if seen from outside.
fn arm_of_edge((p, q): (Vec2, Vec2)) -> f64 {
    let along = (q - p).normalize();
    let h = cross(p, along);
    if h == 0.0 {
        return 0.0;
    }
    // the integral of sqrt(h² + s²) along the edge, by h/3
    let antiderivative =
        |s: f64| 0.5 * (s * (h * h + s * s).sqrt() + h * h * libm::asinh(s / h.abs()));
    h / 3.0 * (antiderivative(q.dot(&along)) - antiderivative(p.dot(&along)))
}

#[cfg(test)]
mod tests;
