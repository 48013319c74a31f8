//! What somebody else does in a millisecond of a world: a hand, an estimator or an update scheme of their own.

use mmt_server::slave::Substitutes;
use mmt_shared::model::geometry::Vec2;

/// In the place of the world's own; by default nothing.
#[derive(Default)]
pub struct Given<'a> {
    /// The HIP as the device reads it, m, world; the world's operator stands still then.
    pub hip: Option<Vec2>,
    /// Stages of the slave.
    pub slave: Substitutes<'a>,
}
