//! What is held to the bound: a scheme at a deadband.

use std::time::Duration;

use mmt_server::trigger::Scheme;

use super::trace::Bounded;
use crate::experiment::prelude::*;

/// Deadbands, as shares.
pub(super) const DEADBANDS: [f64; 3] = [0.05, 0.10, 0.20];

/// Demanded: updates over the fewest.
pub(super) const TARGET: f64 = 2.0;

/// A scheme that is held to the bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Rule {
    Useful,
    Adaptive,
}

impl Rule {
    pub(super) const ALL: [Self; 2] = [Self::Useful, Self::Adaptive];

    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Useful => "useful",
            Self::Adaptive => "adaptive",
        }
    }

    /// Each with its default time.
    pub(super) fn at(self, delta: f64) -> Scheme {
        match self {
            Self::Useful => Curve::Useful(150).at(delta),
            Self::Adaptive => Scheme::Adaptive {
                delta,
                horizon: Duration::from_millis(50),
            },
        }
    }
}

/// A point of the experiment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Case {
    pub(super) rule: Rule,
    pub(super) deadband: f64,
}

impl Case {
    pub(super) fn all() -> Vec<Self> {
        let of = |rule| DEADBANDS.map(|deadband| Self { rule, deadband });
        Rule::ALL.into_iter().flat_map(of).collect()
    }

    pub(super) fn world(self) -> WorldConfig {
        paper_world(Mode::Recommended, self.rule.at(self.deadband))
    }
}

pub(super) type Group = grid::Group<Case, Bounded>;

/// Geometric mean of updates over the fewest.
pub(super) fn ratio(group: &Group) -> Option<Interval> {
    Interval::of_ratios(group.values(Bounded::ratio))
}
