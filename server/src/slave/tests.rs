//! The promises of `slave`.

use crate::environment::{BodyConfig, Shape};
use crate::estimator::Measured;
use mmt_shared::model::geometry::Face;
use mmt_shared::model::sample::HipCounts;
use mmt_shared::model::sample::HipSample;
use mmt_shared::model::settings::Mode;
use mmt_shared::model::tool::TOOL_FORCE_MAX_N;
use mmt_shared::time::{TICK, TICK_S};

use super::*;

mod missed_ticks;
mod trigger_input;

/// The updates of 2 s in which the object, at the edge of the workspace, flies away at 0.5 m/s.
fn updates_of_an_object_that_leaves() -> (Vec<Update>, u64) {
    let mut config = SlaveConfig::of_mode(Mode::Recommended);
    config.trigger.scheme = Scheme::EverySample;
    config.environment.pose = Pose::new(4.9, 0.0, 0.0);
    let coupling = Coupling::for_stiffness(1000.0);
    let mut slave = Slave::try_new(&config, coupling).unwrap();
    let (mut now, mut updates) = (Time::ZERO, Vec::new());
    for _ in 0..2000 {
        now += TICK;
        let flight = Twist::new(0.5, 0.0, 0.0);
        slave.environment_mut().set_twist(flight);
        let sample = HipSample {
            stamp: now,
            hip: HipCounts::nearest(Vec2::new(4.0, 0.0)),
            ..HipSample::default()
        };
        slave.handle_sample(now, &sample, 0);
        updates.extend(slave.tick(now).and_then(|tick| tick.update));
    }
    (updates, slave.clamped_states())
}

#[test]
fn an_object_beyond_the_workspace_is_at_its_edge_and_counted_and_updates_go_on() {
    let (updates, clamped) = updates_of_an_object_that_leaves();
    let x = |update: &Update| update.state.pose().position.x;
    let most = updates.iter().map(x).fold(0.0, f64::max);
    assert_eq!(most, 5.0, "it has left, and no master refuses it");
    let at_the_edge = updates.iter().filter(|update| x(update) == 5.0).count();
    assert!(at_the_edge > 500, "{at_the_edge}");
    assert!(clamped >= at_the_edge as u64, "{clamped}");
    let numbers = updates.iter().map(|update| update.sequence);
    assert!(numbers.eq(1..=updates.len() as u32), "none is left out");
}

/// A slave that is driven along a straight path, 0.15 m/s.
struct Driven {
    slave: Slave,
    now: Time,
    hip: Vec2,
    updates: Vec<Update>,
    peak_n: f64,
}

impl Driven {
    fn new(mode: Mode, bodies: Vec<BodyConfig>) -> Self {
        let mut config = SlaveConfig::of_mode(mode);
        config.scene.bodies = bodies;
        Self::of(&config)
    }

    fn of(config: &SlaveConfig) -> Self {
        let coupling = Coupling::for_stiffness(1000.0);
        let mut config = config.clone();
        // this hand feels nothing, so it would be credited with no work
        config.tool_energy.bounded = false;
        let mut slave = Slave::try_new(&config, coupling).unwrap();
        let hip = Vec2::new(-0.3, 0.0);
        slave.start_at(hip);
        Self {
            slave,
            now: Time::ZERO,
            hip,
            updates: Vec::new(),
            peak_n: 0.0,
        }
    }

    fn go(&mut self, to: (f64, f64)) {
        let way = Vec2::new(to.0, to.1) - self.hip;
        let ticks = (way.norm() / 0.15e-3).ceil().max(1.0);
        for _ in 0..ticks as u32 {
            self.take(self.hip + way / ticks);
            self.tick();
        }
    }

