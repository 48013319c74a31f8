//! Promises of the gain, on an object that a tool pushes again and again.

use mmt_shared::fixtures::COUPLING;
use mmt_shared::rng::Substream;
use mmt_shared::time::TICK_S;
use std::f64::consts::TAU;

use super::*;

/// A tool pushes an object of (1) along x, and a sensor measures the force.
struct Push {
    gain: Gain,
    random: Substream,
    object: [f64; 3],
    times_k_p: f64,
    /// What the object runs against, m.
    wall: f64,
    sensor_gain: f64,
    lag_s: f64,
    noise_n: f64,
    face: f64,
    velocity: f64,
    lagging: f64,
    tool: f64,
}

impl Push {
    fn new(seed: u64, object: [f64; 3], sensor_gain: f64, lag_s: f64, noise_n: f64) -> Self {
        Self {
            gain: Gain::new(COUPLING),
            random: Substream::new(seed, "test/gain", 0),
            object,
            times_k_p: 1.0,
            wall: f64::INFINITY,
            sensor_gain,
            lag_s,
            noise_n,
            face: 0.0,
            velocity: 0.0,
            lagging: 0.0,
            tool: -0.02,
        }
    }

    fn tick(&mut self, tool: f64) {
        let [m, b, c] = self.object;
        let depth = tool - self.face;
        let rate = (tool - self.tool) / TICK_S - self.velocity;
        self.tool = tool;
        let touches = depth > 0.0;
        let force = if touches {
            self.times_k_p * COUPLING.force(depth, rate)
        } else {
            0.0
        };
        let free = m * self.velocity + TICK_S * force;
        let left = (free.abs() - TICK_S * c).max(0.0);
        self.velocity = left.copysign(free) / (m + TICK_S * b);
        self.face += TICK_S * self.velocity;
        if self.face > self.wall {
            (self.face, self.velocity) = (self.wall, 0.0);
        }
        let follows = 1.0 - libm::exp(-TICK_S / self.lag_s.max(1e-6));
        self.lagging += (force - self.lagging) * follows;
        let ((x, y), (at, _)) = (self.random.normal_pair(), self.random.normal_pair());
        let measured =
            Vec2::new(self.sensor_gain * self.lagging, 0.0) + Vec2::new(x, y) * self.noise_n;
        let tool = Vec2::new(tool + 10e-6 * at, 0.0);
        let in_contact = self.lagging > 5.0 * self.noise_n.max(0.02) / 3.0;
        self.gain.step(measured, tool, in_contact, self.noise_n);
    }

    /// Nothing is touched for as long as an object takes to be at rest.
    fn rested(mut self) -> Self {
        for _ in 0..AT_REST_TICKS {
            self.tick(self.tool);
        }
        self
    }

    /// Pushes for so many ticks, at about 0.1 m/s and with a tremor, and goes back to wait.
    fn push(&mut self, ticks: u32) {
        let from = self.tool;
        for tick in 0..=ticks + 200 {
            let t = f64::from(tick) * TICK_S;
            let slow = 0.04 * (1.0 - libm::cos(TAU * 0.6 * t)) / (TAU * 0.6);
            self.tick(from + 0.1 * t + slow + 1e-4 * libm::sin(TAU * 9.0 * t));
        }
        let (from, to) = (self.tool, self.face - 0.02);
        for tick in 0..1000 {
            self.tick(from + (to - from) * (f64::from(tick) / 200.0).min(1.0));
        }
    }

    /// The gain that is known over the true one.
    fn ratio(&self) -> f64 {
        self.gain.known() / self.sensor_gain
    }
}

const OBJECTS: [[f64; 3]; 4] = [
    [0.7, 3.0, 2.0],
    [0.3, 1.0, 0.8],
    [2.0, 5.0, 4.0],
    [1.0, 0.0, 6.0],
];

#[test]
fn a_few_contacts_of_known_stiffness_show_the_gain_of_a_sensor_that_lags_and_has_noise() {
    for (noise_n, lag_s, within) in [(0.01, 0.0, [0.04, 0.02]), (0.1, 5e-3, [0.08, 0.05])] {
        for (seed, object) in (1..).zip(OBJECTS) {
            for sensor_gain in [0.9, 1.0, 1.1] {
                let mut push = Push::new(seed, object, sensor_gain, lag_s, noise_n).rested();
                push.push(800);
                let first = push.ratio();
                for _ in 0..3 {
                    push.push(800);
                }
                let last = push.ratio();
                println!("{noise_n} N, {object:?}, {sensor_gain}: {first:.3}, then {last:.3}");
                for (ratio, within) in [first, last].into_iter().zip(within) {
                    assert!(
                        (ratio - 1.0).abs() < within,
                        "{noise_n} N, {object:?}, {sensor_gain}: {ratio}"
                    );
                }
            }
        }
    }
}

#[test]
fn short_touches_and_an_object_that_may_just_have_been_touched_show_nothing() {
    let [object, ..] = OBJECTS;
    let mut push = Push::new(1, object, 1.1, 0.0, 0.01).rested();
    for _ in 0..10 {
        // 0.2 s on the way, then less than 0.3 s of contact
        push.push(240);
    }
    assert!(
        push.gain.found().is_none(),
        "short touches: {}",
        push.gain.known()
    );
    let mut push = Push::new(1, object, 1.1, 0.0, 0.01);
    push.push(400);
    assert!(
        push.gain.found().is_none(),
        "a session that has just begun: {}",
        push.gain.known()
    );
}

#[test]
fn a_contact_of_another_stiffness_is_no_gain() {
    let [object, ..] = OBJECTS;
    for times_k_p in [0.3, 5.0] {
        let mut push = Push::new(1, object, 1.0, 0.0, 0.01).rested();
        push.times_k_p = times_k_p;
        for _ in 0..4 {
            push.push(800);
        }
        assert!(
            push.gain.found().is_none(),
            "{times_k_p}: {}",
            push.gain.known()
        );
    }
}

#[test]
fn an_object_that_runs_against_something_shows_no_gain() {
    for way_m in [0.005, 0.01, 0.02] {
        let mut push = Push::new(1, OBJECTS[0], 1.1, 0.0, 0.01).rested();
        push.wall = way_m;
        push.push(400);
        assert!(
            push.gain.found().is_none(),
            "{way_m} m: {}",
            push.gain.known()
        );
    }
}
