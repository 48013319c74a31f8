//! The motions themselves: what is done to the body, what it does, and what it should do.
//!
//! It must never let the measured and the reference motion start differently.

use mmt_server::environment::Environment;
use mmt_shared::model::geometry::{Twist, Vec2};
use mmt_shared::model::params::{SPEED_M_PER_S, TURN_RATE_RAD_PER_S};
use mmt_shared::time::TICK_S;

use super::body::{Dynamics, PhysicsError};
use super::reference::{FinePatch, Line, STEPS, State};

/// Force of the push, force (N) and torque (N m) of the wrench.
const PUSH_N: f64 = 4.0;
const WRENCH_N_NM: (f64, f64) = (3.0, -0.18);
/// How long push and wrench last, s.
const DURATIONS: (f64, f64) = (0.5, 0.4);
/// How fast pushes may make a body: nine tenths of what the environment accepts.
const SPEED_SHARE: f64 = 0.9;
/// Most points of a trace.
const TRACE_POINTS: usize = 400;
/// A coast that lasts longer than this did not end, s.
const COAST_MAX_S: f64 = 60.0;

/// Where the body is: displacement (m), or its part along the motion, and angle (rad).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Displacement {
    shift: f64,
    angle: f64,
}

/// One quantity of a motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Kind {
    pub(super) case: &'static str,
    /// The angle, not the displacement.
    pub(super) turns: bool,
    /// The time until rest is the result.
    pub(super) timed: bool,
}

const fn kind(case: &'static str, turns: bool, timed: bool) -> Kind {
    Kind { case, turns, timed }
}

/// What is done to the body.
#[derive(Clone, Copy, Debug)]
enum What {
    /// A force (N) at an angle (degrees) in the world for a time (s).
    Push(f64, f64, f64),
    /// Coasting to rest from a speed (m/s) and a turning rate (rad/s).
    Coast(f64, f64),
    /// A force (N) along x with a torque (N m) for a time (s).
    Wrench(f64, f64, f64),
    /// A force (N) along x that friction holds, for a time (s).
    Hold(f64, f64),
}

/// One motion of one body.
#[derive(Clone, Copy, Debug)]
pub(super) struct ReferenceMotion {
    body: Dynamics,
    what: What,
    kinds: &'static [Kind],
}

impl ReferenceMotion {
    /// The motions in the order of the table.
    pub(super) fn all(body: &Dynamics) -> Vec<Self> {
        const PUSH: &[Kind] = &[kind("push", false, false)];
        const PUSH_45: &[Kind] = &[kind("push-45", false, false)];
        const STOP: &[Kind] = &[kind("stop", false, false)];
        const SPIN: &[Kind] = &[kind("spin-down", true, true)];
        const COAST: &[Kind] = &[
            kind("coast-x", false, false),
            kind("coast-theta", true, false),
        ];
        const WRENCH: &[Kind] = &[
            kind("wrench-x", false, false),
            kind("wrench-theta", true, false),
        ];
        const HOLD_HALF: &[Kind] = &[kind("hold-0.5c", false, false)];
        const HOLD_NEAR: &[Kind] = &[kind("hold-0.9c", false, false)];
        let (push, wrench) = durations(body);
        let motions = [
            (What::Push(PUSH_N, 0.0, push), PUSH),
            (What::Push(PUSH_N, 45.0, push), PUSH_45),
            (What::Coast(0.5, 0.0), STOP),
            (What::Coast(0.0, 5.0), SPIN),
            (What::Coast(0.3, 3.0), COAST),
            (What::Wrench(WRENCH_N_NM.0, WRENCH_N_NM.1, wrench), WRENCH),
            (What::Hold(0.5 * body.c, 10.0), HOLD_HALF),
            (What::Hold(0.9 * body.c, 10.0), HOLD_NEAR),
        ];
        let of = |(what, kinds)| Self {
            body: *body,
            what,
            kinds,
        };
        motions.map(of).to_vec()
    }

