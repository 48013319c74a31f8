//! What outlives a session: where the bodies lie, what was found of them, and where the tool is.

use std::collections::BTreeMap;

use mmt_shared::model::geometry::{Pose, Vec2};
use serde::{Deserialize, Serialize};

use super::object::Found;

/// What a slave leaves for the next session.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Memory {
    /// Where the bodies lie, in the order of their numbers in the scene.
    pub(super) bodies: Vec<Pose>,
    /// Number of the body that was touched last.
    pub(super) touched: usize,
    /// What was found, by the bodies' numbers.
    pub(super) found: BTreeMap<usize, Found>,
    /// Where the tool is, m, world frame.
    pub(super) tool: Vec2,
}
