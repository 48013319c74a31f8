//! What a press that moved nothing has shown, for the touches that follow.
//!
//! It must never outlast the first motion of the object: what a wall held is free at another face.

use mmt_shared::model::geometry::Vec2;

use super::obstacle::OBSTACLE_N;

/// An object that is seen farther than this from where it was first touched, m, has been moved.
const MOVED_M: f64 = 5e-3;
/// If it is seen there for so many ticks: for a moment it seems to follow a tool that has left it, until the force that a bias
/// leaves is found to be none.
const MOVED_TICKS: u32 = 300;

/// Whether an object has stood under all that a hand has, and nothing has moved it so far.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Immovable {
    /// Where the object was seen when it was first touched, m.
    first: Option<Vec2>,
    stood: bool,
    /// For so long it has been seen elsewhere.
    elsewhere_ticks: u32,
}

impl Immovable {
    /// Takes where the centre of the object is `seen`, m, and whether it is touched.
    pub(super) fn see(&mut self, seen: Option<Vec2>, touched: bool) {
        if touched {
            self.first = self.first.or(seen);
        }
        let both = self.first.zip(seen);
        let is_there = both.is_some_and(|(first, seen)| (seen - first).norm() <= MOVED_M);
        self.elsewhere_ticks = if is_there {
            0
        } else {
            self.elsewhere_ticks.saturating_add(1)
        };
        self.stood &= self.elsewhere_ticks < MOVED_TICKS;
    }

    /// Takes a tick of contact after [`Self::see`]: the friction that holds the object as this contact shows it, N, and whether it
    /// slides for certain.
    pub(super) fn press(&mut self, holding: Option<f64>, slides: bool) {
        self.stood = holding == Some(OBSTACLE_N) || self.stood && !slides;
    }

    /// The friction that holds the object, N; none where it may move.
    pub(super) fn holding(&self) -> Option<f64> {
        self.stood.then_some(OBSTACLE_N)
    }
}
