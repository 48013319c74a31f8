//! A tool that gives like a spring: it stands back from where it is sent by what the measured force pushes it.
//!
//! A real contact that is stiffer than the rendered one is felt as about the rendered one through it. Pure.

use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::range::{OutOfRange, in_range};
use mmt_shared::time::TICK_S;

/// Accepted stiffness, N/m.
const STIFFNESS_N_PER_M: (f64, f64) = (50.0, 30_000.0);
/// Accepted damping, N s/m: a tool that gives at once by a force of a tick ago would shake.
const DAMPING_NS_PER_M: (f64, f64) = (5.0, 300.0);

/// How far the tool stands back.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Compliance {
    spring: Option<Coupling>,
    /// How far, m, world frame, and how fast it grows, m/s.
    back: (Vec2, Vec2),
}

impl Compliance {
    /// Without a spring the tool does not give.
    ///
    /// # Errors
    /// Names the number that is not within its range.
    pub(crate) fn try_new(spring: Option<Coupling>) -> Result<Self, OutOfRange> {
        if let Some(spring) = spring {
            let (k, d) = (spring.stiffness_n_per_m, spring.damping_ns_per_m);
            in_range("tool compliance: stiffness", "N/m", k, STIFFNESS_N_PER_M)?;
            in_range("tool compliance: damping", "N s/m", d, DAMPING_NS_PER_M)?;
        }
        Ok(Self {
            spring,
            back: (Vec2::zeros(), Vec2::zeros()),
        })
    }

    /// One tick under the force that was measured last (N, on the object): how far the tool stands back (m), and the
    /// rate of that (m/s).
    pub(crate) fn step(&mut self, force: Vec2) -> (Vec2, Vec2) {
        if let Some(spring) = self.spring {
            let (k, d) = (spring.stiffness_n_per_m, spring.damping_ns_per_m);
            let (before, _) = self.back;
            // K y + D dy/dt = f, implicit
            let back = (before * d + force * TICK_S) / (d + k * TICK_S);
            self.back = (back, (back - before) / TICK_S);
        }
        self.back
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spring(k: f64, d: f64) -> Option<Coupling> {
        Some(Coupling {
            stiffness_n_per_m: k,
            damping_ns_per_m: d,
        })
    }

    #[test]
    fn it_gives_by_the_force_over_its_stiffness_with_its_time_constant() {
        let mut tool = Compliance::try_new(spring(1200.0, 30.0)).unwrap();
        let force = Vec2::new(2.4, -1.2);
        let given: Vec<Vec2> = (0..1000).map(|_| tool.step(force).0).collect();
        assert!((given[999] - force / 1200.0).norm() < 1e-12);
        // 30/1200 s: 1 − 1/e within what a step of 1 ms leaves
        let share = given[24].x / 2e-3;
        assert!((share - 0.632).abs() < 0.01, "{share}");
        let mut stiff = Compliance::try_new(None).unwrap();
        assert_eq!(stiff.step(force), (Vec2::zeros(), Vec2::zeros()));
    }

    #[test]
    fn numbers_that_would_shake_are_refused() {
        for (k, d) in [(10.0, 30.0), (1200.0, 1.0), (f64::NAN, 30.0)] {
            assert!(Compliance::try_new(spring(k, d)).is_err());
        }
    }
}
