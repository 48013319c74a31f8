//! The limit on the force with which the tool presses on the object.
//!
//! An object that a wall stops would be pressed on with k_p times the way that the hand has gone since, which at a delay is
//! a lot. So the part of the tool's way that would raise the contact force above the limit is not gone. Pure: the sensor's
//! force in, a way out, a tick at a time. It must never shorten the way of a tick along the face, and never one that is allowed.

#[cfg(test)]
mod tests;

use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::model::tool::TOOL_FORCE_N;
use mmt_shared::range::{OutOfRange, in_range};
use mmt_shared::time::TICK_S;

/// Share of the limit that is left for what the prediction of a tick's force cannot have: an object that moves within the tick,
/// a sensor's noise. Found by `mmt reproduce touch`, whose greatest force without it was less than so much above the limit.
const MARGIN: f64 = 0.04;
/// Least share of the way to the limit that the tool goes in a tick: a contact of ten times k_p comes to rest with it, behind a
/// sensor that lags by 20 ms.
const GAIN_LEAST: f64 = 1.0 / 8.0;
/// Over this time the tool's velocity is averaged, s: longer than a swing about the limit takes.
const MEAN_S: f64 = 0.05;
/// What is too slow, in messages.
const APPROACH_NAME: &str =
    "tool: speed of approach, limit of the force / (contact damping + 2 stiffness T)";
/// Accepted speed at which the tool may touch, m/s: a slower tool follows no hand.
const APPROACH_M_PER_S: (f64, f64) = (0.1, f64::MAX);

/// The limit, and what came of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToolForce {
    max_n: f64,
    coupling: Coupling,
    /// The tool's velocity at the last measured force, m/s.
    velocity: Vec2,
    held_ticks: u64,
    peak_n: f64,
    /// Share of the way to the limit that the tool goes in a tick, in this contact.
    gain: f64,
    /// The tool's mean velocity of late, m/s: with it goes an object that gives way.
    mean_velocity: Vec2,
    /// Whether the force has not been foreseen since it was last within the aim.
    beyond: bool,
}

impl ToolForce {
    /// A tool that presses with `max_n` (N) at the most on what it touches by `coupling`.
    ///
    /// # Errors
    /// When the limit is not within its range.
    pub fn try_new(max_n: f64, coupling: Coupling) -> Result<Self, OutOfRange> {
        in_range("tool force: limit", "N", max_n, TOOL_FORCE_N)?;
        Ok(Self {
            max_n,
            coupling,
            velocity: Vec2::zeros(),
            held_ticks: 0,
            peak_n: 0.0,
            gain: 1.0,
            mean_velocity: Vec2::zeros(),
            beyond: false,
        })
    }

    /// The limit, N.
    #[must_use]
    pub fn max_n(&self) -> f64 {
        self.max_n
    }

    /// The force that no predicted one exceeds where this is the limit, N.
    #[must_use]
    pub fn aim_n(max_n: f64) -> f64 {
        max_n * (1.0 - MARGIN)
    }

    /// The speed at which a touch that nobody foresaw costs the limit at most, m/s: f_max less the margin, over
    /// (k_d + 2 k_p T). The tool is inside of the object for a tick before its force is measured, and for another
    /// before it stops.
    ///
    /// # Errors
    /// When that is below 0.1 m/s: the coupling is too stiff or too damped for the limit.
    pub fn approach_speed(&self) -> Result<f64, OutOfRange> {
        let Coupling {
            stiffness_n_per_m: k_p,
            damping_ns_per_m: k_d,
        } = self.coupling;
        let speed = Self::aim_n(self.max_n) / (k_d + 2.0 * k_p * TICK_S);
        in_range(APPROACH_NAME, "m/s", speed, APPROACH_M_PER_S)?;
        Ok(speed)
    }

    /// The tool's velocity in the last tick, m/s.
    pub(super) fn velocity(&self) -> Vec2 {
        self.velocity
    }

    /// Ticks in which the limit shortened the tool's way.
    #[must_use]
    pub fn held_ticks(&self) -> u64 {
        self.held_ticks
    }

