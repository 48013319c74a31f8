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
/// Least damping of a spring for a contact that nobody knows, N s/m, and over what just keeps the stiffest steady. A hand bounces
/// off what it meets the more, the less there is.
const DAMPING_UNKNOWN: (f64, f64) = (20.0, 2.5);
/// Least damping over that configured, where the contact is believed to be known: 1.5 times what just keeps the stiffest steady. The
/// force of a plant may be later than a tick, and there it is all that is configured.
const DAMPING_KNOWN: f64 = 0.6;

/// The spring for contacts of unknown stiffness, up to ten times that of the master's `device`, whose k_d they have.
#[must_use]
pub fn spring_for(device: Coupling) -> Coupling {
    let stiffness_n_per_m = OVER_DEVICE * device.stiffness_n_per_m;
    let (least, share) = DAMPING_UNKNOWN;
    Coupling {
        stiffness_n_per_m,
        damping_ns_per_m: (share * steady_damping(stiffness_n_per_m, device)).max(least),
    }
}

/// The spring that gives, together with a contact of `contact_n_per_m` and the `rendered` k_d, as the rendered contact does: K and D
/// of 1/(K + D s) = 1/(k_p + k_d s) − 1/(k_e + k_d s), to first order in s. For a contact that is hardly stiffer than the rendered
/// one, or softer, the stiffest. D is not below `least` (N s/m).
fn suited_to(contact_n_per_m: f64, rendered: &Coupling, least: f64) -> Coupling {
    let k_p = rendered.stiffness_n_per_m;
    let softness = (1.0 / k_p - 1.0 / contact_n_per_m).max(1.0 / (STIFFEST * k_p));
    let stiffness = (1.0 / softness).clamp(STIFFNESS_N_PER_M.0, STIFFNESS_N_PER_M.1);
    // k_p over the stiffness of the contact
    let over = 1.0 - k_p / stiffness;
    let damping = rendered.damping_ns_per_m * (1.0 + over) / (1.0 - over);
    let (lowest, highest) = DAMPING_NS_PER_M;
    Coupling {
        stiffness_n_per_m: stiffness,
        damping_ns_per_m: damping.max(least).clamp(lowest, highest),
    }
}

/// The damping D, N s/m, with which a spring of K (N/m) just does not shake on the stiffest contact, of k_e = 10 k_p and the `device`'s k_d,
/// that does not move.
///
/// The force comes a tick late and is taken by the trapezoidal rule, so that with a = T k_e/2 and b = k_d/2
/// (D + K T) y(k+1) = D y(k) − a (y(k) + y(k−1)) − b (y(k) − y(k−2)). All three roots are within the unit circle (Jury 1964) where
/// A = D + K T is above the larger root of A² − (a − b) A − b (a + K T) − 2 b² = 0.
fn steady_damping(spring_n_per_m: f64, device: Coupling) -> f64 {
    let given = spring_n_per_m * TICK_S;
    let a = 0.5 * STIFFEST * device.stiffness_n_per_m * TICK_S;
    let b = 0.5 * device.damping_ns_per_m;
    let root = ((a - b) * (a - b) + 4.0 * b * (a + given + 2.0 * b)).sqrt();
    0.5 * (a - b + root) - given
}

