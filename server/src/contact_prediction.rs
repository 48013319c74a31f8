//! Where a tool will touch an object that is pushed slowly, and what force will meet it there: learned from the pushes before.
//!
//! Each push shows a point of the outline and, by how the object moved, what its support is. A tool that goes straight on at
//! some mm/s meets the side through which its way enters the object, and moves the touched point along with it; where that takes a
//! force that the tool's friction does not bear, the tool slips along the side and the force is at the edge of the friction
//! cone. Pure; it is given poses of the observer only, and must never use a force for the prediction of its own push.

mod fit;
mod outline;
mod support;

use std::collections::VecDeque;

use mmt_shared::model::geometry::{Pose, Vec2, cross, rotate, wrap_angle};
use mmt_shared::stats::values::quantile;
use mmt_shared::time::TICK_S;

use outline::{Side, Touch};

pub use fit::{Observation, fit};
pub use support::Support;

/// Support before any push: the estimators' first friction, the arm of a block of 0.1 m.
const START: Support = Support {
    friction_n: 1.0,
    arm_m: 0.05,
    centre_m: Vec2::new(0.0, 0.0),
};
/// Pushes that are remembered.
const PUSHES: usize = 50;
/// Pushes from which on the friction of the tool is known.
const KNOWN: usize = 3;
/// Half of the friction cone before, rad, and the share of the pushes that lie within what is learned.
const CONE: (f64, f64) = (0.42, 0.8);
/// A push that moved the object less shows no support, m.
const MOVED_M: f64 = 1e-3;
/// Way of the tool in contact before its force counts, m.
const ONSET_M: f64 = 0.3e-3;
/// Time after a contact in which images show where the object was left, s.
const SEEN_S: f64 = 0.25;
/// A tool that touches something at the end of its way is between so slow and so fast, m/s.
const SLOW_M_PER_S: (f64, f64) = (0.5e-3, 0.02);
/// Time constant of its speed, s.
const VELOCITY_S: f64 = 0.05;
/// Way that shows where it goes, m.
const STRAIGHT_M: f64 = 0.4e-3;
/// A force below this has no direction, N.
const LEAST_N: f64 = 1e-9;
/// Contact is expected no farther ahead than this, m.
const AHEAD_M: f64 = 0.02;
/// A tool that has touched nothing so far inside the expected surface refutes it, m.
const REFUTED_M: f64 = 2e-3;

/// A contact that is to come, world frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expected {
    /// Where the tool will touch the object, m.
    pub point: Vec2,
    /// Force on the object while it is pushed there, N.
    pub force: Vec2,
}

/// One contact while it lasts.
#[derive(Clone, Copy, Debug)]
struct Push {
    /// Where it began and where the tool is, m.
    began: Vec2,
    tool: Vec2,
    /// Direction of the tool before, of length 1; none if it was not expected to touch anything.
    heading: Option<Vec2>,
    /// Where the object lay before.
    before: Pose,
    /// Sum of the force after the onset, N, and its ticks.
    force: Vec2,
    ticks: u32,
}

/// Push as it is remembered: motion of the touched point, and that point.
#[derive(Clone, Copy, Debug)]
struct Motion {
    touched: Vec2,
    way: Vec2,
}

/// Learns from pushes and predicts the next one.
#[derive(Clone, Debug)]
pub struct ContactPredictor {
    touches: VecDeque<(Touch, Option<Vec2>)>,
    pushes: VecDeque<Observation<Motion>>,
    sides: Vec<Side>,
    support: Support,
    /// Half of the friction cone, rad.
    cone: f64,
    push: Option<Push>,
    /// Where the object was seen when nothing touched it.
    seen: Pose,
    /// Time since the last contact, s.
    free_s: f64,
    /// Where the tool's straight way began and where the tool was last, m.
    way: Option<(Vec2, Vec2)>,
    /// The tool's speed, smoothed, m/s.
    velocity: Vec2,
    expected: Option<Expected>,
}

impl Default for ContactPredictor {
    fn default() -> Self {
        Self {
            touches: VecDeque::with_capacity(PUSHES),
            pushes: VecDeque::with_capacity(PUSHES),
            sides: Vec::new(),
            support: START,
            cone: CONE.0,
            push: None,
            seen: Pose::default(),
            free_s: 0.0,
            way: None,
            velocity: Vec2::zeros(),
            expected: None,
        }
    }
}

impl ContactPredictor {
    /// One that has learned nothing and expects this.
    #[cfg(test)]
    pub(crate) fn expecting(expected: Expected) -> Self {
        Self {
            expected: Some(expected),
            ..Self::default()
        }
    }

    /// The contact that is to come; none where none can be predicted. In a contact it is the one that was predicted.
    #[must_use]
    pub fn expected(&self) -> Option<Expected> {
        self.expected
    }

    /// One tick: the tool (m), the force on the object (N) if the tool touches it, and where the object is seen, which counts
    /// only while nothing touches it. A tick with a number that is none shows nothing.
    pub fn step(&mut self, tool: Vec2, touched: Option<Vec2>, seen: Pose) {
        let is_finite = |v: Vec2| v.x.is_finite() && v.y.is_finite();
        match touched {
            _ if !is_finite(tool) || !seen.is_finite() => {}
            Some(force) if is_finite(force) => self.touch(tool, force),
            Some(_) => {}
            None => self.move_on(tool, seen),
        }
    }

