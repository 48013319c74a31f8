//! The way round the box: where to head next so as to reach a point in front of a face without touching.
//!
//! Everything is in the object's frame, m. Each leg stays in a half-plane in front of one face, so no
//! leg can cut through the box.

use mmt_shared::model::geometry::{BoxFootprint, Face, Pose, Vec2};

/// Nearer to the box than this, the way leads straight out first, m.
pub(super) const CLOSE_M: f64 = 0.04;
/// Distance of the way-points at the corners from both of their faces, m.
const CORNER_M: f64 = 0.10;

/// Most legs of a way: straight out, two corners, the goal.
const LEGS_MAX: usize = 4;

/// The next face counter-clockwise: West, South, East, North, West …
pub(super) fn next_face(face: Face) -> Face {
    match face {
        Face::West => Face::South,
        Face::South => Face::East,
        Face::East => Face::North,
        Face::North => Face::West,
    }
}

/// The point at a distance (m) in front of a face and at a lateral place along it, m.
///
/// Lateral is counted from the reference point, to the left of somebody who faces outward.
pub(super) fn in_front_of(
    footprint: &BoxFootprint,
    face: Face,
    distance: f64,
    lateral: f64,
) -> Vec2 {
    face.outward() * (footprint.offset(face) + distance) + left_of(face) * lateral
}

/// Unit vector along a face: its outward normal turned by a quarter counter-clockwise.
pub(super) fn left_of(face: Face) -> Vec2 {
    let n = face.outward();
    Vec2::new(-n.y, n.x)
}

/// Where to head from `from` to reach `goal`, a point in front of `face`.
pub(super) fn way_point(footprint: &BoxFootprint, from: Vec2, face: Face, goal: Vec2) -> Vec2 {
    let (nearest, distance) = footprint.nearest(from);
    if distance < CLOSE_M {
        return from + nearest.outward() * CORNER_M;
    }
    if footprint.distance(face, from) >= CLOSE_M {
        return goal;
    }
    let (one, other) = (next_face(face), previous_face(face));
    let side = if footprint.distance(one, from) > footprint.distance(other, from) {
        one
    } else {
        other
    };
    if footprint.distance(side, from) >= CLOSE_M {
        corner(footprint, side, face)
    } else {
        corner(footprint, side, next_face(next_face(face)))
    }
}

/// The way from one point to another (m, world) round a box: the points that it leads over, the goal last.
pub(super) fn way(footprint: &BoxFootprint, pose: &Pose, from: Vec2, goal: Vec2) -> Vec<Vec2> {
    let (mut at, goal) = (pose.point_to_object(from), pose.point_to_object(goal));
    let (face, _) = footprint.nearest(goal);
    let mut legs = Vec::new();
    while at != goal && legs.len() < LEGS_MAX {
        at = way_point(footprint, at, face, goal);
        legs.push(pose.point_to_world(at));
    }
    legs
}

fn previous_face(face: Face) -> Face {
    next_face(next_face(next_face(face)))
}

fn corner(footprint: &BoxFootprint, a: Face, b: Face) -> Vec2 {
    a.outward() * (footprint.offset(a) + CORNER_M) + b.outward() * (footprint.offset(b) + CORNER_M)
}

#[cfg(test)]
mod tests {
    use super::*;
    use mmt_shared::rng::Substream;

    #[test]
    fn from_anywhere_to_any_face_the_way_arrives_and_never_touches() {
        let footprint = BoxFootprint {
            east: 0.1,
            north: 0.2,
            west: 0.25,
            south: 0.15,
        };
        let mut stream = Substream::new(1, "route", 0);
        for _ in 0..2000 {
            let mut at = Vec2::new(stream.uniform_in(-0.6, 0.6), stream.uniform_in(-0.6, 0.6));
            let mut outside = footprint.nearest(at).1 >= CLOSE_M;
            let face = Face::ALL[(stream.bits() % 4) as usize];
            let goal = in_front_of(&footprint, face, 0.05, stream.uniform_in(-0.05, 0.05));
            let (mut steps, mut legs, mut last) = (0, 0, None);
            while (at - goal).norm() > 1e-3 {
                let heading = way_point(&footprint, at, face, goal);
                legs += u32::from(outside && last != Some(heading));
                last = Some(heading);
                let to = heading - at;
                at += to * (1e-3 / to.norm()).min(1.0);
                let distance = footprint.nearest(at).1;
                assert!(!outside || distance >= CLOSE_M - 1e-3, "{at} to {face:?}");
                outside |= distance >= CLOSE_M;
                steps += 1;
                assert!(steps < 4000, "does not arrive at {face:?} from {at}");
            }
            // two corners and the goal; more would be a way that creeps along the box
            assert!(legs <= 3, "{legs} legs to {face:?}");
        }
    }

    #[test]
    fn the_faces_follow_each_other_counter_clockwise() {
        for face in Face::ALL {
            let n = face.outward();
            assert_eq!(next_face(face).outward(), Vec2::new(-n.y, n.x));
            assert_eq!(next_face(previous_face(face)), face);
        }
    }

    #[test]
    fn in_front_of_a_face_means_at_its_distance_and_lateral_place() {
        let footprint = BoxFootprint::square(0.4);
        let point = in_front_of(&footprint, Face::West, 0.05, 0.02);
        assert_eq!(point, Vec2::new(-0.25, -0.02));
    }
}
