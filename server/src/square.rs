//! How the ground holds a square that slides and turns at once, as the slave reckons it.
//!
//! Mass, friction and damping that are spread evenly over a square of side l act like four quarters at
//! `±l/√12`: these have the inertia I of (8) and the rotational damping `b l²/6` exactly, and the square's
//! friction to 0.2 % of what a tool on a face feels. Paper mode decouples sliding and turning, (5) and
//! (11), and must never come here.

use mmt_shared::params::ModelParams;
use mmt_shared::time::TICK_S;

/// Distance of the quarters from the square's axes in sides l: `1/√12`, the radius of gyration.
const QUARTER: f64 = 0.288_675_134_594_812_9;

/// What friction takes from a square of side l (m), per newton of c: the force against the `speed` of its
/// centre (m/s), at most 1, and the torque against omega (rad/s), m.
///
/// The centre is taken to slide along the normal of a face, whichever: a smooth tool pushes no other way.
#[must_use]
pub fn friction(speed: f64, omega: f64, side: f64) -> (f64, f64) {
    let reach = side * QUARTER;
    let spin = omega * reach;
    let (mut force, mut torque) = (0.0, 0.0);
    // the two quarters on either side of the normal slide equally fast
    for left in [1.0, -1.0] {
        let along = speed - left * spin;
        let size = (along * along + spin * spin).sqrt();
        if size > 0.0 {
            force += 0.5 * along / size;
            torque += 0.5 * reach * (spin - left * along) / size;
        }
    }
    (force, torque)
}

/// The ground's resistance to turning per rad/s of omega while the centre slides at `speed` (m/s): of
/// friction and of the damping `b l²/6`, N m s. Never negative.
#[must_use]
pub fn drag(params: &ModelParams, side: f64, speed: f64, omega: f64) -> f64 {
    // the same for either way of turning, and finite where it does not turn
    let omega = omega.abs().max(1e-6);
    let (_, torque) = friction(speed, omega, side);
    params.c() * torque / omega + params.b() * side * side / 6.0
}

/// omega (rad/s) one period T later under the `moment` (N m) of a push: implicit, so that drag never turns
/// the square back.
#[must_use]
pub fn turned(params: &ModelParams, side: f64, speed: f64, omega: f64, moment: f64) -> f64 {
    let inertia = params.inertia();
    let drag = drag(params, side, speed, omega);
    (inertia * omega + TICK_S * moment) / (inertia + TICK_S * drag)
}

/// The e (N m) with which the local model's limit surface resists turning as much as the square does.
///
/// The ellipsoid of c and (9) fits a square at rest and in pure spin, but it resists up to a quarter too
/// much where the square slides as well, and knows no rotational damping. From
/// `e² omega/(c sqrt(speed² + (e/c)² omega²)) = drag omega` follows a quadratic equation in (e/c)².
#[must_use]
pub fn friction_torque(params: &ModelParams, side: f64, speed: f64, omega: f64) -> f64 {
    if params.c() <= 0.0 {
        return params.e();
    }
    let per_rate = drag(params, side, speed, omega) / params.c();
    let half = 0.5 * per_rate * per_rate * omega * omega;
    let slid = per_rate * speed;
    params.c() * (half + (half * half + slid * slid).sqrt()).sqrt()
}
