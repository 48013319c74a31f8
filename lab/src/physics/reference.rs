//! What should come out: Coulomb friction with damping in closed form, and a fine patch for the rest.
//!
//! Shares nothing with the environment's friction step: the patch has 36 times as many points, friction
//! is not smoothed, and time is stepped explicitly by the midpoint rule. It must never look at a measured
//! motion.

use super::body::Dynamics;

/// Points of the fine patch along one side.
const POINTS_PER_SIDE: usize = 48;
/// Steps of the fine patch from start to end; half as many change no row by more than 1e-4 of itself.
pub(super) const STEPS: usize = 4000;

/// Motions between a pure shift and a pure turn that are tried when a body may be held.
const TURNS: u32 = 900;

/// One degree of freedom under constant drive, damping and Coulomb friction: m v' = f − c sign(v) − b v.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    /// Mass, kg, or inertia, kg m².
    pub(super) m: f64,
    /// Damping, N s/m or N m s.
    pub(super) b: f64,
    /// Net force while moving forwards, N or N m: drive less friction; negative when it brakes.
    pub(super) f: f64,
    /// Initial speed, m/s or rad/s, not negative.
    pub(super) v: f64,
}

impl Line {
    /// Time until it comes to rest, s, when it brakes.
    pub(super) fn rest_s(&self) -> f64 {
        let z = self.b * self.v / -self.f;
        // (m/b) ln(1 + b v/c)
        let slowed = if z < 1e-8 {
            1.0 - z / 2.0
        } else {
            libm::log1p(z) / z
        };
        self.m * self.v / -self.f * slowed
    }

    /// Distance or angle after a time (s) in which it does not come to rest.
    pub(super) fn at(&self, t: f64) -> f64 {
        let z = self.b * t / self.m;
        // x = v (1 − e^−z)/z t + f/m (z − 1 + e^−z)/z² t²
        let (first, second) = if z < 1e-3 {
            (
                1.0 - z / 2.0 + z * z / 6.0,
                0.5 - z / 6.0 + z * z / 24.0 - z * z * z / 120.0,
            )
        } else {
            let decay = libm::expm1(-z);
            (-decay / z, (z + decay) / (z * z))
        };
        self.v * first * t + self.f / self.m * second * t * t
    }
}

/// Where the body is: x, y (m), theta (rad), and its velocity in the world.
pub(super) type State = [f64; 6];

/// The fine patch under a square, stepped through one motion.
pub(super) struct FinePatch<'a> {
    body: &'a Dynamics,
    /// In the body frame, m.
    points: Vec<(f64, f64)>,
    /// Force (N) along the world's x and torque (N m).
    drive: (f64, f64),
}

impl<'a> FinePatch<'a> {
    pub(super) fn new(body: &'a Dynamics, force: f64, torque: f64) -> Self {
        let pitch = body.side / POINTS_PER_SIDE as f64;
        let place = |k: usize| (k as f64 + 0.5) * pitch - body.side / 2.0;
        let all = (0..POINTS_PER_SIDE * POINTS_PER_SIDE)
            .map(|k| (place(k % POINTS_PER_SIDE), place(k / POINTS_PER_SIDE)));
        Self {
            body,
            points: all.collect(),
            drive: (force, torque),
        }
    }

    /// Whether friction holds the resting body: no small motion takes less work than the drive does along it.
    /// The best motion is a shift along the force with a turn, since patch and force are symmetric about x.
    pub(super) fn holds(&self) -> bool {
        let (force, torque) = self.drive;
        let reach = self.body.side / 2.0;
        let share = self.body.c / self.points.len() as f64;
        (0..=TURNS).all(|k| {
            let (sin, cos) =
                libm::sincos(std::f64::consts::FRAC_PI_2 * f64::from(k) / f64::from(TURNS));
            let (v, omega) = (cos * force.signum(), sin * torque.signum() / reach);
            let slip = |(x, y): &(f64, f64)| {
                let (sx, sy) = (v - omega * y, omega * x);
                (sx * sx + sy * sy).sqrt()
            };
            force * v + torque * omega <= share * self.points.iter().map(slip).sum::<f64>()
        })
    }

    /// States from the start on, `seconds` long in so many steps or until rest, each with its time.
    pub(super) fn run(&self, start: State, seconds: f64, steps: usize) -> Vec<(f64, State)> {
        let dt = seconds / steps as f64;
        let driven = self.drive != (0.0, 0.0);
        let mut states = vec![(0.0, start)];
        let (mut state, mut t) = (start, 0.0);
        for _ in 0..steps {
            let slope = self.slope(&state);
            // what is left is braked to rest within the step
            if !driven && self.energy(&state) < self.energy(&moved(&state, &slope, dt)) {
                break;
            }
            let middle = moved(&state, &slope, dt / 2.0);
            state = moved(&state, &self.slope(&middle), dt);
            t += dt;
            states.push((t, state));
        }
        states
    }

    fn energy(&self, [.., vx, vy, omega]: &State) -> f64 {
        0.5 * self.body.m * (vx * vx + vy * vy) + 0.5 * self.body.inertia * omega * omega
    }

    /// The state's rate of change.
    fn slope(&self, state: &State) -> State {
        let [_, _, theta, vx, vy, omega] = *state;
        let body = self.body;
        let (sin, cos) = libm::sincos(theta);
        // seen from the body, whose patch does not turn
        let (bx, by) = (cos * vx + sin * vy, cos * vy - sin * vx);
        let (mut fx, mut fy, mut torque) = (0.0, 0.0, 0.0);
        for (x, y) in &self.points {
            let (sx, sy) = (bx - omega * y, by + omega * x);
            let speed = (sx * sx + sy * sy).sqrt();
            if speed > 0.0 {
                let (dx, dy) = (sx / speed, sy / speed);
                fx -= dx;
                fy -= dy;
                torque -= x * dy - y * dx;
            }
        }
        let share = body.c / self.points.len() as f64;
        let (fx, fy, torque) = (fx * share, fy * share, torque * share);
        let force = (
            cos * fx - sin * fy - body.b * vx + self.drive.0,
            sin * fx + cos * fy - body.b * vy,
        );
        let torque = torque - body.b_r * omega + self.drive.1;
        let (m, inertia) = (body.m, body.inertia);
        [vx, vy, omega, force.0 / m, force.1 / m, torque / inertia]
    }
}

fn moved(state: &State, slope: &State, dt: f64) -> State {
    let mut next = *state;
    for (number, rate) in next.iter_mut().zip(slope) {
        *number += rate * dt;
    }
    next
}
