//! The standard messages of ROS 2 (Humble and later) that a record has, and their bytes.
//!
//! The scene is planar: z is 0, a turn is about z. Frames: `world`, and one of each body.

use super::cdr::CdrWriter;
use super::messages::Stamp;
use crate::model::geometry::{BoxFootprint, Pose, Twist, Vec2};

/// The frame that everything is given in.
pub const WORLD: &str = "world";
/// How high the flat bodies of the scene are drawn, m.
const HEIGHT_M: f64 = 0.10;
/// Length of a force's arrow, m/N: 8 N are 20 cm.
const ARROW_M_PER_N: f64 = 0.025;

/// A standard message, in the world frame.
#[derive(Clone, Copy, Debug)]
pub enum Standard<'a> {
    /// Where something is.
    Pose(Pose),
    /// A force, N.
    Force(Vec2),
    /// A velocity, m/s and rad/s.
    Twist(Twist),
    /// Frames by name, each where it is.
    Frames(&'a [(&'a str, Pose)]),
    /// What is drawn. Each marker replaces the one of its name that was drawn before.
    Markers(&'a [Marker]),
}

impl Standard<'_> {
    /// Name and schema (`ros2msg`) of its type.
    pub fn definition(&self) -> (&'static str, &'static str) {
        match self {
            Self::Pose(_) => (
                "geometry_msgs/msg/PoseStamped",
                include_str!("ros/PoseStamped.msg"),
            ),
            Self::Force(_) => (
                "geometry_msgs/msg/WrenchStamped",
                include_str!("ros/WrenchStamped.msg"),
            ),
            Self::Twist(_) => (
                "geometry_msgs/msg/TwistStamped",
                include_str!("ros/TwistStamped.msg"),
            ),
            Self::Frames(_) => ("tf2_msgs/msg/TFMessage", include_str!("ros/TFMessage.msg")),
            Self::Markers(_) => (
                "visualization_msgs/msg/MarkerArray",
                include_str!("ros/MarkerArray.msg"),
            ),
        }
    }

    /// Writes its fields.
    pub fn write(&self, out: &mut CdrWriter, stamp: Stamp) {
        match self {
            Self::Pose(pose) => {
                header(out, stamp);
                pose_of(out, pose);
            }
            Self::Force(force) => {
                header(out, stamp);
                vector(out, *force, 0.0);
                vector(out, Vec2::zeros(), 0.0);
            }
            Self::Twist(twist) => {
                header(out, stamp);
                vector(out, twist.linear, 0.0);
                vector(out, Vec2::zeros(), twist.angular);
            }
            Self::Frames(frames) => {
                out.u32(frames.len() as u32);
                for (name, pose) in *frames {
                    header(out, stamp);
                    out.text(name);
                    pose_of(out, pose);
                }
            }
            Self::Markers(markers) => {
                out.u32(markers.len() as u32);
                for marker in *markers {
                    header(out, stamp);
                    marker.write(out);
                }
            }
        }
    }
}

fn header(out: &mut CdrWriter, stamp: Stamp) {
    stamp.write(out);
    out.text(WORLD);
}

fn vector(out: &mut CdrWriter, v: Vec2, z: f64) {
    out.f64(v.x).f64(v.y).f64(z);
}

/// A turn by `angle` about z, as a quaternion.
fn turn(out: &mut CdrWriter, angle: f64) {
    let half = 0.5 * angle;
    out.f64(0.0).f64(0.0);
    out.f64(libm::sin(half)).f64(libm::cos(half));
}

fn pose_of(out: &mut CdrWriter, pose: &Pose) {
    vector(out, pose.position, 0.0);
    turn(out, pose.angle);
}

/// What is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// A box with these sides along its own x and y, m.
    Box(f64, f64),
    /// A ball of this diameter, m.
    Ball(f64),
    /// An arrow of a force, N, from the position.
    Force(Vec2),
}

/// Something to be drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Marker {
    /// What it is; with the topic it names the marker.
    pub name: &'static str,
    /// Where.
    pub pose: Pose,
    /// As what.
    pub shape: Shape,
    /// Red, green, blue and opacity, 0 to 1.
    pub colour: [f32; 4],
}