    /// A millisecond later the slave takes in that the hand is at `hip` (m).
    fn take(&mut self, hip: Vec2) {
        self.now += TICK;
        self.hip = hip;
        let newest = self.updates.last().map_or(0, |update| update.sequence);
        let sample = HipSample {
            stamp: self.now,
            hip: HipCounts::nearest(hip),
            ..HipSample::default()
        };
        self.slave.handle_sample(self.now, &sample, newest);
    }

    fn tick(&mut self) {
        let Some(tick) = self.slave.tick(self.now) else {
            return;
        };
        assert!(tick.truth.is_finite() && tick.f_shadow.norm().is_finite());
        self.peak_n = self.peak_n.max(tick.true_force.norm());
        self.updates.extend(tick.update);
    }
}

fn cube(y: f64, mass_kg: f64, fixed: bool) -> BodyConfig {
    BodyConfig {
        pose: Pose::new(0.0, y, 0.0),
        mass_kg,
        fixed,
        ..BodyConfig::default()
    }
}

/// Pushes the cube at y = 0, then the one at y = 1, then the first again; both give way to the east.
fn pushed_in_turn(mode: Mode, second: BodyConfig) -> (Driven, [usize; 3]) {
    let mut driven = Driven::new(mode, vec![cube(0.0, 0.7, false), second]);
    driven.go((0.1, 0.0));
    let first = driven.updates.len();
    for to in [(-0.6, 0.0), (-0.6, 1.0), (0.0, 1.0)] {
        driven.go(to);
    }
    let second = driven.updates.len();
    for to in [(-0.6, 1.0), (-0.6, 0.0), (0.15, 0.0)] {
        driven.go(to);
    }
    let third = driven.updates.len();
    (driven, [first, second, third])
}

#[test]
fn the_model_goes_over_to_the_body_that_is_touched_and_comes_back() {
    for mode in [Mode::Paper, Mode::Recommended] {
        let (driven, [first, second, third]) = pushed_in_turn(mode, cube(1.0, 2.0, false));
        let y = |k: usize| driven.updates[k].state.pose().position.y;
        assert!(y(first - 1).abs() < 0.05, "{mode:?}: {}", y(first - 1));
        assert!(
            (y(second - 1) - 1.0).abs() < 0.05,
            "{mode:?}: {}",
            y(second - 1)
        );
        assert!(y(third - 1).abs() < 0.05, "{mode:?}: {}", y(third - 1));
        // what the master has is where the slave takes the object to be, and it is felt
        let model = driven.slave.shadow().ahead();
        let (seen, shown) = (driven.slave.observer().pose(), model.state().pose);
        assert!(
            (seen.position - shown.position).norm() < 0.03,
            "{mode:?}: {seen:?} {shown:?}"
        );
        assert!(model.rendered().in_contact(), "{mode:?}");
    }
}

#[test]
fn where_images_show_the_size_the_model_begins_with_it_and_so_does_each_other_body() {
    let brick = Shape::Brick {
        length_m: 0.5,
        width_m: 0.2,
    };
    let mut config = SlaveConfig::of_mode(Mode::Recommended);
    let second = BodyConfig {
        shape: brick,
        ..cube(1.0, 2.0, false)
    };
    config.scene.bodies = vec![cube(0.0, 0.7, false), second];
    let offsets = |slave: &Slave| Face::ALL.map(|face| slave.observer().footprint().offset(face));
    let near = |found: [f64; 4], expected: [f64; 4]| {
        let mut pairs = found.into_iter().zip(expected);
        pairs.all(|(found, expected)| (found - expected).abs() < 5e-3)
    };
    assert!(
        near(offsets(&Driven::of(&config).slave), [0.2; 4]),
        "assumed"
    );
    config.sensing.vision.size_noise_m = Some(1e-3);
    let mut driven = Driven::of(&config);
    assert!(near(offsets(&driven.slave), [0.18; 4]), "seen");
    let start = driven.slave.start.footprint();
    assert!(near(Face::ALL.map(|face| start.offset(face)), [0.18; 4]));
    for to in [(-0.6, 0.0), (-0.6, 1.0), (0.0, 1.0)] {
        driven.go(to);
    }
    let found = offsets(&driven.slave);
    assert!(near(found, [0.25, 0.1, 0.25, 0.1]), "{found:?}");
}

