//! The frame at the contact: which face the tool touches, where, and in which direction it pushes.

use mmt_shared::model::geometry::{Face, Vec2};

/// Where the tool touches the object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactFrame {
    /// Face that is touched.
    pub face: Face,
    /// Inward unit normal, world.
    pub inward: Vec2,
    /// Point of the object's surface under the tool, world, m: where a contact of k_p would have it.
    pub surface: Vec2,
    /// How far before that the surface itself lies, m: [`ContactForce::beyond_m`](super::ContactForce).
    pub beyond_m: f64,
}