/// How far the tool stands back.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Compliance {
    /// As configured.
    spring: Option<Coupling>,
    /// Whether the tool is that of a plant, whose force may be later than a tick.
    of_plant: bool,
    /// In place of the configured one, where the contact is known.
    suited: Option<Coupling>,
    /// How far, m, world frame, and how fast it grows, m/s.
    back: (Vec2, Vec2),
    /// The force of the tick before, N.
    force: Vec2,
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
            of_plant: false,
            suited: None,
            back: (Vec2::zeros(), Vec2::zeros()),
            force: Vec2::zeros(),
        })
    }

    /// The same of the tool of a plant.
    pub(crate) fn of_plant(self) -> Self {
        Self {
            of_plant: true,
            ..self
        }
    }

    /// From now on the tool gives so that a contact of `contact_n_per_m` feels like the one that the master renders, with
    /// `rendered`; as configured where nobody knows the contact. Not for a tool that touches something: it would jump.
    pub(crate) fn suit(&mut self, contact_n_per_m: Option<f64>, rendered: &Coupling) {
        let share = if self.of_plant { 1.0 } else { DAMPING_KNOWN };
        self.suited = self
            .spring
            .zip(contact_n_per_m)
            .map(|(spring, k_e)| suited_to(k_e, rendered, share * spring.damping_ns_per_m));
    }

    /// One tick under the force that was measured last (N, on the object): how far the tool stands back (m), and the
    /// rate of that (m/s) over the `period_s` (s) since the last tick. In a tick that was missed the tool does not give.
    pub(crate) fn step(&mut self, force: Vec2, period_s: f64) -> (Vec2, Vec2) {
        if let Some(spring) = self.spring {
            let Coupling {
                stiffness_n_per_m: k,
                damping_ns_per_m: d,
            } = self.suited.unwrap_or(spring);
            let (before, _) = self.back;
            // K y + D dy/dt = f, implicit in y, with the mean of f over the tick; that would be later still with a plant
            let before_this = std::mem::replace(&mut self.force, force);
            let earlier = if self.of_plant { force } else { before_this };
            let mean = 0.5 * (earlier + force);
            let back = (before * d + mean * TICK_S) / (d + k * TICK_S);
            self.back = (back, (back - before) / period_s);
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
        let given: Vec<Vec2> = (0..1000).map(|_| tool.step(force, TICK_S).0).collect();
        assert!((given[999] - force / 1200.0).norm() < 1e-12);
        // 30/1200 s, half a tick later: 1 − exp(−24.5/25) within what a step of 1 ms leaves
        let share = given[24].x / 2e-3;
        assert!((share - 0.625).abs() < 0.01, "{share}");
        let mut stiff = Compliance::try_new(None).unwrap();
        assert_eq!(stiff.step(force, TICK_S), (Vec2::zeros(), Vec2::zeros()));
    }

    #[test]
    fn where_the_contact_is_known_both_together_give_as_what_is_rendered_does() {
        let device = Coupling::for_stiffness(1000.0);
        let suited = |k_e| suited_to(k_e, &device, 0.0);
        for k_e in [1260.0, 2000.0, 8000.0] {
            // (K + D s) in series with (k_e + k_d s) is k_p + k_d s, for a slow s
            let s = 0.1;
            let contact = Coupling {
                stiffness_n_per_m: k_e,
                ..device
            };
            let force = |of: Coupling| of.stiffness_n_per_m + of.damping_ns_per_m * s;
            let both = 1.0 / (1.0 / force(suited(k_e)) + 1.0 / force(contact));
            assert!((both - force(device)).abs() < 1e-3, "{k_e} N/m: {both}");
        }
        // no spring makes a softer one stiffer
        for k_e in [1000.0, 300.0] {
            assert!((suited(k_e).stiffness_n_per_m - 10_000.0).abs() < 1e-9);
        }
        let mut tool = Compliance::try_new(Some(spring_for(device))).unwrap();
        let mut given_m = |k_e: Option<f64>| {
            tool.suit(k_e, &device);
            (0..1000)
                .map(|_| tool.step(Vec2::new(3.0, 0.0), TICK_S).0.x)
                .last()
                .unwrap()
        };
        assert!((given_m(Some(2000.0)) - 1.5e-3).abs() < 1e-9);
        assert!((given_m(None) - 2.5e-3).abs() < 1e-9, "as configured");
        let mut stiff = Compliance::try_new(None).unwrap();
        stiff.suit(Some(2000.0), &device);
        assert_eq!(stiff.step(Vec2::new(3.0, 0.0), TICK_S).0, Vec2::zeros());
    }

    #[test]
    fn a_contact_that_is_known_to_be_stiff_takes_the_damping_that_is_rendered_but_not_less_than_keeps_it_steady()
     {
        let device = Coupling::for_stiffness(1000.0);
        let suited = |mut tool: Compliance, k_e| {
            tool.suit(Some(k_e), &device);
            tool.suited.unwrap().damping_ns_per_m
        };
        let tool = |configured| Compliance::try_new(spring(1200.0, configured)).unwrap();
        let damping = |k_e, configured| suited(tool(configured), k_e);
        let advised = spring_for(device).damping_ns_per_m;
        // k_d (k_e + k_p)/(k_e − k_p)
        assert!((damping(5000.0, advised) - 15.0).abs() < 1e-9);
        assert!((damping(2000.0, advised) - 30.0).abs() < 1e-9);
        assert!((damping(100_000.0, advised) - 0.6 * advised).abs() < 1e-9);
        assert!((damping(100_000.0, 50.0) - 30.0).abs() < 1e-9);
        assert!((suited(tool(50.0).of_plant(), 100_000.0) - 50.0).abs() < 1e-9);
    }

    /// The largest force on a contact that does not move, N, in the last of 1000 ticks after a blow of 1 N.
    fn left_n(spring: Coupling, contact: Coupling) -> f64 {
        let mut tool = Compliance::try_new(Some(spring)).unwrap();
        let mut force = Vec2::new(1.0, 0.0);
        let mut left = 0.0;
        for tick in 0..1000 {
            let (back, rate) = tool.step(force, TICK_S);
            force = -(back * contact.stiffness_n_per_m + rate * contact.damping_ns_per_m);
            left = if tick < 900 {
                0.0
            } else {
                force.norm().max(left)
            };
        }
        left
    }

    #[test]
    fn the_spring_for_a_device_does_not_shake_on_a_contact_of_ten_times_its_stiffness() {
        for k_p in [300.0, 1000.0, 2000.0, 3000.0] {
            let device = Coupling::for_stiffness(k_p);
            let advised = spring_for(device);
            assert!(Compliance::try_new(Some(advised)).is_ok());
            let least = DAMPING_KNOWN * advised.damping_ns_per_m;
            // as it is, or suited to another contact than the one that it meets
            let suited =
                [1.26, 3.0, 8.0, 100.0].map(|times| suited_to(times * k_p, &device, least));
            for spring in suited.into_iter().chain([advised]) {
                for times in [1.0, 3.0, 10.0] {
                    let stiffness_n_per_m = times * k_p;
                    let contact = Coupling {
                        stiffness_n_per_m,
                        ..device
                    };
                    let left = left_n(spring, contact);
                    assert!(left < 1e-6, "{spring:?}, {times} times {k_p} N/m: {left} N");
                }
            }
        }
        let advised = spring_for(Coupling::for_stiffness(1000.0));
        let Coupling {
            stiffness_n_per_m: k,
            damping_ns_per_m: d,
        } = advised;
        assert!(
            (k - 1200.0).abs() < 1e-9 && (d - 20.0).abs() < 1e-9,
            "{advised:?}"
        );
    }

    #[test]
    fn a_tool_shakes_where_the_law_of_its_damping_is_broken_and_only_there() {
        for k_p in [1000.0, 2000.0, 3000.0] {
            let device = Coupling::for_stiffness(k_p);
            let contact = Coupling {
                stiffness_n_per_m: STIFFEST * k_p,
                ..device
            };
            for k in [1.11 * k_p, 2.0 * k_p] {
                let with = |damping_ns_per_m| Coupling {
                    stiffness_n_per_m: k,
                    damping_ns_per_m,
                };
                let least = steady_damping(k, device);
                assert!(left_n(with(1.05 * least), contact) < 1e-2, "{k} of {k_p}");
                assert!(left_n(with(0.95 * least), contact) > 1.0, "{k} of {k_p}");
            }
        }
    }

    #[test]
    fn the_force_of_a_plant_is_late_enough_as_it_is() {
        let tool = Compliance::try_new(spring(1200.0, 30.0)).unwrap();
        let given_m = |mut tool: Compliance| tool.step(Vec2::new(3.0, 0.0), TICK_S).0.x;
        assert!((given_m(tool.of_plant()) - 2.0 * given_m(tool)).abs() < 1e-12);
    }

    #[test]
    fn numbers_that_would_shake_are_refused() {
        for (k, d) in [(10.0, 30.0), (1200.0, 1.0), (f64::NAN, 30.0)] {
            assert!(Compliance::try_new(spring(k, d)).is_err());
        }
    }
}