#[test]
fn what_was_found_of_a_body_is_remembered() {
    let (driven, [first, second, third]) = pushed_in_turn(Mode::Recommended, cube(1.0, 2.0, false));
    let c = |k: usize| driven.updates[k].state.params().c();
    let (one, other) = (c(first - 1), c(second - 1));
    assert!(other > 1.7 * one, "{one} and {other} N");
    let back = (second..third).find(|k| driven.updates[*k].state.pose().position.y < 0.5);
    let again = c(back.unwrap());
    assert!((again / one - 1.0).abs() < 0.2, "{again} N after {one} N");
}

#[test]
fn a_fixed_body_is_pushed_with_no_more_than_the_tools_limit_and_stays() {
    for mode in [Mode::Paper, Mode::Recommended] {
        let (driven, _) = pushed_in_turn(mode, cube(1.0, 0.7, true));
        assert!(
            driven.peak_n > 5.0 && driven.peak_n < 25.0,
            "{}",
            driven.peak_n
        );
        let fixed = driven.slave.environment().pose_of(1).unwrap();
        assert_eq!(fixed, Pose::new(0.0, 1.0, 0.0));
        assert!(
            driven
                .updates
                .iter()
                .all(|update| update.state.params().c().is_finite())
        );
    }
}

/// The largest force (N) that a viewer is shown of a tool that stands at `hip` (m) for half a second, and the largest measured one.
fn shown_and_measured(hip: Vec2) -> (f64, f64) {
    let mut driven = Driven::new(Mode::Recommended, vec![cube(0.0, 0.7, false)]);
    let (mut shown_n, mut measured_n) = (0.0_f64, 0.0_f64);
    for _ in 0..500 {
        driven.take(hip);
        let Some(tick) = driven.slave.tick(driven.now) else {
            continue;
        };
        shown_n = shown_n.max(driven.slave.scene(&tick).force.norm());
        measured_n = measured_n.max(tick.f_s.norm());
    }
    (shown_n, measured_n)
}

#[test]
fn a_viewer_is_shown_the_force_of_contact_and_no_noise_without_it() {
    let (shown_n, measured_n) = shown_and_measured(Vec2::new(-0.3, 0.0));
    assert!(shown_n == 0.0 && measured_n > 0.0, "{measured_n} N");
    let (shown_n, _) = shown_and_measured(Vec2::new(-0.178, 0.0));
    assert!(shown_n > 0.5, "{shown_n} N");
}

/// Largest force (N) of a tool whose HIP stays at `hip` from the start, over a second, and where it is at last.
fn pressed(hip: Vec2) -> (f64, Vec2) {
    let coupling = Coupling::for_stiffness(1000.0);
    let mut slave = Slave::try_new(&SlaveConfig::default(), coupling).unwrap();
    slave.start_at(hip);
    let mut peak_n = 0.0_f64;
    for ms in 1..=1000 {
        let now = Time::from_millis(ms);
        let sample = HipSample {
            stamp: now,
            hip: HipCounts::nearest(hip),
            ..HipSample::default()
        };
        slave.handle_sample(now, &sample, 0);
        if let Some(tick) = slave.tick(now) {
            peak_n = peak_n.max(tick.true_force.norm());
        }
    }
    (peak_n, slave.tool_at())
}

#[test]
fn a_hip_inside_of_a_body_at_the_start_presses_no_harder_than_the_tool_may() {
    // 180 N when the tool began at the HIP
    for x in [-0.178, -0.15, -0.02] {
        let (peak_n, _) = pressed(Vec2::new(x, 0.01));
        assert!(
            (1.0..=TOOL_FORCE_MAX_N + 0.1).contains(&peak_n),
            "{x} m: {peak_n} N"
        );
    }
    let free = Vec2::new(-0.25, 0.01);
    let (peak_n, at) = pressed(free);
    assert!(
        peak_n == 0.0 && (at - free).norm() < 1e-6,
        "{peak_n} N at {at}"
    );
}