    /// Largest force that was measured, N.
    #[must_use]
    pub fn peak_n(&self) -> f64 {
        self.peak_n
    }

    /// The part of the way (m, in `period_s`) that keeps the force within the limit, where the tool exerts `force` (N, on
    /// the object, zero where it is noise). Above the limit it leads back. A first touch cannot be foreseen: it costs
    /// k_p |way| + k_d |way| / T, T being the period.
    ///
    /// The next force follows from the law of contact with an object that keeps its velocity (an object at rest is the
    /// worst case but for one that comes towards the tool), so the gain on the sensor's noise is 1: the force is as
    /// steady as it is measured, and the tool does not chatter. Forces that it did not foresee make it less, see `measured`.
    #[must_use]
    pub fn allowed(&self, way: Vec2, period_s: f64, force: Vec2) -> Vec2 {
        // a force that is measured is no sign of all that the tool may touch: it may be the sensor's bias
        let way = self.unforeseen(way, period_s);
        let size = force.norm();
        if size <= 0.0 {
            return way;
        }
        let n = force / size;
        let Coupling {
            stiffness_n_per_m: k_p,
            damping_ns_per_m: k_d,
        } = self.coupling;
        // f(k+1) = f(k) + (k_p + k_d/T) n·way − k_d n·v(k) ≤ f_max less the margin
        let at_rest = size - k_d * n.dot(&self.velocity);
        let all = (Self::aim_n(self.max_n) - at_rest) / (k_p + k_d / period_s);
        let along_object = n.dot(&self.mean_velocity) * period_s;
        let most = all - (1.0 - self.gain) * (all - along_object);
        let along = n.dot(&way);
        if along <= most {
            return way;
        }
        way - n * (along - most)
    }

    /// The part of a way (m, in `period_s`) that a touch nobody foresaw costs the limit at most. After ticks that were missed
    /// the way may be several ticks long, so the speed alone is no bound:
    /// (k_p + k_d/T) |way| for the touch and k_p |way| τ/T for the tick τ in which the tool stops.
    fn unforeseen(&self, way: Vec2, period_s: f64) -> Vec2 {
        // the ways of single ticks are bounded by their speed, see `approach_speed`
        if period_s <= TICK_S * (1.0 + 1e-9) {
            return way;
        }
        let Coupling {
            stiffness_n_per_m: k_p,
            damping_ns_per_m: k_d,
        } = self.coupling;
        let most = Self::aim_n(self.max_n) / (k_p + (k_d + k_p * TICK_S) / period_s);
        let length = way.norm();
        if length <= most {
            way
        } else {
            way * (most / length)
        }
    }

    /// Takes the velocity that the tool has gone at in this tick (m/s), and whether the limit shortened its way.
    pub fn moved(&mut self, velocity: Vec2, held: bool) {
        self.velocity = velocity;
        self.mean_velocity += (velocity - self.mean_velocity) * (TICK_S / MEAN_S);
        self.held_ticks += u64::from(held);
    }

    /// Takes the force that is measured there, N.
    ///
    /// A force half-way between the aim and the limit was not foreseen: the contact is stiffer than k_p, or the sensor later
    /// than a tick. The tool would swing about the limit. So from then on it goes half as far in a tick, until the force is
    /// below half of the aim. What counts is how far it goes beyond the way of the object, for which stands the tool's mean
    /// velocity since: an object that gives way is pushed as hard as before.
    pub fn measured(&mut self, force: Vec2) {
        let size = force.norm();
        self.peak_n = self.peak_n.max(size);
        let aim = Self::aim_n(self.max_n);
        if size < 0.5 * aim {
            self.gain = 1.0;
        }
        if size > 0.5 * (self.max_n + aim) && !self.beyond {
            self.beyond = true;
            self.gain = (0.5 * self.gain).max(GAIN_LEAST);
            self.mean_velocity = Vec2::zeros();
        }
        self.beyond &= size > aim;
    }
}
