//! Recorded pushes of a real block by a robot's finger (Carnegie Mellon, 2015): text in, SI units out.
//!
//! The grammar is white space separated: number of pushes; per push the block's pose before and after
//! (x y z in mm, quaternion w x y z), the number of force samples and as many `t fx fy` (s, N), the number
//! of finger samples and as many `t x y z qw qx qy qz` (s, mm). The file must never make the parser panic
//! or take memory out of proportion to its length.
//!
//! Frames: what leaves here is in the world, in m, rad, N and s. The block's reference point is the
//! recorded pose shifted by (50, 50, 0) mm in the block's frame: the centroid of the right triangle whose
//! right angle is the recorded point and whose legs, 150 mm long, are the block's x and y axes.

mod words;

pub use words::ParseError;

use crate::model::geometry::{Pose, Vec2, rotate, wrap_angle};
use words::Words;

/// The block's reference point in the frame of the recorded pose, m: the centroid of a right triangle with legs of 150 mm.
pub const REFERENCE_M: (f64, f64) = (0.050, 0.050);

/// The most pushes that a recording may hold.
pub const PUSHES_MAX: usize = 10_000;
/// The most force samples, and finger samples, that a push may hold: 2.8 hours at 100 Hz.
pub const SAMPLES_MAX: usize = 1_000_000;

/// One reading of the force sensor in the finger.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceSample {
    /// Time since the push's first force sample, s.
    pub t_s: f64,
    /// Force on the block, world frame, N; the push's first reading is taken as the sensor's bias.
    pub force: Vec2,
}

/// One reading of the finger's pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FingerSample {
    /// Time since the push's first force sample, s.
    pub t_s: f64,
    /// Finger in the world: its tip and its yaw.
    pub pose: Pose,
}

/// One recorded push. The block's pose between `before` and `after` was not recorded.
#[derive(Clone, Debug, PartialEq)]
pub struct Push {
    /// The block's reference point before the push, `world_from_object`.
    pub before: Pose,
    /// The block's reference point after it; its angle is within half a turn of the one before.
    pub after: Pose,
    /// Force on the block over time, about 100 Hz; at least two samples, time strictly increasing.
    pub force: Vec<ForceSample>,
    /// The finger's path, about 33 Hz; at least two samples, time strictly increasing.
    pub finger: Vec<FingerSample>,
}

impl Push {
    /// Mean force on the block times the displacement of its reference point, N m: positive when force
    /// and motion are in the same frame with the same sign.
    pub fn force_times_displacement(&self) -> f64 {
        let sum: Vec2 = self.force.iter().map(|sample| sample.force).sum();
        sum.dot(&(self.after.position - self.before.position)) / self.force.len().max(1) as f64
    }

    /// Time from the first to the last force sample, s.
    pub fn duration_s(&self) -> f64 {
        self.force.last().map_or(0.0, |sample| sample.t_s)
    }
}

/// A file of recorded pushes.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// The pushes in the order of the file; at least one.
    pub pushes: Vec<Push>,
}

impl Recording {
    /// Reads the text of a recording.
    ///
    /// # Errors
    /// Names the place (line and column), what was being read, what was found and what is expected: a word that
    /// is not a number, a number that is not finite or out of range, a count of nothing or of too much, a
    /// quaternion that is no rotation, time that does not increase, a text that is too short or too long.
    pub fn parse(text: &str) -> Result<Self, ParseError> {
        let mut words = Words::new(text);
        let count = words.count("the number of pushes", 1, PUSHES_MAX)?;
        let mut pushes = Vec::new();
        for _ in 0..count {
            pushes.push(push(&mut words)?);
        }
        words.end()?;
        Ok(Self { pushes })
    }
}

fn push(words: &mut Words<'_>) -> Result<Push, ParseError> {
    let before = block(words, "the block's pose before the push")?;
    let after = block(words, "the block's pose after the push")?;
    let turn = wrap_angle(after.angle - before.angle);
    let after = Pose {
        angle: before.angle + turn,
        ..after
    };
    let readings = readings(words)?;
    let start_s = readings.first().map_or(0.0, |(t_s, _)| *t_s);
    let finger = finger(words, start_s)?;
    Ok(Push {
        before,
        after,
        force: force_on_block(&readings, start_s, &finger),
        finger,
    })
}

