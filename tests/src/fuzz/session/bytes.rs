//! How the bytes of an input are read.

use mmt_shared::model::geometry::Vec2;

/// Bytes of the head, and of an operation.
pub(in crate::fuzz) const HEAD: usize = 8;

/// A place on a table, m.
pub(super) fn place(x: u8, y: u8) -> Vec2 {
    Vec2::new(
        f64::from(x.cast_signed()) * 0.008,
        f64::from(y.cast_signed()) * 0.008,
    )
}
