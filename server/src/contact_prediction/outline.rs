//! The sides of an object, as far as touches have shown them.
//!
//! A side is a line that several touched points lie near, with no touched point beyond it, each pushed more or less across
//! it. No number of sides and no angle between them is assumed, only that the object is convex: it lies within all of them.
//! Frame: the object's.

use mmt_shared::model::geometry::{Vec2, rotate};
use nalgebra::Matrix2;

/// A touched point lies this close to its side, m: two and a half times how well pose and tool are known together.
const NEAR_M: f64 = 1.5e-3;
/// No touched point lies farther beyond a side, m.
const BEYOND_M: f64 = 3e-3;
/// Touched points show a line when they are so far apart, m.
const APART_M: f64 = 0.015;
/// A force turned farther from a normal, as a cosine, is no push against that side: more than any tool's friction (38°).
const ACROSS: f64 = 0.79;
/// Beyond the outermost touched points a side is known to go on so far, m.
const ENDS_M: f64 = 0.05;
/// A side is met by a tool whose way is turned less from its normal than this, as a cosine.
const MEETS: f64 = 0.3;

/// Where an object was touched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Touch {
    /// The point, m.
    pub(super) point: Vec2,
    /// Direction of the force on the object, of length 1.
    pub(super) force: Vec2,
}

/// A line along which an object ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Side {
    /// A point of it: the middle of those that were touched, m.
    middle: Vec2,
    /// Its normal into the object, of length 1.
    pub(super) inward: Vec2,
    /// The touched points along it, from `middle` to the right hand of `inward`, m.
    touched: (f64, f64),
}

impl Side {
    /// The line through some touches on the side of `inward`; none if they are too close together.
    fn through(touches: &[Touch], inward: Vec2) -> Option<Self> {
        let count = touches.len() as f64;
        let middle = touches.iter().map(|touch| touch.point).sum::<Vec2>() / count;
        let offsets = || touches.iter().map(|touch| touch.point - middle);
        let spread: Matrix2<f64> = offsets().map(|offset| offset * offset.transpose()).sum();
        let angle = 0.5 * libm::atan2(2.0 * spread.m12, spread.m11 - spread.m22);
        let normal = rotate(angle, Vec2::new(0.0, 1.0));
        let inward = normal * normal.dot(&inward).signum();
        let along = right_of(inward);
        let (from, to) = offsets()
            .map(|offset| offset.dot(&along))
            .fold((0.0, 0.0), |(low, high): (f64, f64), at| {
                (low.min(at), high.max(at))
            });
        (to - from >= APART_M).then_some(Self {
            middle,
            inward,
            touched: (from, to),
        })
    }
}

/// The sides that the touches show, the one with the most touches first.
pub(super) fn sides(touches: &[Touch]) -> Vec<Side> {
    let mut left = touches.to_vec();
    let mut found = Vec::new();
    while let Some((own, inward)) = most_touched(touches, &left) {
        found.extend(Side::through(&own, inward));
        left.retain(|touch| !own.contains(touch));
    }
    found
}

/// Of all lines through two of the touches that are `left`, the one that the most of them lie near: those, and its normal.
fn most_touched(all: &[Touch], left: &[Touch]) -> Option<(Vec<Touch>, Vec2)> {
    let lines = left
        .iter()
        .flat_map(|a| left.iter().filter_map(|b| Line::through(a, b)));
    let possible = lines.filter(|line| all.iter().all(|touch| line.depth(touch) > -BEYOND_M));
    let touched = |line: &Line| left.iter().filter(|touch| line.is_near(touch)).count();
    let best = possible.max_by_key(touched)?;
    let own = left.iter().filter(|touch| best.is_near(touch));
    Some((own.copied().collect(), best.inward))
}

/// A line that may be a side.
struct Line {
    from: Vec2,
    inward: Vec2,
}

impl Line {
    /// From one touch to the right of it to another; none if they are too close together or were not pushed across it.
    fn through(a: &Touch, b: &Touch) -> Option<Self> {
        let way = b.point - a.point;
        let line = Self {
            from: a.point,
            inward: rotate(std::f64::consts::FRAC_PI_2, way.try_normalize(APART_M)?),
        };
        (line.is_near(a) && line.is_near(b)).then_some(line)
    }

    /// How far inside a touched point is, m.
    fn depth(&self, touch: &Touch) -> f64 {
        self.inward.dot(&(touch.point - self.from))
    }

    /// Whether a touch may have been one of this side.
    fn is_near(&self, touch: &Touch) -> bool {
        let across = self.inward.dot(&touch.force) > ACROSS;
        across && self.depth(touch).abs() < NEAR_M
    }
}

/// How far ahead of `from` (m) in the direction `heading` the tool enters the object, m, and through which side; negative
/// where it should have entered already. None where no side is known that far.
pub(super) fn ahead(sides: &[Side], from: Vec2, heading: Vec2) -> Option<(f64, Side)> {
    let met = sides.iter().filter_map(|side| {
        let across = side.inward.dot(&heading);
        let distance = side.inward.dot(&(side.middle - from)) / across;
        (across > MEETS).then_some((distance, *side))
    });
    // inside a convex object is whatever is inside of all its sides
    let (distance, side) = met.max_by(|(a, _), (b, _)| a.total_cmp(b))?;
    let along = right_of(side.inward).dot(&(from + heading * distance - side.middle));
    let (low, high) = side.touched;
    (along > low - ENDS_M && along < high + ENDS_M).then_some((distance, side))
}

fn right_of(inward: Vec2) -> Vec2 {
    rotate(-std::f64::consts::FRAC_PI_2, inward)
}