/// The block's reference point, from the recorded pose of its right-angled corner.
fn block(words: &mut Words<'_>, what: &'static str) -> Result<Pose, ParseError> {
    let corner = pose(words, what)?;
    let reference = Vec2::new(REFERENCE_M.0, REFERENCE_M.1);
    Ok(Pose {
        position: corner.point_to_world(reference),
        angle: corner.angle,
    })
}

/// x y z in mm and a quaternion w x y z: the planar pose in m and rad.
fn pose(words: &mut Words<'_>, what: &'static str) -> Result<Pose, ParseError> {
    let (x, y) = (words.millimetres(what)?, words.millimetres(what)?);
    words.millimetres(what)?;
    Ok(Pose::new(x, y, words.yaw(what)?))
}

/// The force sensor's own readings, N, in its own frame.
fn readings(words: &mut Words<'_>) -> Result<Vec<(f64, Vec2)>, ParseError> {
    let count = words.count("the number of force samples", 2, SAMPLES_MAX)?;
    let mut readings = Vec::new();
    let mut last_s = f64::NEG_INFINITY;
    for _ in 0..count {
        last_s = words.time("a force sample's time", last_s)?;
        let x = words.newtons("a force sample's fx")?;
        let y = words.newtons("a force sample's fy")?;
        readings.push((last_s, Vec2::new(x, y)));
    }
    Ok(readings)
}

fn finger(words: &mut Words<'_>, start_s: f64) -> Result<Vec<FingerSample>, ParseError> {
    let count = words.count("the number of finger samples", 2, SAMPLES_MAX)?;
    let mut path = Vec::new();
    let mut last_s = f64::NEG_INFINITY;
    for _ in 0..count {
        last_s = words.time("a finger sample's time", last_s)?;
        path.push(FingerSample {
            t_s: last_s - start_s,
            pose: pose(words, "a finger's pose")?,
        });
    }
    Ok(path)
}

/// Force on the block in the world: −R·reading, less its first value, turned by the finger's yaw, with
/// R = [[√½, √½], [√½, −√½]]ᵀ (symmetric: a reflection).
fn force_on_block(
    readings: &[(f64, Vec2)],
    start_s: f64,
    finger: &[FingerSample],
) -> Vec<ForceSample> {
    let in_finger = |reading: Vec2| {
        let (x, y) = (reading.x + reading.y, reading.x - reading.y);
        -Vec2::new(x, y) * std::f64::consts::FRAC_1_SQRT_2
    };
    let bias = readings
        .first()
        .map_or_else(Vec2::zeros, |(_, first)| in_finger(*first));
    let mut yaw = Yaw::along(finger);
    readings
        .iter()
        .map(|(t_s, reading)| {
            let t_s = t_s - start_s;
            let force = rotate(yaw.at(t_s), in_finger(*reading) - bias);
            ForceSample { t_s, force }
        })
        .collect()
}

/// The finger's yaw over time, asked for at times that do not decrease: linear between samples, by the
/// shorter way round, and held beyond the ends.
struct Yaw<'a> {
    rest: &'a [FingerSample],
}

impl<'a> Yaw<'a> {
    fn along(finger: &'a [FingerSample]) -> Self {
        Self { rest: finger }
    }

    fn at(&mut self, t_s: f64) -> f64 {
        loop {
            match self.rest {
                [from, to, ..] if t_s < to.t_s => {
                    let share = ((t_s - from.t_s) / (to.t_s - from.t_s)).clamp(0.0, 1.0);
                    let turn = wrap_angle(to.pose.angle - from.pose.angle);
                    return from.pose.angle + share * turn;
                }
                [_, rest @ ..] if !rest.is_empty() => self.rest = rest,
                [last] => return last.pose.angle,
                _ => return 0.0,
            }
        }
    }
}

#[cfg(test)]
mod tests;
