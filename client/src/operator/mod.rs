//! Who moves the HIP: the scripted operator or a recorded path.

pub mod hand;
mod route;
pub mod scripted;
pub mod trace;

use std::time::Duration;

use mmt_shared::model::geometry::Vec2;

use scripted::{Scripted, View};
use trace::Trace;

/// What moves the HIP.
#[derive(Clone, Debug)]
pub enum Operator {
    /// Pushes the box round its faces, with a hand that the force moves.
    Scripted(Box<Scripted>),
    /// Follows a recorded path, whatever the force.
    Trace(Trace),
}

impl Operator {
    /// Where the HIP is before the first tick, m, world.
    pub fn start(&self) -> Vec2 {
        match self {
            Self::Scripted(scripted) => scripted.hip(),
            Self::Trace(trace) => trace.at(Duration::ZERO),
        }
    }

    /// One sample period: where the HIP is now, m, world.
    ///
    /// `elapsed` is the time since the first tick, `view` what the operator sees, `force_on_hand` the
    /// device's force, N.
    pub fn step(&mut self, elapsed: Duration, view: &View, force_on_hand: Vec2) -> Vec2 {
        match self {
            Self::Scripted(scripted) => scripted.step(view, force_on_hand),
            Self::Trace(trace) => trace.at(elapsed),
        }
    }

    /// Pushes that went over their whole length; none for a path, in which no push is marked.
    pub fn pushes_completed(&self) -> Option<u64> {
        match self {
            Self::Scripted(scripted) => Some(scripted.pushes_completed()),
            Self::Trace(_) => None,
        }
    }

    /// Whether there is nothing more to do.
    pub fn finished(&self, elapsed: Duration) -> bool {
        match self {
            Self::Scripted(_) => false,
            Self::Trace(trace) => elapsed >= trace.duration(),
        }
    }
}
