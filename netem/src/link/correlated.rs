//! Correlated numbers with an exact distribution: a Gaussian first-order process behind uniform draws.
//!
//! By packet it takes one draw of every packet offered. In time it is a function of time alone, whatever the
//! packets: it has a stream of its own.

use std::time::Duration;

use mmt_shared::rng::Substream;
use mmt_shared::time::duration_nanos;

use crate::config::Chance;
use crate::quantile::standard_normal;

/// The most steps that one packet makes a process in time take, about 20 ms of work. After a longer
/// silence the process begins anew, at a random point of its stationary distribution.
pub(super) const CATCH_UP_STEPS: u64 = 1 << 20;

/// The share of a standard normal below `z`.
fn standard_normal_share(z: f64) -> f64 {
    0.5 * libm::erfc(-z / std::f64::consts::SQRT_2)
}

/// A first-order process with one step for each packet.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ByPacket {
    last: Option<f64>,
}

impl ByPacket {
    /// A uniform number whose Gaussian has correlation `rho` with the one before; `draw` is fresh.
    pub(super) fn uniform(&mut self, rho: f64, draw: f64) -> f64 {
        if rho == 0.0 {
            return draw;
        }
        let fresh = standard_normal(draw);
        let z = match self.last {
            None => fresh,
            Some(last) => rho * last + (1.0 - rho * rho).max(0.0).sqrt() * fresh,
        };
        self.last = Some(z);
        standard_normal_share(z)
    }

    /// Whether an event of this chance befalls the packet.
    pub(super) fn happens(&mut self, chance: Chance, draw: f64) -> bool {
        self.uniform(chance.correlation.get(), draw) < chance.probability.get()
    }
}

/// The time below which packets are as good as simultaneous, nanoseconds: where halving a cell ends.
const FINEST: u64 = 1000;
/// Halvings of the largest cell, half an hour, to the finest.
const HALVINGS_MAX: usize = 32;

/// The Ornstein–Uhlenbeck process with variance one and correlation exp(-t / tau), at any point in time.
///
/// Cells of tau / 2 follow each other; within a cell the path is refined by halves, each middle drawn from its
/// distribution given both ends, and at last the point itself (M. Lévy's construction). Each draw is a function
/// of the cell and of the place in it, so that the path does not depend on who asks for which points.
#[derive(Clone, Debug)]
pub(super) struct InTime {
    start: Substream,
    stream: Substream,
    /// Nanoseconds; zero before its first use.
    tau: u64,
    /// The cell with its two ends, and the key of its draws.
    cell: u64,
    low: f64,
    high: f64,
    key: u64,
    halvings: [Halving; HALVINGS_MAX],
    depth: usize,
}

/// One halving of a cell: how a middle follows from its two neighbours, and the middle that was drawn last.
#[derive(Clone, Copy, Debug, Default)]
struct Halving {
    weight: f64,
    deviation: f64,
    /// Its place in the tree of halves, 0: none.
    place: u64,
    middle: f64,
}

impl InTime {
    pub(super) fn new(start: Substream) -> Self {
        Self {
            stream: start.clone(),
            start,
            tau: 0,
            cell: 0,
            low: 0.0,
            high: 0.0,
            key: 0,
            halvings: [Halving::default(); HALVINGS_MAX],
            depth: 0,
        }
    }

    /// The uniform number at `elapsed`, see [`Self::normal`].
    pub(super) fn uniform(&mut self, tau: Duration, elapsed: Duration) -> f64 {
        standard_normal_share(self.normal(tau, elapsed))
    }

    /// The process at `elapsed`. A time before the cell of an earlier call is taken for the beginning of that
    /// cell.
    fn normal(&mut self, tau: Duration, elapsed: Duration) -> f64 {
        let (tau, elapsed) = (duration_nanos(tau).max(2), duration_nanos(elapsed));
        if self.tau != tau {
            self.begin(tau);
        }
        let step = tau / 2;
        self.advance_to(elapsed / step);
        let within = if elapsed / step == self.cell {
            elapsed % step
        } else {
            0
        };
        self.refined(within, step as f64)
    }

    /// The process `within` nanoseconds after the beginning of the cell, which is `step` long.
    fn refined(&mut self, within: u64, step: f64) -> f64 {
        let (mut before, mut after) = (self.low, self.high);
        let (mut begin, mut length, mut place) = (0.0, step, 1);
        for halving in self.halvings.iter_mut().take(self.depth) {
            if halving.place != place {
                let fresh = normal_at(self.key, place);
                halving.middle = halving.weight * (before + after) + halving.deviation * fresh;
                halving.place = place;
            }
            length *= 0.5;
            place *= 2;
            if (within as f64) < begin + length {
                after = halving.middle;
            } else {
                before = halving.middle;
                begin += length;
                place += 1;
            }
        }
        let (left, tau) = (within as f64 - begin, self.tau as f64);
        let fresh = normal_at(self.key, within | 1 << 63);
        between(before, after, left / tau, (length - left) / tau, fresh)
    }

