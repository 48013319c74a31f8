//! The careful operator: at a face that it does not know yet it nudges the box, rests until the answer must
//! have come, and nudges again unless the box was seen to move.
//!
//! This is move and wait, by which people handle things at a delay (Ferrell 1965). It must never look at
//! anything but the view, and never count a touch without a motion as an answer.

use mmt_shared::model::geometry::{Face, Vec2};

/// The box has really been pushed if it is seen this far from where it stood before the nudge, m: five times
/// what vision errs by default.
const MOVED_M: f64 = 0.005;

/// What the operator knows of the faces, and the nudge that it is at.
#[derive(Clone, Copy, Debug)]
pub(super) struct Care {
    nudge_m: f64,
    /// Faces that need no nudge, in the order of [`Face::ALL`].
    known: [bool; 4],
    /// Where the box stood before the first nudge of this push, m.
    stood: Option<Vec2>,
    /// Way of the push at which this nudge ends, m.
    until_m: f64,
}

impl Care {
    /// An operator that nudges by `nudge_m`, or one that knows all faces if it is not `careful`.
    pub(super) fn new(careful: bool, nudge_m: f64) -> Self {
        Self {
            nudge_m,
            known: [!careful; 4],
            stood: None,
            until_m: nudge_m,
        }
    }

    /// Whether `face` is to be nudged and not pushed.
    pub(super) fn nudges(&self, face: Face) -> bool {
        let known = Face::ALL.iter().zip(&self.known);
        known
            .into_iter()
            .any(|(other, known)| *other == face && !known)
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
        for (other, known) in Face::ALL.into_iter().zip(&mut self.known) {
            *known |= moved && other == face;
        }
        self.until_m = pushed_m + self.nudge_m;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_face_is_known_once_the_box_was_seen_to_move() {
        let mut care = Care::new(true, 0.03);
        assert!(care.nudges(Face::West) && care.nudges(Face::North));
        care.touch(Vec2::zeros());
        care.touch(Vec2::new(0.03, 0.0));
        assert!(!care.is_nudged(0.029) && care.is_nudged(0.03));
        // the answer says that it was never touched: it stands where it stood
        care.rested(Face::West, Vec2::new(0.001, 0.0), 0.03);
        assert!(care.nudges(Face::West));
        assert!(!care.is_nudged(0.059) && care.is_nudged(0.06));
        care.rested(Face::West, Vec2::new(0.006, 0.0), 0.06);
        assert!(!care.nudges(Face::West) && care.nudges(Face::North));
        care.begin();
        assert!(!care.is_nudged(0.029) && care.is_nudged(0.03));
    }

    #[test]
    fn who_is_not_careful_knows_all_faces() {
        let care = Care::new(false, 0.03);
        assert!(!Face::ALL.into_iter().any(|face| care.nudges(face)));
    }
}
