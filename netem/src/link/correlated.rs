//! Correlated numbers with an exact distribution: a Gaussian first-order process behind uniform draws.
//!
//! By packet it takes one draw of the packet. In time it is a function of time alone, whatever the
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

/// A stationary process with correlation exp(-t / tau), on a grid of tau / 2 and smooth between.
#[derive(Clone, Debug)]
pub(super) struct InTime {
    start: Substream,
    stream: Substream,
    /// Nanoseconds; zero before its first use.
    tau: u64,
    /// The grid cell with its two ends.
    cell: u64,
    low: f64,
    high: f64,
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
        }
    }

    /// The uniform number at `elapsed`. A time before that of an earlier call is taken for the beginning
    /// of the cell of that call.
    pub(super) fn uniform(&mut self, tau: Duration, elapsed: Duration) -> f64 {
        let tau = duration_nanos(tau).max(2);
        if self.tau != tau {
            self.begin(tau);
        }
        let (step, elapsed) = (tau / 2, duration_nanos(elapsed));
        let rho = libm::exp(-0.5);
        self.advance_to(elapsed / step, rho);
        let share = if elapsed / step == self.cell {
            (elapsed % step) as f64 / step as f64
        } else {
            0.0
        };
        // the straight line between two correlated numbers, brought back to variance one
        let (a, b) = (1.0 - share, share);
        let spread = (a * a + b * b + 2.0 * a * b * rho).sqrt();
        standard_normal_share((a * self.low + b * self.high) / spread)
    }

    fn begin(&mut self, tau: u64) {
        self.stream = self.start.clone();
        self.tau = tau;
        self.cell = 0;
        self.low = standard_normal(self.stream.uniform());
        self.high = self.after(self.low, libm::exp(-0.5));
    }

    fn after(&mut self, z: f64, rho: f64) -> f64 {
        rho * z + (1.0 - rho * rho).sqrt() * standard_normal(self.stream.uniform())
    }

    fn advance_to(&mut self, cell: u64, rho: f64) {
        if cell.saturating_sub(self.cell) > CATCH_UP_STEPS {
            self.cell = cell;
            self.low = standard_normal(self.stream.uniform());
            self.high = self.after(self.low, rho);
        }
        while self.cell < cell {
            self.cell += 1;
            self.low = self.high;
            self.high = self.after(self.low, rho);
        }
    }
}
