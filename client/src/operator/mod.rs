//! Who moves the HIP: the scripted operator, a recorded path or a person.

pub mod hand;
pub mod pointer;
mod route;
pub mod scripted;
pub mod trace;

use std::time::Duration;

use mmt_shared::model::geometry::Vec2;

use pointer::{HandEvent, Person};
use scripted::{Scripted, View};
use trace::Trace;

/// What moves the HIP.
#[derive(Clone, Debug)]
pub enum Operator {
    /// Pushes the box round its faces, with a hand that the force moves.
    Scripted(Box<Scripted>),
    /// Follows a recorded path, whatever the force.
    Trace(Trace),
    /// A person at a pointer.
    Person(Box<Person>),
}

impl Operator {
    /// The same, beginning where the tool is (m, world): it goes round the box in `view` to its own start.
    #[must_use]
    pub fn led_from(mut self, tool: Vec2, view: &View) -> Self {
        if self.start() == tool {
            return self;
        }
        match &mut self {
            Self::Scripted(scripted) => scripted.go_on_from(tool),
            Self::Person(person) => person.go_on_from(tool),
            Self::Trace(trace) => {
                let start = trace.at(Duration::ZERO);
                let way = route::way(&view.footprint, &view.pose, tool, start);
                *trace = trace.led_along(tool, &way);
            }
        }
        self
    }

    /// Where the HIP is before the first tick, m, world.
    pub fn start(&self) -> Vec2 {
        match self {
            Self::Scripted(scripted) => scripted.hip(),
            Self::Trace(trace) => trace.at(Duration::ZERO),
            Self::Person(person) => person.hip(),
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
            Self::Person(person) => person.step(elapsed, view, force_on_hand),
        }
    }

    /// One sample period of an emergency stop, of length `period`: the HIP stays, and a person has to press anew.
    pub fn stand(&mut self, period: Duration) {
        match self {
            // it counts its own steps
            Self::Scripted(_) => {}
            Self::Trace(trace) => trace.wait(period),
            Self::Person(person) => person.let_go(),
        }
    }

    /// Takes in what a person did, which arrived at `elapsed`; other operators take nothing.
    pub fn handle(&mut self, elapsed: Duration, event: HandEvent) {
        if let Self::Person(person) = self {
            person.handle(elapsed, event);
        }
    }

    /// Whether a hand holds the device: only then force may act on it.
    pub fn engaged(&self) -> bool {
        match self {
            Self::Person(person) => person.engaged(),
            Self::Scripted(_) | Self::Trace(_) => true,
        }
    }

    /// The person, if it is one.
    pub fn person(&self) -> Option<&Person> {
        match self {
            Self::Person(person) => Some(person),
            Self::Scripted(_) | Self::Trace(_) => None,
        }
    }

    /// Pushes that went over their whole length; none for a path, in which no push is marked.
    pub fn pushes_completed(&self) -> Option<u64> {
        match self {
            Self::Scripted(scripted) => Some(scripted.pushes_completed()),
            Self::Trace(_) => None,
            Self::Person(person) => Some(person.scripted().pushes_completed()),
        }
    }

    /// Whether there is nothing more to do.
    pub fn finished(&self, elapsed: Duration) -> bool {
        match self {
            Self::Scripted(_) => false,
            Self::Trace(trace) => elapsed >= trace.duration(),
            Self::Person(person) => person.finished(),
        }
    }
}
