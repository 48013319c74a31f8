//! How the ground holds a square that slides and turns at once, as the slave reckons it.
//!
//! Mass, damping and friction c are spread evenly over a square of side l, so that I is (8) and damping
//! resists turning by `b l²/6`. Friction is summed over the nine places of Gauss and Legendre. It must
//! never be asked in paper mode, which decouples sliding and turning by (5) and (11).

use mmt_shared::model::params::ModelParams;
use mmt_shared::time::TICK_S;

/// Turning rate below which the resistance is taken to be proportional to it, rad/s.
const OMEGA_MIN: f64 = 1e-6;
/// Outer place of the rule on a line of length 1: `√(3/20)`, and the weights there and in the middle.
const OUTER: f64 = 0.387_298_334_620_741_7;
const WEIGHT_OUTER: f64 = 5.0 / 18.0;
const WEIGHT_MIDDLE: f64 = 8.0 / 18.0;
/// Places across the direction of sliding, and their weights.
const ACROSS: [(f64, f64); 3] = [
    (-OUTER, WEIGHT_OUTER),
    (0.0, WEIGHT_MIDDLE),
    (OUTER, WEIGHT_OUTER),
];
/// Places along it: those before and behind the centre slide equally fast.
const ALONG: [(f64, f64); 2] = [(0.0, WEIGHT_MIDDLE), (OUTER, 2.0 * WEIGHT_OUTER)];

/// What friction takes from a square of side l (m), per newton of c: the force against the `speed` of its
/// centre (m/s), at most 1, and the torque against omega (rad/s), m.
///
/// The centre is taken to slide along the normal of a face, whichever: a smooth tool pushes no other way.
#[must_use]
pub fn friction(speed: f64, omega: f64, side: f64) -> (f64, f64) {
    let spin = omega * side;
    let (mut force, mut torque) = (0.0, 0.0);
    for (across, weight_across) in ACROSS {
        let forwards = speed - spin * across;
        for (along, weight_along) in ALONG {
            let sideways = spin * along;
            let size = (forwards * forwards + sideways * sideways).sqrt();
            if size > 0.0 {
                let share = weight_across * weight_along / size;
                force += share * forwards;
                torque += share * side * (along * sideways - across * forwards);
            }
        }
    }
    (force, torque)
}

/// The ground's resistance to turning per rad/s of omega while the centre slides at `speed` (m/s): of
/// friction and of the damping `b l²/6`, N m s. Never negative.
#[must_use]
pub fn drag(params: &ModelParams, side: f64, speed: f64, omega: f64) -> f64 {
    let omega = omega.abs().max(OMEGA_MIN);
    let (_, torque) = friction(speed, omega, side);
    params.c() * torque / omega + params.b() * side * side / 6.0
}

/// omega (rad/s) one period T later under a `moment` (N m) and a `drag` (N m s): implicit, so that the drag
/// alone never turns the object back.
#[must_use]
pub fn turned(inertia: f64, drag: f64, omega: f64, moment: f64) -> f64 {
    (inertia * omega + TICK_S * moment) / (inertia + TICK_S * drag)
}