impl Marker {
    /// A body with these faces; its reference point need not be in their middle.
    pub fn body(name: &'static str, pose: Pose, faces: &BoxFootprint, colour: [f32; 4]) -> Self {
        let middle = Vec2::new(
            0.5 * (faces.east - faces.west),
            0.5 * (faces.north - faces.south),
        );
        Self {
            name,
            pose: Pose {
                position: pose.point_to_world(middle),
                ..pose
            },
            shape: Shape::Box(faces.east + faces.west, faces.north + faces.south),
            colour,
        }
    }

    /// A point.
    pub fn point(name: &'static str, at: Pose) -> Self {
        Self {
            name,
            pose: at,
            shape: Shape::Ball(0.02),
            colour: [0.1, 0.1, 0.1, 1.0],
        }
    }

    /// A force, N, that acts at a point.
    pub fn force(name: &'static str, at: Pose, force: Vec2, colour: [f32; 4]) -> Self {
        Self {
            name,
            pose: at,
            shape: Shape::Force(force),
            colour,
        }
    }

    /// `ARROW`, `CUBE`, `SPHERE` of `visualization_msgs/Marker`.
    fn kind(&self) -> i32 {
        match self.shape {
            Shape::Force(_) => 0,
            Shape::Box(..) => 1,
            Shape::Ball(_) => 2,
        }
    }

    fn write(&self, out: &mut CdrWriter) {
        let add = 0;
        out.text(self.name).i32(0).i32(self.kind()).i32(add);
        let (place, points) = match self.shape {
            // between two points, which are in the world already
            Shape::Force(force) => {
                let tip = self.pose.position + force * ARROW_M_PER_N;
                (Pose::default(), Some([self.pose.position, tip]))
            }
            Shape::Box(..) | Shape::Ball(_) => (self.pose, None),
        };
        pose_of(out, &place);
        match self.shape {
            Shape::Box(x, y) => vector(out, Vec2::new(x, y), HEIGHT_M),
            Shape::Ball(d) => vector(out, Vec2::new(d, d), d),
            // shaft, head and head's length
            Shape::Force(_) => vector(out, Vec2::new(0.008, 0.02), 0.02),
        }
        self.colour.iter().for_each(|part| {
            out.f32(*part);
        });
        // for ever, and not bound to its frame
        out.i32(0).u32(0).bool(false);
        out.u32(points.iter().flatten().count() as u32);
        for point in points.iter().flatten() {
            vector(out, *point, HEIGHT_M);
        }
        let none = 0;
        // no colours of points, no texture, no text, no mesh
        out.u32(none).text("");
        Stamp::default().write(out);
        out.text("").text("").bytes(&[]).u32(none);
        out.text("").text("").text("").bytes(&[]).bool(false);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_force_is_a_header_and_two_vectors() {
        let mut out = CdrWriter::default();
        let force = Standard::Force(Vec2::new(3.0, -4.0));
        force.write(out.begin(), Stamp(1_000_000_002));
        let bytes = out.message();
        // stamp, length and text of the frame, padding to 8, six doubles
        assert_eq!(bytes.len(), 4 + 8 + 4 + 6 + 6 + 48);
        assert_eq!(bytes.get(4..12), Some(&[1, 0, 0, 0, 2, 0, 0, 0][..]));
        assert_eq!(bytes.get(28..36), Some(&3.0_f64.to_le_bytes()[..]));
    }

    #[test]
    fn every_schema_defines_what_it_uses() {
        let all = [
            Standard::Pose(Pose::default()),
            Standard::Force(Vec2::zeros()),
            Standard::Twist(Twist::default()),
            Standard::Frames(&[]),
            Standard::Markers(&[]),
        ];
        for standard in all {
            let (name, schema) = standard.definition();
            let used = schema.lines().filter_map(|line| {
                let of = line.split(' ').next()?.trim_end_matches("[]");
                of.contains('/').then_some(of)
            });
            for of in used {
                let defined = schema.contains(&format!("MSG: {of}\n"));
                assert!(defined, "{name}: {of}");
            }
        }
    }
}
