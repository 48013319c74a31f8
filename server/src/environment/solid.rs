//! The shape of a body as rapier and parry have it, about the centroid of its footprint.
//!
//! parry cuts an outline with notches into convex parts, answers whether two bodies overlap, and finds the way out of
//! a body with notches. Beside `world.rs` the only file that names the physics engine.

use mmt_shared::model::geometry::{Pose, Vec2};
use rapier2d_f64::parry::query::{PointQuery, contact};
use rapier2d_f64::parry::shape::{Polyline, TriMesh};
use rapier2d_f64::parry::transformation::hertel_mehlhorn;
use rapier2d_f64::prelude::{Pose as RapierPose, SharedShape, Vector};

use super::outline::{Outline, Shape};

/// Bodies that are less deep in each other than this lie flush, m: room for rounding.
const FLUSH_M: f64 = 1e-9;

/// The shape of a body.
pub(super) struct Solid(SharedShape);

impl Solid {
    /// None if an outline with notches cannot be cut into convex parts.
    pub(super) fn try_new(shape: &Shape, outline: &Outline) -> Option<Self> {
        Some(Self(match (shape, outline) {
            (Shape::Square | Shape::Brick { .. }, _) => {
                let bounds = outline.bounding_box();
                SharedShape::cuboid(bounds.east, bounds.north)
            }
            (_, Outline::Circle(radius)) => SharedShape::ball(*radius),
            (Shape::Compound { .. }, Outline::Corners(corners)) => {
                let mesh = TriMesh::from_polygon(vectors(corners.as_slice()))?;
                let parts = hertel_mehlhorn(mesh.vertices(), mesh.indices()).into_iter();
                let part = |corners| {
                    let convex = SharedShape::convex_polyline_unmodified(corners)?;
                    Some((RapierPose::IDENTITY, convex))
                };
                SharedShape::compound(parts.map(part).collect::<Option<_>>()?)
            }
            (_, Outline::Corners(corners)) => {
                SharedShape::convex_polyline_unmodified(vectors(corners.as_slice()))?
            }
        }))
    }

    pub(super) fn shape(&self) -> SharedShape {
        self.0.clone()
    }

    /// Whether two bodies are in each other when their centroids are at these poses.
    pub(super) fn overlaps(&self, pose: &Pose, other: &Self, other_pose: &Pose) -> bool {
        let at = |pose: &Pose| RapierPose::new(vector(pose.position), pose.angle);
        let contact = contact(&at(pose), &*self.0, &at(other_pose), &*other.0, 0.0);
        contact.is_ok_and(|contact| contact.is_some_and(|contact| contact.dist < -FLUSH_M))
    }
}

/// The surface of a body with notches.
pub(super) struct Skin {
    solid: SharedShape,
    outline: Polyline,
}

impl Skin {
    /// The surface of a solid with these corners, m.
    pub(super) fn new(solid: &Solid, corners: &[Vec2]) -> Self {
        let closed = corners.iter().chain(corners.first());
        let closed = closed.copied().map(vector).collect();
        Self {
            solid: solid.shape(),
            outline: Polyline::new(closed, None),
        }
    }

    /// The point of the surface that is nearest to a point inside; none for a point outside.
    pub(super) fn way_out(&self, point: Vec2) -> Option<Vec2> {
        if !self.solid.contains_local_point(vector(point)) {
            return None;
        }
        let nearest = self.outline.project_local_point(vector(point), false).point;
        Some(Vec2::new(nearest.x, nearest.y))
    }
}

pub(super) fn vector(from: Vec2) -> Vector {
    Vector::new(from.x, from.y)
}

fn vectors(corners: &[Vec2]) -> Vec<Vector> {
    corners.iter().copied().map(vector).collect()
}
