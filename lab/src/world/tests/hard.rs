//! The hard cases of delay, each a scenario with a law; `docs/limits.md` lists what is not made good.

use super::*;
use mmt_client::operator::scripted::Phase;
use mmt_server::environment::Wall;
use mmt_shared::model::geometry::Pose;

use crate::worlds::{Obstacle, RandomWorld};

/// How far the real object turns within a round trip of 2 s, rad: the most of a run.
#[derive(Default)]
struct Turned {
    angles: Vec<f64>,
    most: f64,
}

impl Turned {
    fn look(&mut self, world: &World) {
        self.angles.push(world.slave().environment().pose().angle);
        let newest = self.angles[self.angles.len() - 1];
        let then = self.angles[self.angles.len().saturating_sub(2000)];
        self.most = self.most.max((newest - then).abs());
    }
}

/// What came of a scenario.
#[derive(Clone, Copy, Debug)]
struct Felt {
    /// Largest force on the hand, N, and largest step of it.
    peak_n: f64,
    step_n: f64,
    breaks_per_push: f64,
    pushes: u64,
    pose_rms_mm: f64,
    relative_error: f64,
    injected_mj: f64,
    observer_min_mj: f64,
    /// Largest force between the tool and the object, N.
    slave_peak_n: f64,
    /// For how long its limit held the tool back, s.
    held_s: f64,
}

/// Runs 25 s and calls `before` before every tick. No scenario gives the hand energy or stops the work.
fn felt(name: &str, config: &WorldConfig, mut before: impl FnMut(&mut World)) -> Felt {
    let mut world = World::try_new(config).unwrap();
    let mut slave_peak_n = 0.0_f64;
    for _ in 0..25_000 {
        before(&mut world);
        let tick = world.step();
        slave_peak_n = slave_peak_n.max(tick.slave.map_or(0.0, |slave| slave.true_force.norm()));
    }
    let outcome = world.outcome();
    let pushes = world.operator().pushes_completed().unwrap();
    let felt = Felt {
        peak_n: outcome.on_hand.largest_n().unwrap(),
        step_n: outcome.on_hand.largest_step_n().unwrap(),
        breaks_per_push: outcome.breaks.per_push(pushes).unwrap(),
        pushes,
        pose_rms_mm: outcome.pose.position_rms_m().unwrap() * 1e3,
        relative_error: relative_error(&world),
        injected_mj: outcome.energy_injected_j * 1e3,
        observer_min_mj: outcome.observer_min_j * 1e3,
        slave_peak_n,
        held_s: world.slave().tool_force().held_ticks() as f64 * TICK.as_secs_f64(),
    };
    println!("{name:40} {felt:.3?}");
    assert!(felt.injected_mj <= 1e-6, "{name}: {felt:?}");
    assert!(felt.observer_min_mj >= -1.0, "{name}: {felt:?}");
    assert!(felt.pushes >= 1, "{name}: {felt:?}");
    felt
}

fn delayed(one_way_ms: u64) -> WorldConfig {
    over(&format!("delay {one_way_ms}ms"), 1)
}

fn is_pushing(world: &World) -> bool {
    let Operator::Scripted(scripted) = world.operator() else {
        return false;
    };
    scripted.phase() == Phase::Push && world.master().model().rendered().in_contact()
}

#[test]
fn a_hand_deep_inside_the_model_after_a_long_delay_is_not_thrown_out() {
    // the model's faces are 7 cm too far out, or 5 cm too far in: a round trip of pushing what is not there
    for one_way_ms in [0, 1000] {
        for side_m in [0.50, 0.26] {
            let mut config = delayed(one_way_ms);
            config.slave.start.side_m = side_m;
            let felt = felt(
                &format!("{one_way_ms} ms, side {side_m} m"),
                &config,
                |_| {},
            );
            assert!(felt.peak_n <= 4.0, "{felt:?}");
            assert!(felt.pose_rms_mm <= 30.0, "{felt:?}");
            assert!(felt.step_n <= 1.6, "{felt:?}");
            assert!(felt.breaks_per_push <= 1.1, "{felt:?}");
        }
    }
}

#[test]
fn a_face_that_is_changed_during_the_delay_is_the_one_that_is_felt() {
    // the way to the next face takes 3.2 s, a round trip 4 s
    let felt = felt("face change within a round trip", &delayed(2000), |_| {});
    assert!(
        felt.peak_n <= 4.0 && felt.breaks_per_push <= 1.1,
        "{felt:?}"
    );
}