#[test]
fn what_a_session_leaves_is_where_the_next_one_begins() {
    let bodies = vec![cube(0.0, 0.7, false), cube(1.0, 0.7, false)];
    let mut driven = Driven::new(Mode::Recommended, bodies.clone());
    driven.go((0.2, 0.0));
    let (first, memory) = (&driven.slave, driven.slave.memory());
    assert!(first.environment().pose().position.x > 0.1, "it was pushed");
    let mut config = SlaveConfig::default();
    config.scene.bodies = bodies;
    for stiffness in [1000.0, 2500.0] {
        let coupling = Coupling::for_stiffness(stiffness);
        let next = Slave::remembering(&config, coupling, &memory).unwrap();
        assert_eq!(next.environment().poses(), first.environment().poses());
        assert_eq!(next.tool_at(), first.tool_at());
        assert_eq!(next.estimate().c, first.estimate().c);
        assert_ne!(next.estimate().c, config.start.friction_n, "it has learnt");
        assert_eq!(next.state().pose(), next.environment().pose());
        assert_eq!(next.memory(), memory, "nothing has happened since");
    }
}

/// The parameters of the updates of two seconds in which an estimator of somebody else's finds this.
fn params_sent_with(found: Option<[f64; 3]>) -> (Vec<[f64; 3]>, u64) {
    let mut config = SlaveConfig::of_mode(Mode::Recommended);
    config.trigger.scheme = Scheme::EverySample;
    let mut slave = Slave::try_new(&config, Coupling::for_stiffness(1000.0)).unwrap();
    let (mut now, mut sent) = (Time::ZERO, Vec::new());
    for _ in 0..100 {
        now += TICK;
        let sample = HipSample {
            stamp: now,
            ..HipSample::default()
        };
        slave.handle_sample(now, &sample, 0);
        let mut estimator = |_: Time, _: &Measured| found;
        let others = Substitutes {
            estimator: Some(&mut estimator),
            scheme: None,
        };
        let update = slave.tick_with(now, others).and_then(|tick| tick.update);
        sent.extend(update.map(|update| {
            let params = update.state.params();
            [params.m(), params.b(), params.c()]
        }));
    }
    (sent, slave.refused_estimates())
}

#[test]
fn an_estimator_of_somebody_else_is_what_the_master_gets_if_it_is_accepted() {
    let theirs = [1.25, 4.0, 3.0];
    let (own, refused) = params_sent_with(None);
    assert!(own.len() > 50 && refused == 0, "{} {refused}", own.len());
    let (sent, refused) = params_sent_with(Some(theirs));
    assert!(sent.iter().all(|params| *params == theirs), "{sent:?}");
    assert!(sent.len() == own.len() && refused == 0);
    for wrong in [[-1.0, 4.0, 3.0], [f64::NAN, 4.0, 3.0], [1.0, 1e9, 3.0]] {
        let (sent, refused) = params_sent_with(Some(wrong));
        assert_eq!(
            (sent, refused),
            (own.clone(), own.len() as u64),
            "{wrong:?}"
        );
    }
}

#[test]
fn the_spring_of_a_plants_tool_takes_the_newest_force() {
    let given_m = |link| {
        let mut config = SlaveConfig::of_mode(Mode::Recommended);
        config.tool_compliance = Some(Coupling::for_stiffness(1200.0));
        config.plant.link = link;
        let mut slave = Slave::try_new(&config, Coupling::for_stiffness(1000.0)).unwrap();
        slave.compliance.step(Vec2::new(3.0, 0.0), TICK_S).0.x
    };
    assert!((given_m(true) - 2.0 * given_m(false)).abs() < 1e-12);
}
