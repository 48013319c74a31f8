//! A reading of a pointer.

use mmt_shared::model::geometry::Vec2;

/// Where the pointer was, and when by the page's clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointerSample {
    /// s, the page's clock.
    pub page_s: f64,
    /// m, world.
    pub at: Vec2,
}

impl PointerSample {
    pub(super) fn is_finite(&self) -> bool {
        self.page_s.is_finite() && self.at.x.is_finite() && self.at.y.is_finite()
    }
}
