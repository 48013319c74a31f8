//! The tool on the real surface: a god-object proxy for the box, for discs and for convex polygons.
//!
//! parry's nearest point serves bodies with notches; it forgets by which face the tool came. The box is followed by
//! the proxy that the local model has too. It must never let the proxy change edge while the HIP stays behind the
//! edge that it entered by, nor stop it on a round surface.

use mmt_shared::model::contact::{GodObject, Touch};
use mmt_shared::model::geometry::{BoxFootprint, Face, Pose, Vec2, cross, rotate};

use super::bounded::Bounded;
use super::outline::{VERTICES_MAX, edges};
use super::solid::Skin;

/// The surface with the memory of where the tool entered.
#[allow(
    clippy::large_enum_variant,
    reason = "a body has one, and it never moves"
)]
pub(super) enum Surface {
    /// A square or a brick.
    Box(BoxFootprint, GodObject),
    /// A disc.
    Disc(Disc),
    /// A convex polygon.
    Polygon(Polygon),
    /// A polygon with notches: the proxy is parry's nearest point of the surface.
    Notched(Skin),
}

/// A round surface: the proxy slides freely to the point nearest to the HIP. Of a circle that is one line; parry has no
/// normal for a HIP at the very centre.
#[derive(Clone, Copy, Debug)]
pub(super) struct Disc {
    radius: f64,
    /// The last outward normal, for a HIP at the very centre.
    outward: Vec2,
}

/// A polygonal surface: the proxy keeps its edge until the HIP leaves it or passes its end.
#[derive(Clone, Copy, Debug)]
pub(super) struct Polygon {
    edges: Bounded<Edge, VERTICES_MAX>,
    touched: Option<usize>,
    /// The last HIP that was outside, in the object's frame of then.
    outside: Option<Vec2>,
}

#[derive(Clone, Copy, Debug)]
struct Edge {
    start: Vec2,
    along: Vec2,
    length: f64,
}

impl Surface {
    pub(super) fn of_box(footprint: BoxFootprint) -> Self {
        Self::Box(footprint, GodObject::default())
    }

    pub(super) fn disc(radius: f64) -> Self {
        Self::Disc(Disc {
            radius,
            outward: Face::East.outward(),
        })
    }

    /// Corners counter-clockwise, m.
    pub(super) fn polygon(corners: &[Vec2]) -> Self {
        let list: Vec<_> = edges(corners).map(Edge::new).collect();
        Self::Polygon(Polygon {
            edges: Bounded::try_new(&list).unwrap_or_default(),
            touched: None,
            outside: None,
        })
    }

    /// Follows the tool (m, world frame) and returns what it touches. On a disc or a polygon the face given
    /// is the one of the bounding box that the surface's normal is nearest to.
    pub(super) fn follow(&mut self, pose: &Pose, tool: Vec2) -> Option<Touch> {
        let local = |pose: &Pose| pose.point_to_object(tool);
        match self {
            Self::Box(footprint, proxy) => proxy.follow(footprint, pose, tool),
            Self::Disc(disc) => disc.follow(pose, local(pose)),
            Self::Polygon(polygon) => polygon.follow(pose, local(pose)),
            Self::Notched(skin) => {
                let tool = local(pose);
                let out = skin.way_out(tool)? - tool;
                let penetration = out.norm();
                (penetration > 0.0).then(|| touch(pose, out / penetration, tool, penetration))
            }
        }
    }
}

impl Disc {
    fn follow(&mut self, pose: &Pose, tool: Vec2) -> Option<Touch> {
        let distance = tool.norm();
        if distance > 0.0 {
            self.outward = tool / distance;
        }
        let penetration = self.radius - distance;
        (penetration >= 0.0).then(|| touch(pose, self.outward, tool, penetration))
    }
}

impl Polygon {
    fn follow(&mut self, pose: &Pose, tool: Vec2) -> Option<Touch> {
        self.touched = self.touched.and_then(|edge| self.kept(edge, tool));
        if self.touched.is_none() {
            let (nearest, distance) = self.nearest(tool);
            if distance > 0.0 {
                self.outside = Some(tool);
                return None;
            }
            self.touched = Some(
                self.outside
                    .map_or(nearest, |outside| self.nearest(outside).0),
            );
        }
        let edge = self.edges.as_slice().get(self.touched?)?;
        Some(touch(pose, edge.outward(), tool, -edge.distance(tool)))
    }

    /// The edge that the proxy is on, if it was on this one: the same, or the next past its end.
    fn kept(&self, index: usize, tool: Vec2) -> Option<usize> {
        let edges = self.edges.as_slice();
        let edge = edges.get(index)?;
        let place = (tool - edge.start).dot(&edge.along);
        let next = if place > edge.length {
            (index + 1) % edges.len()
        } else if place < 0.0 {
            (index + edges.len() - 1) % edges.len()
        } else {
            index
        };
        let behind = |edge: &Edge| edge.distance(tool) <= 0.0;
        (behind(edge) && edges.get(next).is_some_and(behind)).then_some(next)
    }

    /// The edge that a point is farthest in front of, with its signed distance, m.
    fn nearest(&self, point: Vec2) -> (usize, f64) {
        let distances = self
            .edges
            .as_slice()
            .iter()
            .map(|edge| edge.distance(point));
        distances.enumerate().fold(
            (0, f64::MIN),
            |best, next| if next.1 > best.1 { next } else { best },
        )
    }
}

impl Edge {
    fn new((start, end): (Vec2, Vec2)) -> Self {
        let length = (end - start).norm();
        Self {
            start,
            along: (end - start) / length,
            length,
        }
    }

    fn outward(&self) -> Vec2 {
        Vec2::new(self.along.y, -self.along.x)
    }

    /// Signed distance of a point, m: positive outside.
    fn distance(&self, point: Vec2) -> f64 {
        cross(point - self.start, self.along)
    }
}

impl Default for Edge {
    fn default() -> Self {
        Self {
            start: Vec2::zeros(),
            along: Face::East.outward(),
            length: 0.0,
        }
    }
}

/// The touch at the foot of `tool` on the surface with this outward normal; all in the object's frame.
fn touch(pose: &Pose, outward: Vec2, tool: Vec2, penetration: f64) -> Touch {
    let face = Face::ALL.into_iter().fold(Face::East, |best, face| {
        let better = face.outward().dot(&outward) > best.outward().dot(&outward);
        if better { face } else { best }
    });
    let penetration = penetration.max(0.0);
    Touch {
        face,
        inward: -rotate(pose.angle, outward),
        proxy: pose.point_to_world(tool + outward * penetration),
        penetration,
    }
}