    fn begin(&mut self, tau: u64) {
        self.stream = self.start.clone();
        self.tau = tau;
        let mut length = tau / 2;
        let mut half = 0.5 * (tau / 2) as f64 / tau as f64;
        self.depth = 0;
        for halving in &mut self.halvings {
            if length < FINEST {
                break;
            }
            let (rho, rest) = (libm::exp(-half), -libm::expm1(-2.0 * half));
            halving.weight = rho / (1.0 + rho * rho);
            halving.deviation = (rest / (1.0 + rho * rho)).sqrt();
            self.depth += 1;
            (length, half) = (length / 2, 0.5 * half);
        }
        self.enter(0, None);
    }

    /// Goes into a cell whose beginning is known if it follows the one before.
    fn enter(&mut self, cell: u64, low: Option<f64>) {
        // tau is a whole number of nanoseconds and may be odd: the cell is half of it, rounded
        let step = (self.tau / 2) as f64 / self.tau as f64;
        let rho = libm::exp(-step);
        self.cell = cell;
        self.low = low.unwrap_or_else(|| standard_normal(self.stream.uniform()));
        let fresh = standard_normal(self.stream.uniform());
        self.high = rho * self.low + (1.0 - rho * rho).sqrt() * fresh;
        self.key = self.stream.bits();
        self.halvings
            .iter_mut()
            .for_each(|halving| halving.place = 0);
    }

    fn advance_to(&mut self, cell: u64) {
        if cell.saturating_sub(self.cell) > CATCH_UP_STEPS {
            self.enter(cell, None);
        }
        while self.cell < cell {
            self.enter(self.cell + 1, Some(self.high));
        }
    }
}

/// The process between two points that lie `left` and `right` tau away, `fresh` a standard normal number.
fn between(before: f64, after: f64, left: f64, right: f64, fresh: f64) -> f64 {
    let (rho_left, rho_right) = (libm::exp(-left), libm::exp(-right));
    let rest = |times: f64| -libm::expm1(-2.0 * times);
    let (rest_left, rest_right, rest_both) = (rest(left), rest(right), rest(left + right));
    let mean = (before * rho_left * rest_right + after * rho_right * rest_left) / rest_both;
    mean + (rest_left * rest_right / rest_both).max(0.0).sqrt() * fresh
}

/// The standard normal number of a place (SplitMix64's mixing: G. Steele et al., OOPSLA 2014).
fn normal_at(key: u64, place: u64) -> f64 {
    let mut bits = key.wrapping_add(place.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    bits = (bits ^ bits >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ bits >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^= bits >> 31;
    standard_normal(((bits >> 11) as f64 + 0.5) * (0.5 * f64::EPSILON))
}

#[cfg(test)]
mod tests {
    use super::*;

    const TAU: Duration = Duration::from_millis(50);

    /// Pairs of the process at `lag` after points far apart: their moments.
    fn pairs(lag: f64) -> (f64, f64, f64) {
        const N: u32 = 60_000;
        let mut process = InTime::new(Substream::new(5, "netem/up/jitter", 0));
        let (mut xx, mut yy, mut xy) = (0.0, 0.0, 0.0);
        for pair in 0..N {
            // 10.37 tau apart, so that the points lie anywhere in their cells
            let at = TAU.mul_f64(10.37 * f64::from(pair));
            let x = process.normal(TAU, at);
            let y = process.normal(TAU, at + TAU.mul_f64(lag));
            (xx, yy, xy) = (xx + x * x, yy + y * y, xy + x * y);
        }
        let n = f64::from(N);
        (xx / n, yy / n, xy / n)
    }

    #[test]
    fn the_correlation_is_exponential_at_every_lag() {
        for lag in [0.0001, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0] {
            let (xx, yy, xy) = pairs(lag);
            let expected = libm::exp(-lag);
            assert!(
                (xx - 1.0).abs() < 0.02 && (yy - 1.0).abs() < 0.02,
                "{lag}: {xx} {yy}"
            );
            assert!(
                (xy - expected).abs() < 0.02,
                "lag {lag} tau: {xy}, not {expected}"
            );
            // near a correlation of one the step is the finer measure: known to 4 / sqrt(2 n)
            let step = (xx + yy - 2.0 * xy) / (2.0 - 2.0 * expected);
            assert!((step - 1.0).abs() < 0.025, "lag {lag} tau: step {step}");
        }
    }

    #[test]
    fn the_path_does_not_depend_on_who_asks() {
        let new = || InTime::new(Substream::new(6, "netem/up/jitter", 0));
        let (mut dense, mut sparse) = (new(), new());
        for us in (0..2_000_000).step_by(97) {
            let at = Duration::from_micros(us);
            let value = dense.normal(TAU, at);
            if us % 7 == 0 {
                assert_eq!(sparse.normal(TAU, at), value, "{us} us");
            }
        }
    }
}
