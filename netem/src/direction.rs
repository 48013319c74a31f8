//! Which link of a path: its direction, and which path of one seed.
//!
//! It does not depend on what a link does.

use serde::{Deserialize, Serialize};

/// Which way packets go.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Direction {
    /// From master to slave.
    Up,
    /// From slave to master.
    Down,
}

impl Direction {
    /// The other way.
    #[must_use]
    pub fn opposite(self) -> Self {
        match self {
            Self::Up => Self::Down,
            Self::Down => Self::Up,
        }
    }

    /// The direction as the words spell it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Up => "up",
            Self::Down => "down",
        }
    }
}

/// Which link this is among those of one seed: two links of one seed draw different numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct LinkId {
    /// The number of the path.
    pub path: u64,
    /// The direction on it.
    pub direction: Direction,
}

impl LinkId {
    /// Master to slave on path 0.
    pub const UP: Self = Self::first(Direction::Up);
    /// Slave to master on path 0.
    pub const DOWN: Self = Self::first(Direction::Down);

    /// A direction of path 0.
    #[must_use]
    pub const fn first(direction: Direction) -> Self {
        Self { path: 0, direction }
    }
}
