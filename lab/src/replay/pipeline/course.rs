//! A recording on one axis of time: where the finger was, what it felt, and when the block's pose was seen.
//!
//! Between two pushes the finger was led round the block by a way that was not recorded; here it goes round it at a
//! distance. Force is known from its sample on and never before; the block is seen only where it rests. Nothing may be
//! read of a time that is still to come but the finger's own way.

use std::time::Duration;

use mmt_client::operator::trace::Trace;
use mmt_shared::model::geometry::{Pose, Vec2, rotate, wrap_angle};
use mmt_shared::recording::{Push, Recording};

/// Between two pushes the finger is as far from the block's reference point, m: clear of every corner (106 mm).
const ROUND_M: f64 = 0.13;
/// And as fast, m/s.
const ROUND_M_PER_S: f64 = 0.2;
/// Turn from one point of that way to the next, rad.
const ROUND_RAD: f64 = 0.1;
/// How long the finger stands before each push, s.
const STANDS_S: f64 = 0.3;
/// The finger is off the block so soon after a push's last sample, s.
const SOON_S: f64 = 1e-6;
/// Images per second of a block that rests: the default camera's.
const IMAGES_HZ: f64 = 30.0;

/// A recording over time, s, from 0.
#[derive(Clone, Debug, Default)]
pub(super) struct Course {
    /// The finger, m.
    finger: Vec<(f64, Vec2)>,
    /// Force on the block, N, from then on.
    force: Vec<(f64, Vec2)>,
    /// The resting block as it is seen.
    images: Vec<(f64, Pose)>,
    /// When each push begins and ends.
    pub(super) pushes: Vec<(f64, f64)>,
}

impl Course {
    pub(super) fn of(recording: &Recording) -> Self {
        let mut course = Self::default();
        let mut now_s = 0.0;
        for push in &recording.pushes {
            now_s = course.rest(now_s, push);
            now_s = course.push(now_s, push);
        }
        course
    }

    /// The way to where a push begins, with the block at rest.
    fn rest(&mut self, from_s: f64, push: &Push) -> f64 {
        let Some(first) = push.finger.first() else {
            return from_s;
        };
        let first = first.pose.position;
        let from = self.finger.last().map_or(first, |(_, at)| *at);
        let mut now_s = from_s;
        let mut at = from;
        for point in round(push.before.position, from, first) {
            now_s += (point - at).norm() / ROUND_M_PER_S;
            at = point;
            self.go(now_s, at);
        }
        now_s += STANDS_S;
        self.go(now_s, first);
        // no sample of the push before shows it
        self.feel(from_s + SOON_S, Vec2::zeros());
        let count = ((now_s - from_s) * IMAGES_HZ) as u32;
        let seen = (0..count).map(|k| (from_s + f64::from(k) / IMAGES_HZ, push.before));
        self.images.extend(seen);
        now_s
    }

    fn push(&mut self, from_s: f64, push: &Push) -> f64 {
        for sample in &push.finger {
            self.go(from_s + sample.t_s, sample.pose.position);
        }
        for sample in &push.force {
            self.feel(from_s + sample.t_s, sample.force);
        }
        let end_s = from_s + push.duration_s();
        self.images.push((end_s, push.after));
        self.pushes.push((from_s, end_s));
        self.finger.last().map_or(end_s, |(t_s, _)| t_s.max(end_s))
    }

    fn go(&mut self, t_s: f64, at: Vec2) {
        if self.finger.last().is_none_or(|(last_s, _)| *last_s < t_s) {
            self.finger.push((t_s, at));
        }
    }

    fn feel(&mut self, t_s: f64, force: Vec2) {
        if self.force.last().is_none_or(|(last_s, _)| *last_s < t_s) {
            self.force.push((t_s, force));
        }
    }

    /// The whole of it, s.
    pub(super) fn duration_s(&self) -> f64 {
        self.finger.last().map_or(0.0, |(t_s, _)| *t_s)
    }

    /// The finger's way as that of a hand; none without a sample.
    pub(super) fn hand(&self) -> Option<Trace> {
        Trace::of_samples(
            self.finger
                .iter()
                .map(|(t_s, at)| (Duration::from_secs_f64(*t_s), *at)),
        )
    }

    /// Where the block is first seen.
    pub(super) fn first_pose(&self) -> Pose {
        self.images
            .first()
            .map_or(Pose::default(), |(_, pose)| *pose)
    }

    /// The force that was last measured by then, N.
    pub(super) fn force_at(&self, t_s: f64) -> Vec2 {
        newest(&self.force, t_s).map_or(Vec2::zeros(), |(_, force)| force)
    }

    /// The push during which this is, by its number; none between pushes.
    pub(super) fn push_at(&self, t_s: f64) -> Option<usize> {
        let next = self.pushes.partition_point(|(begin_s, _)| *begin_s <= t_s);
        let index = next.checked_sub(1)?;
        let (_, end_s) = self.pushes.get(index)?;
        (t_s <= *end_s).then_some(index)
    }

    /// The image that was taken within the millisecond before.
    pub(super) fn image_at(&self, t_s: f64) -> Option<Pose> {
        let (taken_s, pose) = newest(&self.images, t_s)?;
        (t_s - taken_s < 1e-3).then_some(pose)
    }
}

/// The newest of these that is not later.
fn newest<T: Copy>(all: &[(f64, T)], t_s: f64) -> Option<(f64, T)> {
    let next = all.partition_point(|(sample_s, _)| *sample_s <= t_s);
    all.get(next.checked_sub(1)?).copied()
}

/// From one point to another, round a block, m.
fn round(block: Vec2, from: Vec2, to: Vec2) -> Vec<Vec2> {
    let heading = |point: Vec2| libm::atan2(point.y - block.y, point.x - block.x);
    let (begin, turn) = (heading(from), wrap_angle(heading(to) - heading(from)));
    let steps = libm::ceil(turn.abs() / ROUND_RAD).max(1.0) as u32;
    let at = |step: u32| {
        let angle = begin + turn * f64::from(step) / f64::from(steps);
        block + rotate(angle, Vec2::new(ROUND_M, 0.0))
    };
    (0..=steps).map(at).chain([to]).collect()
}