/// The first push meets it after 12 cm.
const WALL: Wall = Wall {
    distance_m: 0.30,
    angle_rad: 0.0,
};

#[test]
fn a_wall_that_the_model_does_not_know_is_pressed_on_no_harder_than_the_tool_may() {
    for one_way_ms in [0, 50, 250, 500, 1000, 2000] {
        // with a stiff device and a noisy sensor as well
        for (k_p, noise_n, seed) in [(1000.0, 0.01, 1), (3000.0, 0.01, 2), (1000.0, 0.03, 3)] {
            let mut config = delayed(one_way_ms).seeded(seed);
            config.stiffness_n_per_m = Some(k_p);
            config.slave.sensing.force_noise_n = noise_n;
            config.slave.environment.wall = Some(WALL);
            let name = format!("{one_way_ms} ms, a wall, {k_p} N/m, noise {noise_n} N");
            let felt = felt(&name, &config, |_| {});
            assert!(felt.peak_n <= 8.0 + 1e-9, "{felt:?}");
            assert!(felt.breaks_per_push <= 6.0, "{felt:?}");
            // as exactly as the sensor measures
            let most_n = config.slave.tool_force_max_n;
            assert!(felt.slave_peak_n <= most_n, "{felt:?}");
            assert!(felt.held_s > 0.1, "the effect exists: {felt:?}");
        }
    }
}

#[test]
fn without_a_limit_the_tool_follows_the_hand_into_an_object_that_a_wall_stops() {
    for (one_way_ms, least_n) in [(0, 20.0), (500, 150.0)] {
        let mut config = delayed(one_way_ms);
        config.slave.environment.wall = Some(WALL);
        config.slave.tool_force_max_n = 1000.0;
        let felt = felt(&format!("{one_way_ms} ms, no limit"), &config, |_| {});
        assert!(felt.slave_peak_n > least_n, "the effect exists: {felt:?}");
    }
}

#[test]
fn a_limit_of_the_force_that_is_not_reached_changes_no_bit() {
    for one_way_ms in [0, 500] {
        let digest = |tool_force_max_n| {
            let mut config = delayed(one_way_ms);
            config.slave.tool_force_max_n = tool_force_max_n;
            let mut world = World::try_new(&config).unwrap();
            world.run(Duration::from_secs(15), |_| {});
            assert_eq!(world.slave().tool_force().held_ticks(), 0);
            world.digest()
        };
        assert_eq!(digest(15.0), digest(1000.0), "{one_way_ms} ms");
    }
}

#[test]
fn mass_and_friction_that_change_in_mid_push_are_felt_without_a_jolt() {
    for one_way_ms in [0, 500] {
        for (name, m, mu, most_n, breaks) in [
            ("twice the mass", 1.4, 0.3, 6.5, 1.1),
            ("twice the friction", 0.7, 0.6, 6.5, 1.1),
            ("half the mass, half the friction", 0.35, 0.15, 4.0, 1.5),
        ] {
            let mut changed = false;
            let name = format!("{one_way_ms} ms, {name}");
            let felt = felt(&name, &delayed(one_way_ms), |world| {
                if !changed && world.now > Time::from_millis(9_000) && is_pushing(world) {
                    changed = true;
                    world.environment_mut().set_mass(m).unwrap();
                    world.environment_mut().set_friction(mu).unwrap();
                }
            });
            assert!(changed);
            assert!(felt.peak_n <= most_n, "{felt:?}");
            assert!(felt.step_n <= 0.8, "{felt:?}");
            assert!(felt.breaks_per_push <= breaks, "{felt:?}");
        }
    }
}

#[test]
fn a_hand_that_shakes_at_8_hz_is_not_answered_by_larger_forces_at_any_delay() {
    let shaken = |one_way_ms| {
        let mut config = delayed(one_way_ms);
        config.operator.hand.tremor_hz = 8.0;
        config.operator.hand.tremor_m = 3e-3;
        felt(&format!("{one_way_ms} ms, 3 mm at 8 Hz"), &config, |_| {})
    };
    let near = shaken(0);
    for one_way_ms in [250, 1000] {
        let far = shaken(one_way_ms);
        assert!(far.peak_n <= 1.1 * near.peak_n, "{far:?}");
        // it lets go of the box by itself, near or far
        assert!(far.breaks_per_push <= 2.0 * near.breaks_per_push, "{far:?}");
    }
}

