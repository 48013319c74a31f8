//! The gain of the force sensor, where the stiffness of the contact is known: how contacts begin shows it.
//!
//! What is understood is an object at rest. So it must have been left alone for a while.

use std::collections::VecDeque;

use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::Vec2;

use super::onset::{AFTER, FIRST_TOUCHES, Fit, Normal, Onset, Search, Sensor, WINDOW};

/// An object that nobody has touched for so many ticks is taken to be at rest.
const AT_REST_TICKS: u32 = 300;
/// The tool's way is the mean of so many ticks to each side: the damper's force would else be the noise of its position.
const SMOOTHED: usize = 6;
/// A fit that leaves so many times the expected variance is none.
const MISFIT_MAX: f64 = 2.0;
/// No sensor's gain is farther from one, as a logarithm: more is a contact of another stiffness.
const LN_GAIN_MAX: f64 = 0.3;
/// What is known of any sensor: its gain is right within a tenth, and it lags by up to some milliseconds.
const ANY_SENSOR: Sensor = Sensor {
    ln_gain: Normal {
        mean: 0.0,
        deviation: 0.1,
    },
    lag: Normal {
        mean: 0.5,
        deviation: 0.5,
    },
};
/// However many contacts agree, ln g and the lag are known no better: the model is not exact, and a sensor ages.
const BEST: (f64, f64) = (0.01, 0.02);

/// Where the search for the gain stands.
#[derive(Clone, Copy, Debug)]
enum State {
    /// Nothing is touched, for so many ticks.
    Free(u32),
    /// An object that was at rest has been touched for so many ticks.
    Begins(usize),
    /// Its beginning is fitted, a step a tick, so that no tick takes long.
    Searches,
    /// Nothing more is to be learned from this contact.
    Ends,
}

/// The gain.
#[derive(Clone, Debug)]
pub(super) struct Gain {
    sensor: Sensor,
    state: State,
    /// Force (N) and tool (m) of the newest ticks.
    recent: VecDeque<(Vec2, Vec2)>,
    /// The beginning that is fitted, the search that goes on, and the best fit of those that ended.
    onset: Onset,
    search: Search,
    best: Option<Fit>,
}

impl Gain {
    /// By a contact of this stiffness and damping.
    pub(super) fn new(coupling: Coupling) -> Self {
        let onset = Onset {
            coupling,
            tool: [0.0; WINDOW],
            force: [0.0; WINDOW],
            noise_n: 0.0,
        };
        Self {
            sensor: ANY_SENSOR,
            // a session may go on where another has pushed
            state: State::Free(0),
            recent: VecDeque::with_capacity(WINDOW),
            search: Search::new(&onset, &ANY_SENSOR, *FIRST_TOUCHES.start()),
            onset,
            best: None,
        }
    }

    /// Measured force over true force, as it is known.
    pub(super) fn known(&self) -> f64 {
        libm::exp(self.sensor.ln_gain.mean)
    }

    /// The same once a contact has shown it.
    pub(super) fn found(&self) -> Option<f64> {
        (self.sensor != ANY_SENSOR).then(|| self.known())
    }

    /// Takes the force (N) as the sensor gives it, less its bias, of a tick with the tool at `tool` (m). `noise_n` is its noise per axis.
    pub(super) fn step(&mut self, force: Vec2, tool: Vec2, in_contact: bool, noise_n: f64) {
        while self.recent.len() >= WINDOW {
            self.recent.pop_front();
        }
        self.recent.push_back((force, tool));
        self.state = match self.state {
            State::Searches => self.search(),
            State::Free(ticks) if !in_contact => State::Free(ticks.saturating_add(1)),
            _ if !in_contact => State::Free(0),
            State::Free(ticks) if ticks >= AT_REST_TICKS => State::Begins(1),
            State::Begins(ticks) if ticks < AFTER => State::Begins(ticks + 1),
            State::Begins(_) if self.recent.len() == WINDOW => {
                self.take_newest(noise_n);
                self.best = None;
                self.begin(*FIRST_TOUCHES.start())
            }
            _ => State::Ends,
        };
    }

    /// Keeps the newest ticks along the push.
    fn take_newest(&mut self, noise_n: f64) {
        let last = self.recent.iter().rev().take(AFTER / 2);
        let pushed: Vec2 = last.map(|(force, _)| force).sum();
        let along = pushed / pushed.norm().max(f64::MIN_POSITIVE);
        self.onset.noise_n = noise_n;
        let slots = (self.onset.tool.iter_mut()).zip(&mut self.onset.force);
        for (at, ((x, f), (force, _))) in slots.zip(&self.recent).enumerate() {
            let beside = SMOOTHED.min(at).min(WINDOW - 1 - at);
            let near = self.recent.iter().skip(at - beside).take(2 * beside + 1);
            let sum: Vec2 = near.map(|(_, tool)| tool).sum();
            (*x, *f) = (sum.dot(&along) / (2 * beside + 1) as f64, force.dot(&along));
        }
    }

    fn begin(&mut self, touches: usize) -> State {
        self.search = Search::new(&self.onset, &self.sensor, touches);
        State::Searches
    }

    /// One step of the search.
    fn search(&mut self) -> State {
        if !self.search.step(&self.onset) {
            return State::Searches;
        }
        let both = [self.best, self.search.found(&self.onset)];
        let both = both.into_iter().flatten();
        self.best = both.min_by(|one, other| one.cost.total_cmp(&other.cost));
        if self.search.touches < *FIRST_TOUCHES.end() {
            return self.begin(self.search.touches + 1);
        }
        if let Some(fit) = self.best {
            self.believe(&fit);
        }
        State::Ends
    }

    fn believe(&mut self, fit: &Fit) {
        let Sensor { ln_gain, lag } = fit.sensor;
        // written so that NaN fails
        let is_sensor = fit.misfit <= MISFIT_MAX && ln_gain.mean.abs() <= LN_GAIN_MAX;
        if !is_sensor {
            return;
        }
        let (gain_best, lag_best) = BEST;
        self.sensor = Sensor {
            ln_gain: no_better(ln_gain, gain_best),
            lag: no_better(lag, lag_best),
        };
    }
}

fn no_better(known: Normal, deviation: f64) -> Normal {
    Normal {
        deviation: known.deviation.max(deviation),
        ..known
    }
}

#[cfg(test)]
mod tests;
