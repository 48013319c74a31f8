//! The frame at the contact: which face the tool touches, where, and in which direction it pushes.

use mmt_shared::model::geometry::{Face, Vec2};

/// Where the tool touches the object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactFrame {
    /// Face that is touched.
    pub face: Face,
    /// Inward unit normal, world.
    pub inward: Vec2,
    /// Point of the object's surface under the tool, world, m.
    pub surface: Vec2,
}
