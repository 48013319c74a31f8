//! The careful operator: at a face that it does not know yet it nudges the box, rests until the answer must
//! have come, and nudges again unless the box was seen to move.
//!
//! This is move and wait, by which people handle things at a delay (Ferrell 1965). It must never use
//! anything but the view, and never count a touch without a motion as an answer.

use mmt_shared::model::geometry::{Face, PerFace, Vec2};

/// The box has really been pushed if it is seen this far from where it stood before the nudge, m: five times
/// what vision errs by default.
const MOVED_M: f64 = 0.005;

/// What the operator knows of the faces, and the current nudge.
#[derive(Clone, Copy, Debug)]
pub(super) struct NudgePolicy {
    nudge_m: f64,
    /// Whether a face needs no nudge.
    known: PerFace<bool>,
    /// Where the box stood before the first nudge of this push, m.
    stood: Option<Vec2>,
    /// Way of the push at which this nudge ends, m.
    until_m: f64,
}

impl NudgePolicy {
    /// An operator that nudges by `nudge_m`, or one that knows all faces if it is not `careful`.
    pub(super) fn new(careful: bool, nudge_m: f64) -> Self {
        Self {
            nudge_m,
            known: PerFace::all(!careful),
            stood: None,
            until_m: nudge_m,
        }
    }

    /// Whether `face` is to be nudged and not pushed.
    pub(super) fn nudges(&self, face: Face) -> bool {
        !self.known.get(face)
    }

    /// Begins a push.
    pub(super) fn begin(&mut self) {
        (self.stood, self.until_m) = (None, self.nudge_m);
    }

    /// The tool touches a box that stands at `position`, m.
    pub(super) fn touch(&mut self, position: Vec2) {
        self.stood.get_or_insert(position);
    }

    /// Whether the nudge is over when the push has gone `pushed_m`.
    pub(super) fn is_nudged(&self, pushed_m: f64) -> bool {
        pushed_m >= self.until_m
    }

    /// The rest after a nudge of `face` is over: the box is seen at `position` (m) and has been pushed `pushed_m`.
    pub(super) fn rested(&mut self, face: Face, position: Vec2, pushed_m: f64) {
        let moved = self
            .stood
            .is_some_and(|stood| (position - stood).norm() >= MOVED_M);
        *self.known.get_mut(face) |= moved;
        self.until_m = pushed_m + self.nudge_m;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_face_is_known_once_the_box_was_seen_to_move() {
        let mut policy = NudgePolicy::new(true, 0.03);
        assert!(policy.nudges(Face::West) && policy.nudges(Face::North));
        policy.touch(Vec2::zeros());
        policy.touch(Vec2::new(0.03, 0.0));
        assert!(!policy.is_nudged(0.029) && policy.is_nudged(0.03));
        // the answer shows that it was never touched: it stands where it stood
        policy.rested(Face::West, Vec2::new(0.001, 0.0), 0.03);
        assert!(policy.nudges(Face::West));
        assert!(!policy.is_nudged(0.059) && policy.is_nudged(0.06));
        policy.rested(Face::West, Vec2::new(0.006, 0.0), 0.06);
        assert!(!policy.nudges(Face::West) && policy.nudges(Face::North));
        policy.begin();
        assert!(!policy.is_nudged(0.029) && policy.is_nudged(0.03));
    }

    #[test]
    fn who_is_not_careful_knows_all_faces() {
        let policy = NudgePolicy::new(false, 0.03);
        assert!(!Face::ALL.into_iter().any(|face| policy.nudges(face)));
    }
}