#[test]
fn a_contact_that_is_made_and_lost_within_one_round_trip_is_one_contact() {
    for one_way_ms in [0, 1000] {
        let mut config = delayed(one_way_ms);
        (config.operator.push_m, config.operator.hold_s) = (0.02, 0.0);
        let felt = felt(&format!("{one_way_ms} ms, touch and go"), &config, |_| {});
        assert!(felt.pushes >= 5, "{felt:?}");
        assert!(
            felt.peak_n <= 4.0 && felt.breaks_per_push <= 1.1,
            "{felt:?}"
        );
    }
}

#[test]
fn clocks_that_drift_apart_by_200_ppm_change_nothing() {
    for one_way_ms in [0, 500] {
        let still = felt("clocks together", &delayed(one_way_ms), |_| {});
        let drifting = felt("200 ppm", &delayed(one_way_ms), |world| {
            world.slave_clock.drift_ppm = 200;
        });
        assert!(drifting.peak_n <= 1.05 * still.peak_n, "{drifting:?}");
        assert!(drifting.relative_error <= 1.05 * still.relative_error + 0.005);
        assert!(drifting.breaks_per_push <= still.breaks_per_push + 1e-9);
    }
}

#[test]
fn a_step_of_the_slaves_clock_is_survived_and_the_tool_stays_below_its_speed() {
    let at = Time::from_millis(10_000);
    let steps = [(300, true), (300, false), (5000, true), (5000, false)];
    for one_way_ms in [0, 500] {
        for (step_ms, forward) in steps {
            let name = format!("{one_way_ms} ms, {step_ms} ms forward: {forward}");
            let felt = felt(&name, &delayed(one_way_ms), |world| {
                let by = Duration::from_millis(step_ms);
                // no monotonic clock goes back, and no promise is about one that does
                world.judges &= forward;
                let ahead = &mut world.slave_clock.ahead;
                match (world.now == at, forward) {
                    (true, true) => *ahead += by,
                    (true, false) => *ahead -= by,
                    (false, _) => {}
                }
            });
            assert!(
                felt.peak_n <= 4.0 && felt.breaks_per_push <= 1.2,
                "{felt:?}"
            );
            assert!(felt.slave_peak_n <= 15.0, "{felt:?}");
            // a clock that is set forward looks like ticks that were missed: the world goes on for 10 ms at once
            let most_mm = if forward { 11.0 } else { 30.0 };
            assert!(felt.pose_rms_mm <= most_mm, "{felt:?}");
        }
    }
}

#[test]
fn after_an_outage_of_60_ms_the_limits_of_speed_and_acceleration_keep_the_force_on_the_object_low()
{
    let peak = |one_way_ms, speed_max_m_per_s, acceleration_max_m_per_s2| {
        let mut config = delayed(one_way_ms);
        config.slave.playout.speed_max_m_per_s = speed_max_m_per_s;
        config.slave.playout.acceleration_max_m_per_s2 = acceleration_max_m_per_s2;
        let name = format!("{one_way_ms} ms, outages, {speed_max_m_per_s} m/s");
        let felt = felt(&name, &config, |world| {
            let outage = world.now.as_nanos() / 1_000_000 % 700 < 60;
            while outage && world.up.poll_delivered(world.now + TICK).is_some() {}
        });
        felt.slave_peak_n
    };
    for one_way_ms in [50, 500] {
        let (limited, free) = (peak(one_way_ms, 0.6, 20.0), peak(one_way_ms, 10.0, 1000.0));
        assert!(limited < free, "the effect exists: {free} N");
        // what a touch that nobody foresaw may cost, at whatever speed a configuration allows
        assert!(free <= 15.0, "{free} N");
    }
}

#[test]
fn a_box_that_slid_along_a_wall_can_be_pushed_elsewhere() {
    // what the wall bears is no friction: a model with that stands under all that a hand gives, and the hand never finds out
    let random = RandomWorld::new(20_011);
    assert_eq!(random.obstacle, Obstacle::Wall);
    let mut world = World::try_new(&random.config).unwrap();
    let mut at_the_wall = 0.0_f64;
    for _ in 0..20_000 {
        world.step();
        at_the_wall = at_the_wall.max(world.slave().estimate().c);
    }
    let (found, error) = (world.slave().estimate().c, relative_error(&world));
    println!("c {found} N, at the wall {at_the_wall} N; relative error {error}");
    assert!(at_the_wall > 4.0 && found < 1.5 * random.friction_n);
    assert!(error < 1.0, "{error}");
}