/// The radius e/c (m) with which the limit surface of the local model has this `drag` (N m s) at this
/// `speed` (m/s) and omega (rad/s). c (N) must be positive.
///
/// The ellipsoid of c and (9) fits a square at rest and in pure spin, but where the square slides as well it
/// resists turning too much (by 3/4 for a slow turn), and it knows no rotational damping. From
/// `e² omega/(c sqrt(speed² + (e/c)² omega²)) = drag omega` follows a quadratic equation in (e/c)².
#[must_use]
pub fn friction_radius(c: f64, drag: f64, speed: f64, omega: f64) -> f64 {
    let per_rate = drag / c;
    let half = 0.5 * (per_rate * omega) * (per_rate * omega);
    let slid = per_rate * speed;
    (half + (half * half + slid * slid).sqrt()).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use mmt_shared::fixtures::COUPLING;
    use mmt_shared::model::dynamics::Motion;
    use mmt_shared::model::geometry::{Twist, Vec2};
    use mmt_shared::model::params::friction_torque_of_square;
    use mmt_shared::model::settings::FrictionLaw;

    const SIDE: f64 = 0.36;
    /// Force and torque of friction by a grid of 60 × 60 places.
    fn by_grid(speed: f64, omega: f64) -> (f64, f64) {
        let place = |k: u32| ((f64::from(k) + 0.5) / 60.0 - 0.5) * SIDE;
        let (mut force, mut torque) = (0.0, 0.0);
        for (x, y) in (0..3600).map(|k| (place(k % 60), place(k / 60))) {
            let (vx, vy) = (speed - omega * y, omega * x);
            let size = libm::hypot(vx, vy) * 3600.0;
            force += vx / size;
            torque += (x * vy - y * vx) / size;
        }
        (force, torque)
    }

    #[test]
    fn nine_places_do_for_a_pushed_square() {
        for omega in [0.01, 0.1, 0.2, 0.4] {
            let (force, torque) = friction(0.15, omega, SIDE);
            let (grid_force, grid_torque) = by_grid(0.15, omega);
            assert!((force / grid_force - 1.0).abs() < 1e-2, "{omega}");
            assert!(
                (torque / grid_torque - 1.0).abs() < 1e-2,
                "{omega} {torque}"
            );
            let (backwards, same) = friction(-0.15, omega, SIDE);
            assert!((backwards + force).abs() < 1e-12 && (same - torque).abs() < 1e-12);
        }
        let (force, torque) = friction(0.15, 0.0, SIDE);
        assert!((force - 1.0).abs() < 1e-12 && torque.abs() < 1e-12);
        assert_eq!(friction(0.0, 0.0, SIDE), (0.0, 0.0));
    }

    #[test]
    fn the_local_model_turns_as_the_square_with_this_radius_and_not_with_9() {
        let square = ModelParams::of_square(0.7, 3.0, 2.06, SIDE, &COUPLING).unwrap();
        let (speed, omega) = (0.15, 0.3);
        let drag = drag(&square, SIDE, speed, omega);
        // what one step of the limit surface takes from omega, as a torque
        let resisted = |e: f64| {
            let [m, b, c, inertia, _] = square.to_array();
            let params = ModelParams::try_new(m, b, c, inertia, e, &COUPLING).unwrap();
            let motion = Motion {
                twist: Twist::new(speed, 0.0, omega),
                ..Motion::default()
            };
            // pushed at constant speed
            let push = Vec2::new(b * speed + c, 0.0);
            let next = motion.step(FrictionLaw::LimitSurface, &params, push, Vec2::zeros());
            inertia * (omega - next.twist.angular) / TICK_S
        };
        let fitted = resisted(square.c() * friction_radius(square.c(), drag, speed, omega));
        let by_9 = resisted(friction_torque_of_square(square.c(), SIDE));
        assert!(
            (fitted / (drag * omega) - 1.0).abs() < 0.03,
            "{fitted} {}",
            drag * omega
        );
        assert!(by_9 > 1.1 * fitted, "{by_9}");
    }

    #[test]
    fn a_moment_turns_a_square_until_the_ground_resists_as_much() {
        let params = ModelParams::of_square(0.7, 3.0, 2.06, SIDE, &COUPLING).unwrap();
        let (mut omega, moment) = (0.0, 0.08);
        for _ in 0..2000 {
            omega = turned(
                params.inertia(),
                drag(&params, SIDE, 0.15, omega),
                omega,
                moment,
            );
        }
        assert!((drag(&params, SIDE, 0.15, omega) * omega / moment - 1.0).abs() < 1e-9);
        for _ in 0..2000 {
            omega = turned(
                params.inertia(),
                drag(&params, SIDE, 0.15, omega),
                omega,
                0.0,
            );
            assert!(omega >= 0.0);
        }
    }
}