    /// What is read off this motion.
    pub(super) fn kinds(&self) -> &'static [Kind] {
        self.kinds
    }

    /// What is done, in words.
    pub(super) fn words(&self) -> String {
        match self.what {
            What::Push(force, degrees, s) => {
                format!("{force:.4} N at {degrees} degrees for {s:.3} s")
            }
            What::Coast(v, omega) => format!("from {v} m/s and {omega} rad/s to rest"),
            What::Wrench(force, torque, s) => {
                format!("{force:.4} N along x with {torque:.5} N m for {s:.3} s")
            }
            What::Hold(force, s) => format!("{force:.4} N along x for {s:.3} s"),
        }
    }

    /// Where its reference comes from.
    pub(super) fn source(&self) -> Source {
        match self.what {
            What::Wrench(..) => Source::FinePatch,
            What::Coast(v, omega) if v != 0.0 && omega != 0.0 => Source::FinePatch,
            _ => Source::ClosedForm,
        }
    }

    /// Force (world, N), torque (N m) and time (s); no time: until rest.
    fn drive(&self) -> (Vec2, f64, Option<f64>) {
        match self.what {
            What::Push(force, degrees, s) => {
                let (sin, cos) = libm::sincos(degrees.to_radians());
                (Vec2::new(force * cos, force * sin), 0.0, Some(s))
            }
            What::Coast(..) => (Vec2::zeros(), 0.0, None),
            What::Wrench(force, torque, s) => (Vec2::new(force, 0.0), torque, Some(s)),
            What::Hold(force, s) => (Vec2::new(force, 0.0), 0.0, Some(s)),
        }
    }

    /// What the environment does from tick to tick, and when it comes to rest or the motion ends (s).
    ///
    /// Rest comes between two ticks: at the rate of braking of the last two in which it moved.
    fn measure(&self) -> Result<(Vec<Displacement>, f64), PhysicsError> {
        let (force, torque, seconds) = self.drive();
        let mut environment = Environment::try_new(self.body.config)?;
        if let What::Coast(v, omega) = self.what {
            environment.set_twist(Twist::new(v, 0.0, omega));
        }
        let ticks = (seconds.unwrap_or(COAST_MAX_S) / TICK_S).round() as usize;
        let mut motion = vec![Displacement::default()];
        let speed = |twist: Twist| match self.what {
            What::Coast(0.0, _) => twist.angular.abs(),
            _ => twist.linear.norm(),
        };
        let (mut last, mut slowed) = (speed(environment.twist()), 0.0);
        for tick in 0..ticks {
            environment.step_with_wrench(force, torque);
            let pose = environment.pose();
            let shift = match self.what {
                What::Coast(..) | What::Wrench(..) => pose.position.x,
                What::Push(..) | What::Hold(..) => pose.position.norm(),
            };
            let angle = pose.angle;
            motion.push(Displacement { shift, angle });
            if seconds.is_some() {
                continue;
            }
            if environment.twist() == Twist::default() {
                let beyond = if slowed > 0.0 {
                    (last / slowed).min(1.0)
                } else {
                    1.0
                };
                return Ok((motion, (tick as f64 + beyond) * TICK_S));
            }
            let now = speed(environment.twist());
            (last, slowed) = (now, last - now);
        }
        Ok((motion, seconds.unwrap_or(COAST_MAX_S)))
    }

    /// What it should do, each place with its time (s), from the start to the end.
    fn expect(&self, measured_seconds: f64) -> Vec<(f64, Displacement)> {
        let body = &self.body;
        let slide = |f: f64, v: f64| Line {
            m: body.m,
            b: body.b,
            f,
            v,
        };
        let on_a_line = |line: Line, end: f64, turns: bool| {
            let at = |k: usize| {
                let t = end * k as f64 / TRACE_POINTS as f64;
                let x = line.at(t);
                let (shift, angle) = if turns { (0.0, x) } else { (x, 0.0) };
                (t, Displacement { shift, angle })
            };
            (0..=TRACE_POINTS).map(at).collect()
        };
        let at_rest = |s| vec![(0.0, Displacement::default()), (s, Displacement::default())];
        let patch = |force, torque, start: State, seconds| {
            let fine = FinePatch::new(body, force, torque);
            if start == [0.0; 6] && fine.holds() {
                return at_rest(seconds);
            }
            let states = fine.run(start, seconds, STEPS);
            let seen =
                |(t, [shift, _, angle, ..]): (f64, State)| (t, Displacement { shift, angle });
            states.into_iter().map(seen).collect()
        };
        match self.what {
            What::Push(force, _, s) if force <= body.c => at_rest(s),
            What::Push(force, _, s) => on_a_line(slide(force - body.c, 0.0), s, false),
            What::Hold(_, s) => at_rest(s),
            What::Coast(v, 0.0) => {
                let line = slide(-body.c, v);
                on_a_line(line, line.rest_s(), false)
            }
            What::Coast(0.0, omega) => {
                let line = Line {
                    m: body.inertia,
                    b: body.b_r,
                    f: -body.e,
                    v: omega,
                };
                on_a_line(line, line.rest_s(), true)
            }
            What::Coast(v, omega) => {
                let start = [0.0, 0.0, 0.0, v, 0.0, omega];
                // room for a later rest than the measured one; both end by themselves
                patch(0.0, 0.0, start, 1.2 * measured_seconds)
            }
            What::Wrench(force, torque, s) => patch(force, torque, [0.0; 6], s),
        }
    }
}

