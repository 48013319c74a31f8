//! How far the surface of an object has gone in a contact.

use mmt_shared::model::geometry::Vec2;

/// The way of the surface along the normal since a contact began.
#[derive(Clone, Copy, Debug)]
pub(super) struct Way {
    began: Vec2,
    /// Low-passed, m.
    smooth: f64,
    /// The most of that, in or out, m.
    farthest: f64,
}

impl Way {
    /// The contact begins with the surface at this point, m.
    pub(super) fn new(began: Vec2) -> Self {
        Self {
            began,
            smooth: 0.0,
            farthest: 0.0,
        }
    }

    /// Takes the surface point (m) of a tick, the inward normal, and the weight of a tick in the low-pass; the way, m.
    pub(super) fn step(&mut self, point: Vec2, normal: Vec2, weight: f64) -> f64 {
        let way = normal.dot(&(point - self.began));
        self.smooth += (way - self.smooth) * weight;
        self.farthest = self.farthest.max(self.smooth.abs());
        way
    }

    /// How far the surface has been, in or out, m.
    pub(super) fn farthest(&self) -> f64 {
        self.farthest
    }
}
