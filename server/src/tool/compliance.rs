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

/// Stiffness of the spring over k_p: a stiff contact then feels about like the rendered one.
const OVER_DEVICE: f64 = 1.2;
/// Stiffest contact over k_p that [`spring_for`] is meant for, and stiffest spring over k_p.
const STIFFEST: f64 = 10.0;
/// Least damping of such a spring, N s/m.
const DAMPING_LEAST_NS_PER_M: f64 = 20.0;
/// Damping over what just keeps the stiffest contact steady.
const DAMPING_SHARE: f64 = 1.5;

/// The spring for contacts of unknown stiffness, up to ten times that of the master's `device`, whose k_d they have.
///
/// The force comes a tick late. On a contact of k_e and k_d that does not move, D and K of the spring give
/// (D + K T) y(k+1) = D y(k) − T k_e y(k) − k_d (y(k) − y(k−1)), which is steady where 2 D > 2 k_d + (k_e − K) T.
/// With less damping the tool shakes at half of the tick's rate.
#[must_use]
pub fn spring_for(device: Coupling) -> Coupling {
    let Coupling {
        stiffness_n_per_m: k_p,
        damping_ns_per_m: k_d,
    } = device;
    let steady = k_d + 0.5 * (STIFFEST - OVER_DEVICE) * k_p * TICK_S;
    Coupling {
        stiffness_n_per_m: OVER_DEVICE * k_p,
        damping_ns_per_m: (DAMPING_SHARE * steady).max(DAMPING_LEAST_NS_PER_M),
    }
}

/// How far the tool stands back.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Compliance {
    /// As configured.
    spring: Option<Coupling>,
    /// Stiffness in place of the configured one, N/m, where the contact is known.
    suited_n_per_m: Option<f64>,
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
            suited_n_per_m: None,
            back: (Vec2::zeros(), Vec2::zeros()),
        })
    }

    /// From now on the tool gives so that a contact of `contact_n_per_m` feels like the one that the master renders, with
    /// `rendered`; as configured where nobody knows the contact. Not for a tool that touches something: it would jump.
    pub(crate) fn suit(&mut self, contact_n_per_m: Option<f64>, rendered: &Coupling) {
        self.suited_n_per_m = contact_n_per_m.map(|k_e| in_series(k_e, rendered.stiffness_n_per_m));
    }

    /// One tick under the force that was measured last (N, on the object): how far the tool stands back (m), and the
    /// rate of that (m/s) over the `period_s` (s) since the last tick. In a tick that was missed the tool does not give.
    pub(crate) fn step(&mut self, force: Vec2, period_s: f64) -> (Vec2, Vec2) {
        if let Some(spring) = self.spring {
            let k = self.suited_n_per_m.unwrap_or(spring.stiffness_n_per_m);
            let d = spring.damping_ns_per_m;
            let (before, _) = self.back;
            // K y + D dy/dt = f, implicit
            let back = (before * d + force * TICK_S) / (d + k * TICK_S);
            self.back = (back, (back - before) / period_s);
        }
        self.back
    }
}