/// How long push and wrench last, s, or until the body is as fast as it may be.
fn durations(body: &Dynamics) -> (f64, f64) {
    let until = |rate: f64, most: f64| {
        if rate > 0.0 {
            SPEED_SHARE * most / rate
        } else {
            f64::INFINITY
        }
    };
    let whole = |seconds: f64| libm::floor(seconds / TICK_S) * TICK_S;
    let push = until((PUSH_N - body.c) / body.m, SPEED_M_PER_S);
    // as if nothing braked it
    let wrench = until(WRENCH_N_NM.0 / body.m, SPEED_M_PER_S);
    let wrench = wrench.min(until(-WRENCH_N_NM.1 / body.inertia, TURN_RATE_RAD_PER_S));
    (whole(push.min(DURATIONS.0)), whole(wrench.min(DURATIONS.1)))
}

/// A motion, measured and as it should be.
pub(super) struct MeasuredMotion {
    measured: Vec<Displacement>,
    reference: Vec<(f64, Displacement)>,
    /// Time until the body rested or the motion ended, s.
    pub(super) measured_seconds: f64,
    /// The same as it should be, s.
    pub(super) reference_seconds: f64,
}

impl MeasuredMotion {
    pub(super) fn of(motion: &ReferenceMotion) -> Result<Self, PhysicsError> {
        let (measured, measured_seconds) = motion.measure()?;
        let reference = motion.expect(measured_seconds);
        let reference_seconds = reference.last().map_or(0.0, |(t, _)| *t);
        Ok(Self {
            measured,
            reference,
            measured_seconds,
            reference_seconds,
        })
    }

    /// Reference and measured value at the end: angle (rad) or displacement (m).
    pub(super) fn ends(&self, turns: bool) -> (f64, f64) {
        let reference = self.reference.last().map(|(_, place)| place);
        let end = |place: Option<&Displacement>| place.map_or(0.0, |place| place.part(turns));
        (end(reference), end(self.measured.last()))
    }

    /// Both over the measured time.
    pub(super) fn trace(&self, turns: bool) -> Vec<TracePoint> {
        let last = self.measured.len() - 1;
        let stride = last.div_ceil(TRACE_POINTS - 1).max(1);
        let every = self.measured.iter().enumerate();
        let shown = every.filter(|(tick, _)| tick % stride == 0 || *tick == last);
        let point = |(tick, place): (usize, &Displacement)| {
            let t_s = tick as f64 * TICK_S;
            TracePoint {
                t_s,
                measured: place.part(turns),
                reference: self.expected_at(t_s).part(turns),
            }
        };
        shown.map(point).collect()
    }

    /// The reference between its two nearest instants; after its end it rests.
    fn expected_at(&self, t: f64) -> Displacement {
        let after = self.reference.partition_point(|(at, _)| *at <= t);
        let before = self.reference.get(after.saturating_sub(1));
        match (before, self.reference.get(after)) {
            (Some((t0, a)), Some((t1, b))) => {
                let share = (t - t0) / (t1 - t0);
                Displacement {
                    shift: a.shift + (b.shift - a.shift) * share,
                    angle: a.angle + (b.angle - a.angle) * share,
                }
            }
            (Some((_, place)), None) => *place,
            _ => Displacement::default(),
        }
    }
}

impl Displacement {
    /// The angle, or the displacement.
    fn part(&self, turns: bool) -> f64 {
        if turns { self.angle } else { self.shift }
    }
}

/// Where a reference comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// A closed form of (1), (7) with the friction of (9).
    ClosedForm,
    /// The fine patch.
    FinePatch,
}

/// One instant of a trace.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TracePoint {
    /// Time since the start of the motion, s.
    pub t_s: f64,
    /// What the environment did.
    pub measured: f64,
    /// What it should have done.
    pub reference: f64,
}
