//! The plane: vectors, poses, twists and the square footprint with one offset per face.
//!
//! Frame: x, y in the ground plane, z up, angles counter-clockwise, SI units. `world` is the plane's
//! frame, `object` the frame at the object's centre. A pose is `world_from_object`.

use serde::{Deserialize, Serialize};

/// A planar vector, in metres, m/s, N … by its context.
pub type Vec2 = nalgebra::Vector2<f64>;

/// z component of `a × b`: the moment of force `b` at lever arm `a`.
pub fn cross(a: Vec2, b: Vec2) -> f64 {
    a.x * b.y - a.y * b.x
}

/// `omega × r`: the velocity that turning at `omega` (rad/s, counter-clockwise) gives at lever arm `r`.
pub fn spin(omega: f64, r: Vec2) -> Vec2 {
    Vec2::new(-omega * r.y, omega * r.x)
}

/// `v` turned by `angle` (rad, counter-clockwise).
pub fn rotate(angle: f64, v: Vec2) -> Vec2 {
    let (sin, cos) = libm::sincos(angle);
    Vec2::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y)
}

/// `angle` wrapped into (−π, π].
pub fn wrap_angle(angle: f64) -> f64 {
    let turn = std::f64::consts::TAU;
    let wrapped = angle - turn * libm::round(angle / turn);
    if wrapped <= -std::f64::consts::PI {
        wrapped + turn
    } else {
        wrapped
    }
}

/// Position (m) and orientation theta (rad) of an object's centre: `world_from_object`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Position p of the centre in the world, m.
    pub position: Vec2,
    /// Orientation theta, rad, counter-clockwise, not wrapped.
    pub angle: f64,
}

impl Pose {
    /// The pose at (`x`, `y`) m, turned by `angle` rad.
    pub fn new(x: f64, y: f64, angle: f64) -> Self {
        Self {
            position: Vec2::new(x, y),
            angle,
        }
    }

    /// A point of the object's frame in the world.
    pub fn point_to_world(&self, point_in_object: Vec2) -> Vec2 {
        self.position + rotate(self.angle, point_in_object)
    }

    /// A point of the world in the object's frame.
    pub fn point_to_object(&self, point_in_world: Vec2) -> Vec2 {
        rotate(-self.angle, point_in_world - self.position)
    }

    /// Whether every number in it is finite.
    pub fn is_finite(&self) -> bool {
        self.position.x.is_finite() && self.position.y.is_finite() && self.angle.is_finite()
    }
}

/// Velocity v (m/s, world frame) of the centre and turning rate omega (rad/s).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Twist {
    /// Velocity of the centre in the world, m/s.
    pub linear: Vec2,
    /// Turning rate omega, rad/s, counter-clockwise.
    pub angular: f64,
}

impl Twist {
    /// The twist (`vx`, `vy`) m/s, `angular` rad/s.
    pub fn new(vx: f64, vy: f64, angular: f64) -> Self {
        Self {
            linear: Vec2::new(vx, vy),
            angular,
        }
    }

    /// Velocity of the body's point at lever arm `r` from the centre (world frame), m/s.
    pub fn velocity_at(&self, r: Vec2) -> Vec2 {
        self.linear + spin(self.angular, r)
    }

    /// Whether every number in it is finite.
    pub fn is_finite(&self) -> bool {
        self.linear.x.is_finite() && self.linear.y.is_finite() && self.angular.is_finite()
    }
}

/// One of the four faces of the box, named by where its outward normal points in the object's frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Face {
    /// Outward normal +x.
    East,
    /// Outward normal +y.
    North,
    /// Outward normal −x.
    West,
    /// Outward normal −y.
    South,
}

impl Face {
    /// All four, counter-clockwise from +x.
    pub const ALL: [Self; 4] = [Self::East, Self::North, Self::West, Self::South];

    /// Outward unit normal in the object's frame.
    pub fn outward(self) -> Vec2 {
        match self {
            Self::East => Vec2::new(1.0, 0.0),
            Self::North => Vec2::new(0.0, 1.0),
            Self::West => Vec2::new(-1.0, 0.0),
            Self::South => Vec2::new(0.0, -1.0),
        }
    }

    /// Angle of the outward normal in the object's frame, rad.
    pub fn outward_angle(self) -> f64 {
        use std::f64::consts::{FRAC_PI_2, PI};
        match self {
            Self::East => 0.0,
            Self::North => FRAC_PI_2,
            Self::West => PI,
            Self::South => -FRAC_PI_2,
        }
    }
}

