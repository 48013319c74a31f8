//! A row of the table of worlds.

use super::run::Measured as Reached;
use crate::worlds::RandomWorld;

/// A world and what came of it.
pub(super) struct Row {
    pub(super) world: RandomWorld,
    pub(super) reached: Reached,
}