/// Stiffness of the spring, N/m, that gives k_p together with a contact of k_e: 1/K = 1/k_p − 1/k_e. For a contact that is
/// hardly stiffer, or softer, the stiffest.
fn in_series(k_e: f64, k_p: f64) -> f64 {
    let softness = (1.0 / k_p - 1.0 / k_e).max(1.0 / (STIFFEST * k_p));
    (1.0 / softness).clamp(STIFFNESS_N_PER_M.0, STIFFNESS_N_PER_M.1)
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
        let given: Vec<Vec2> = (0..1000).map(|_| tool.step(force, TICK_S).0).collect();
        assert!((given[999] - force / 1200.0).norm() < 1e-12);
        // 30/1200 s: 1 − 1/e within what a step of 1 ms leaves
        let share = given[24].x / 2e-3;
        assert!((share - 0.632).abs() < 0.01, "{share}");
        let mut stiff = Compliance::try_new(None).unwrap();
        assert_eq!(stiff.step(force, TICK_S), (Vec2::zeros(), Vec2::zeros()));
    }

    #[test]
    fn where_the_contact_is_known_both_together_are_as_stiff_as_what_is_rendered() {
        let device = Coupling::for_stiffness(1000.0);
        let mut tool = Compliance::try_new(Some(spring_for(device))).unwrap();
        let mut given_m = |k_e: Option<f64>| {
            tool.suit(k_e, &device);
            (0..1000)
                .map(|_| tool.step(Vec2::new(3.0, 0.0), TICK_S).0.x)
                .last()
                .unwrap()
        };
        for k_e in [1260.0, 2000.0, 8000.0] {
            let both_m = given_m(Some(k_e)) + 3.0 / k_e;
            assert!((both_m - 3e-3).abs() < 1e-9, "{k_e} N/m: {both_m} m");
        }
        // no spring makes a softer one stiffer
        for k_e in [1000.0, 300.0] {
            assert!((given_m(Some(k_e)) - 0.3e-3).abs() < 1e-9, "{k_e} N/m");
        }
        assert!((given_m(None) - 2.5e-3).abs() < 1e-9, "as configured");
        let mut stiff = Compliance::try_new(None).unwrap();
        stiff.suit(Some(2000.0), &device);
        assert_eq!(stiff.step(Vec2::new(3.0, 0.0), TICK_S).0, Vec2::zeros());
    }

    /// The largest force on a contact that does not move, N, in the last of 1000 ticks after a blow of 1 N.
    fn left_n(spring: Coupling, contact: Coupling) -> f64 {
        let mut tool = Compliance::try_new(Some(spring)).unwrap();
        let mut force = Vec2::new(1.0, 0.0);
        for _ in 0..1000 {
            let (back, rate) = tool.step(force, TICK_S);
            force = -(back * contact.stiffness_n_per_m + rate * contact.damping_ns_per_m);
        }
        force.norm()
    }

    #[test]
    fn the_spring_for_a_device_does_not_shake_on_a_contact_of_ten_times_its_stiffness() {
        for k_p in [300.0, 1000.0, 2000.0, 3000.0] {
            let device = Coupling::for_stiffness(k_p);
            let spring = spring_for(device);
            assert!(Compliance::try_new(Some(spring)).is_ok());
            // as it is, or suited to another contact than the one that it meets
            for suited in [None, Some(1.26), Some(3.0), Some(8.0)] {
                let spring = Coupling {
                    stiffness_n_per_m: suited.map_or(spring.stiffness_n_per_m, |times| {
                        in_series(times * k_p, k_p)
                    }),
                    ..spring
                };
                for times in [1.0, 3.0, 10.0] {
                    let stiffness_n_per_m = times * k_p;
                    let contact = Coupling {
                        stiffness_n_per_m,
                        ..device
                    };
                    let left = left_n(spring, contact);
                    assert!(
                        left < 1e-6,
                        "{k_p} N/m, {suited:?}, {times} times: {left} N"
                    );
                }
            }
        }
        let advised = spring_for(Coupling::for_stiffness(1000.0));
        let Coupling {
            stiffness_n_per_m: k,
            damping_ns_per_m: d,
        } = advised;
        assert!(
            (k - 1200.0).abs() < 1e-9 && (d - 21.6).abs() < 1e-9,
            "{advised:?}"
        );
    }

    #[test]
    fn a_tool_shakes_where_the_law_of_its_damping_is_broken_and_only_there() {
        let device = Coupling::for_stiffness(3000.0);
        let contact = Coupling {
            stiffness_n_per_m: 30_000.0,
            ..device
        };
        // k_d + (k_e − K) T / 2
        let least = device.damping_ns_per_m + 0.5 * (30_000.0 - 3600.0) * TICK_S;
        let with = |damping_ns_per_m| Coupling {
            stiffness_n_per_m: 3600.0,
            damping_ns_per_m,
        };
        assert!(left_n(with(1.05 * least), contact) < 1e-6);
        assert!(left_n(with(0.95 * least), contact) > 1.0);
    }

    #[test]
    fn numbers_that_would_shake_are_refused() {
        for (k, d) in [(10.0, 30.0), (1200.0, 1.0), (f64::NAN, 30.0)] {
            assert!(Compliance::try_new(spring(k, d)).is_err());
        }
    }
}