/// A model with more friction is held by what is none, N.
const HELD_N: f64 = 100.0;

#[test]
fn what_a_wall_held_is_not_felt_to_be_held_from_another_face_and_what_nothing_moves_is() {
    // the model's friction, N, when the hand first pushes another face than the held one
    let felt = |number: u64| {
        let random = RandomWorld::new(number);
        let mut world = World::try_new(&random.config).unwrap();
        let (mut held, mut felt) = (None, None);
        for _ in 0..20_000 {
            world.step();
            let slave = world.slave();
            if let Some(contact) = slave.observer().contact() {
                let is_held = slave.estimate().holding.is_some_and(|c| c > HELD_N);
                held = is_held.then_some(contact.inward).or(held);
            }
            let model = world.master().model();
            let touched = model.rendered().touch.map(|touch| touch.inward);
            if held
                .is_some_and(|held| touched.is_some_and(|touched| held.dot(&touched).abs() < 0.5))
            {
                felt.get_or_insert(model.state().params.c());
            }
        }
        (felt.unwrap(), relative_error(&world), random)
    };
    let (c, error, random) = felt(20_951);
    println!(
        "held by a wall: c {c} N of {} N; relative error {error}",
        random.friction_n
    );
    assert_eq!(random.obstacle, Obstacle::Wall);
    assert!(c < 2.0 * random.friction_n && error < 1.0, "{c} N, {error}");
    let (c, error, random) = felt(20_775);
    println!(
        "immovable: c {c} N of {} N; relative error {error}",
        random.friction_n
    );
    assert!(!random.is_movable());
    assert!(c > HELD_N, "{c} N");
}

#[test]
fn a_box_that_is_spun_far_from_the_linear_range_is_felt_where_it_is() {
    // pushed up to 15 cm beside the middle of a face of 36 cm; from zero, and across the seam of the angle
    for (one_way_ms, most_mm, contacts) in [(0, 1.5, 1.1), (250, 4.0, 1.1), (1000, 15.0, 1.2)] {
        let (mut breaks, mut pushes) = (0.0, 0);
        for (angle, seed) in [(0.0, 1), (0.0, 2), (3.1, 1), (3.1, 3)] {
            let mut config = delayed(one_way_ms).seeded(seed);
            config.operator.lateral_max_m = 0.15;
            config.slave.environment.pose = Pose::new(0.0, 0.0, angle);
            let mut turned = Turned::default();
            let name = format!("{one_way_ms} ms, spun from {angle} rad, seed {seed}");
            let felt = felt(&name, &config, |world| turned.look(world));
            println!("    turned by up to {:.2} rad within 2 s", turned.most);
            assert!(turned.most > 1.0, "{} rad", turned.most);
            assert!(felt.peak_n <= 4.0 && felt.step_n <= 1.6, "{felt:?}");
            assert!(felt.pose_rms_mm <= most_mm, "{felt:?}");
            breaks += felt.breaks_per_push * felt.pushes as f64;
            pushes += felt.pushes;
        }
        // of 16 pushes one may break once more, at a second one way three
        assert!(
            breaks <= contacts * pushes as f64,
            "{one_way_ms} ms: {breaks} of {pushes}"
        );
    }
}

/// Forces below this have no direction, N.
const LEAST_N: f64 = 0.5;

#[test]
fn a_hand_that_has_run_into_what_the_tool_does_not_move_is_not_pushed_across_or_on() {
    // worlds in which it went on past a corner of that, and then felt another face than the one that the tool presses on
    for number in [9721, 11_048, 11_259] {
        let random = RandomWorld::new(number);
        let mut world = World::try_new(&random.config).unwrap();
        let (mut directed, mut opposed) = (0, 0);
        world.run(Duration::from_secs(20), |tick| {
            let Some(slave) = &tick.slave else {
                return;
            };
            let has_direction = |f_m: &Vec2| f_m.norm().min(slave.true_force.norm()) > LEAST_N;
            if let Some(f_m) = slave.f_m.filter(has_direction) {
                directed += 1;
                opposed += u32::from(f_m.dot(&slave.true_force) < 0.0);
            }
        });
        println!("world {number}: {opposed} of {directed} ticks");
        assert!(
            directed > 200 && 100 * opposed <= directed,
            "world {number}"
        );
    }
}
