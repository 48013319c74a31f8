//! What the observer took for true in the last quarter of a second: vision is late.

use mmt_shared::model::geometry::{Pose, Twist, Vec2};
use mmt_shared::time::Time;

use super::contact_frame::ContactFrame;

/// Ticks that are kept: 256 ms.
const TICKS: usize = 256;

/// One tick.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Past {
    pub(super) time: Time,
    pub(super) tool: Vec2,
    pub(super) pose: Pose,
    pub(super) contact: Option<ContactFrame>,
    /// By how much the force was taken to be turned from the normal of the face, rad.
    pub(super) force_turned: f64,
}

/// A ring of ticks. It is on the heap: it is larger than all the rest of a slave.
#[derive(Clone, Debug)]
pub(super) struct PastPoses {
    ring: Box<[Past; TICKS]>,
    next: usize,
}

impl Default for PastPoses {
    fn default() -> Self {
        Self {
            ring: Box::new([Past::default(); TICKS]),
            next: 0,
        }
    }
}

impl PastPoses {
    pub(super) fn push(&mut self, past: Past) {
        if let Some(slot) = self.ring.get_mut(self.next) {
            *slot = past;
        }
        self.next = (self.next + 1) % TICKS;
    }

    /// When the newest was; a clock that was set back leaves later times in the ring.
    pub(super) fn newest(&self) -> Time {
        let newest = self.ring.get((self.next + TICKS - 1) % TICKS);
        newest.map_or(Time::ZERO, |past| past.time)
    }

    /// An object that nobody touches was found to be off by `off`, and to drift off at the rate `rate`, at `since`:
    /// so was all that was taken for true from then on.
    pub(super) fn correct(&mut self, since: Time, off: Pose, rate: Twist) {
        for past in self.ring.iter_mut().filter(|past| past.time >= since) {
            let seconds = past.time.saturating_since(since).as_secs_f64();
            past.pose = corrected(past.pose, off, rate, seconds);
        }
    }

    /// The newest that is not later than `time`.
    pub(super) fn at(&self, time: Time) -> Option<Past> {
        // the ring is short and vision is slow: a search is cheap
        self.ring
            .iter()
            .filter(|past| past.time <= time && past.time > Time::ZERO)
            .max_by_key(|past| past.time)
            .copied()
    }
}

/// A pose that is off by `off`, and by `rate` for some seconds.
pub(super) fn corrected(pose: Pose, off: Pose, rate: Twist, seconds: f64) -> Pose {
    Pose {
        position: pose.position + off.position + rate.linear * seconds,
        angle: pose.angle + off.angle + rate.angular * seconds,
    }
}