    fn touch(&mut self, tool: Vec2, force: Vec2) {
        let heading = self.heading();
        let push = self.push.get_or_insert(Push {
            began: tool,
            tool,
            heading,
            before: self.seen,
            force: Vec2::zeros(),
            ticks: 0,
        });
        push.tool = tool;
        if (tool - push.began).norm() > ONSET_M {
            push.force += force;
            push.ticks = push.ticks.saturating_add(1);
        }
        (self.free_s, self.way) = (0.0, None);
    }

    fn move_on(&mut self, tool: Vec2, seen: Pose) {
        self.free_s += TICK_S;
        self.seen = seen;
        if self.push.is_some() && self.free_s > SEEN_S {
            self.learn(seen);
        }
        self.follow(tool);
        self.expected = self.predict(tool, seen);
    }

    /// Follows the way of a tool that touches nothing.
    fn follow(&mut self, tool: Vec2) {
        let (began, last) = self.way.unwrap_or((tool, tool));
        let velocity = (tool - last) / TICK_S;
        self.velocity += (velocity - self.velocity) * (TICK_S / VELOCITY_S);
        let (least, most) = SLOW_M_PER_S;
        let slow = (least..most).contains(&self.velocity.norm()) && velocity.norm() < most;
        self.way = Some((if slow { began } else { tool }, tool));
    }

    /// Where a tool goes that goes slowly and straight on.
    fn heading(&self) -> Option<Vec2> {
        let (began, last) = self.way?;
        let way = last - began;
        (way.norm() > STRAIGHT_M).then(|| way.normalize())
    }

    fn predict(&self, tool: Vec2, seen: Pose) -> Option<Expected> {
        let to_object = |v: Vec2| rotate(-seen.angle, v);
        let heading = to_object(self.heading()?);
        let (distance, side) = outline::ahead(&self.sides, seen.point_to_object(tool), heading)?;
        if !(-REFUTED_M..AHEAD_M).contains(&distance) {
            return None;
        }
        let distance = distance.max(0.0);
        let point = seen.point_to_object(tool) + heading * distance;
        let force = self.force(point, heading, side.inward);
        // NaN fails
        (force.norm() > LEAST_N).then(|| Expected {
            point: seen.point_to_world(point),
            force: rotate(seen.angle, force),
        })
    }

    /// Force (N) on the object that a tool meets at `point` (m), object's frame.
    fn force(&self, point: Vec2, heading: Vec2, inward: Vec2) -> Vec2 {
        let force = self.support.force_at(point, heading);
        let angle = libm::atan2(cross(inward, force), inward.dot(&force));
        if angle.abs() <= self.cone {
            return force;
        }
        let edge = rotate(self.cone.copysign(angle), inward);
        self.support.force_along(point, edge)
    }

    /// A push is over, and the object lies where it is `seen` now.
    fn learn(&mut self, seen: Pose) {
        let Some(push) = self.push.take().filter(|push| push.ticks > 0) else {
            return;
        };
        let force = push.force / f64::from(push.ticks);
        let turn = wrap_angle(seen.angle - push.before.angle);
        let halfway = push.before.angle + turn / 2.0;
        let touched = seen.point_to_object(push.tool);
        let way = rotate(-halfway, push.tool - push.before.point_to_world(touched));
        let Some(direction) = force
            .try_normalize(LEAST_N)
            .filter(|_| way.norm() > MOVED_M)
        else {
            return;
        };
        let before = |v: Vec2| rotate(-push.before.angle, v);
        let touch = Touch {
            point: push.before.point_to_object(push.began),
            force: before(direction),
        };
        keep(&mut self.touches, (touch, push.heading.map(before)));
        let motion = Motion { touched, way };
        let force = rotate(-halfway, force);
        keep(&mut self.pushes, Observation { motion, force });
        let all: Vec<Touch> = self.touches.iter().map(|(touch, _)| *touch).collect();
        self.sides = outline::sides(&all);
        let law = |support: &Support, motion: &Motion| support.force_at(motion.touched, motion.way);
        self.support = fit(law, &START, &self.support, self.pushes.make_contiguous());
        self.learn_cone();
    }

    fn learn_cone(&mut self) {
        let angles = self.touches.iter().filter_map(|(touch, heading)| {
            let from = touch.point - (*heading)? * REFUTED_M;
            let (_, side) = outline::ahead(&self.sides, from, (*heading)?)?;
            Some(cross(side.inward, touch.force).abs().min(1.0))
        });
        let mut sines: Vec<f64> = angles.collect();
        sines.sort_by(f64::total_cmp);
        if sines.len() >= KNOWN
            && let Some(sine) = quantile(&sines, CONE.1)
        {
            self.cone = libm::asin(sine);
        }
    }
}

fn keep<T>(all: &mut VecDeque<T>, new: T) {
    if all.len() == PUSHES {
        all.pop_front();
    }
    all.push_back(new);
}

#[cfg(test)]
mod tests;