/// One value for each face, named by where its outward normal points in the object's frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PerFace<T> {
    /// Of the face whose outward normal is +x.
    pub east: T,
    /// +y.
    pub north: T,
    /// −x.
    pub west: T,
    /// −y.
    pub south: T,
}

impl<T: Copy> PerFace<T> {
    /// The same value for all four.
    pub const fn all(value: T) -> Self {
        Self {
            east: value,
            north: value,
            west: value,
            south: value,
        }
    }

    /// The value of a face.
    pub const fn get(&self, face: Face) -> T {
        match face {
            Face::East => self.east,
            Face::North => self.north,
            Face::West => self.west,
            Face::South => self.south,
        }
    }

    /// The value of a face, to be changed.
    pub const fn get_mut(&mut self, face: Face) -> &mut T {
        match face {
            Face::East => &mut self.east,
            Face::North => &mut self.north,
            Face::West => &mut self.west,
            Face::South => &mut self.south,
        }
    }
}

/// The rectangle that stands for the object: the distance from the reference point to each face, m.
pub type BoxFootprint = PerFace<f64>;

impl BoxFootprint {
    /// A square of the given side l (m), its reference point in the middle.
    pub const fn square(side: f64) -> Self {
        Self::all(side / 2.0)
    }

    /// Distance from the reference point to a face, m.
    pub const fn offset(&self, face: Face) -> f64 {
        self.get(face)
    }

    /// Sets the distance from the reference point to a face, m.
    pub const fn set_offset(&mut self, face: Face, offset: f64) {
        *self.get_mut(face) = offset;
    }

    /// Mean of the two extents (x and y): the side l of the square that (8) and (9) are written for, m.
    pub fn mean_side(&self) -> f64 {
        (self.east + self.north + self.west + self.south) / 2.0
    }

    /// Signed distance of a point of the object's frame to the line of a face, m: positive outside.
    pub fn distance(&self, face: Face, point_in_object: Vec2) -> f64 {
        face.outward().dot(&point_in_object) - self.offset(face)
    }

    /// Whether a point of the object's frame, projected on a face's line, lies between the face's ends.
    pub fn within_ends(&self, face: Face, point_in_object: Vec2) -> bool {
        Face::ALL
            .into_iter()
            .filter(|other| other.outward().dot(&face.outward()) == 0.0)
            .all(|side| self.distance(side, point_in_object) <= 0.0)
    }

    /// The face that a point outside is in front of, or that a point inside is nearest to, with its
    /// signed distance (m).
    pub fn nearest(&self, point_in_object: Vec2) -> (Face, f64) {
        let mut best = (Face::East, self.distance(Face::East, point_in_object));
        for face in [Face::North, Face::West, Face::South] {
            let distance = self.distance(face, point_in_object);
            if distance > best.1 {
                best = (face, distance);
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn to_world_and_back_is_the_identity() {
        let pose = Pose::new(0.3, -0.2, 0.7);
        let point = Vec2::new(0.18, -0.05);
        let back = pose.point_to_object(pose.point_to_world(point));
        assert!((back - point).norm() < 1e-15);
    }

    #[test]
    fn velocity_of_a_turning_body_is_omega_cross_r() {
        let twist = Twist::new(0.1, 0.0, 2.0);
        let v = twist.velocity_at(Vec2::new(0.0, 0.5));
        assert_eq!(v, Vec2::new(0.1 - 1.0, 0.0));
        assert_eq!(cross(Vec2::new(1.0, 0.0), Vec2::new(0.0, 3.0)), 3.0);
    }

    #[test]
    fn wrapping_keeps_the_direction() {
        for k in -3..=3 {
            let angle = 1.0 + f64::from(k) * 2.0 * PI;
            assert!((wrap_angle(angle) - 1.0).abs() < 1e-12);
        }
        assert!((wrap_angle(-PI) - PI).abs() < 1e-15);
    }

    #[test]
    fn a_point_in_front_of_a_face_is_within_its_ends() {
        let footprint = BoxFootprint::square(0.4);
        let front = Vec2::new(-0.3, 0.1);
        let (face, distance) = footprint.nearest(front);
        assert_eq!(face, Face::West);
        assert!((distance - 0.1).abs() < 1e-15);
        assert!(footprint.within_ends(Face::West, front));
        assert!(!footprint.within_ends(Face::West, Vec2::new(-0.3, 0.21)));
    }
}
