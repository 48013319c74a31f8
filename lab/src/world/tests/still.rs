//! An object that does not move: nobody can know before a round trip, and the hand has gone on by then.

use mmt_client::device::DeviceProfile;
use mmt_client::device::link::DeviceLinkConfig;
use mmt_server::environment::Wall;

use super::*;
use crate::worlds::RandomWorld;

/// Delay of the play-out, ms: part of the round trip.
const PLAYOUT_MS: u64 = 16;
/// The fastest push of the scripted operator, m/s.
const SPEED_M_PER_S: f64 = 0.22;
/// What is measured of a contact, s.
const WATCHED_MS: u64 = 3000;

/// How far the face that is felt lies inside of the cube that does not move, m; below zero: in front of it.
fn phantom(at: Vec2) -> f64 {
    let half = 0.18;
    (half - at.x.abs()).min(half - at.y.abs())
}

/// What was felt of it, from the tool's first touch on.
#[derive(Debug, Default)]
struct Felt {
    /// The most at all, and later than a round trip and 0.1 s, and than two of them and 0.3 s, m.
    most_m: f64,
    after_one_m: f64,
    after_two_m: f64,
    /// Ticks in which the hand was pushed into it.
    inward: u32,
    injected_j: f64,
    observer_min_j: f64,
}

impl Felt {
    /// Checks that the hand went no deeper than it can go in a round trip and 10 mm, and was neither pushed into the object nor given
    /// energy.
    fn is_harmless(&self, round_trip_ms: u64) {
        let ahead_m = SPEED_M_PER_S * round_trip_ms as f64 * 1e-3;
        assert!(self.most_m <= 0.010 + ahead_m, "{self:?}");
        assert_eq!(self.inward, 0, "{self:?}");
        assert!(
            self.injected_j <= 1e-9 && self.observer_min_j >= -1e-3,
            "{self:?}"
        );
    }
}

fn felt(config: &WorldConfig, round_trip_ms: u64) -> Felt {
    let mut world = World::try_new(config).unwrap();
    let (mut felt, mut since_ms) = (Felt::default(), None);
    while since_ms < Some(WATCHED_MS) && world.now < Time::from_millis(20_000) {
        let tick = world.step();
        let touched = tick.slave.is_some_and(|slave| slave.in_contact);
        since_ms = since_ms.map(|ms| ms + 1).or(touched.then_some(0));
        let (Some(ms), Some(touch)) = (since_ms, tick.master.rendered.touch) else {
            continue;
        };
        let depth = phantom(touch.proxy);
        felt.most_m = felt.most_m.max(depth);
        if ms >= round_trip_ms + 100 {
            felt.after_one_m = felt.after_one_m.max(depth);
        }
        if ms >= 2 * round_trip_ms + 300 {
            felt.after_two_m = felt.after_two_m.max(depth);
        }
        felt.inward += u32::from(tick.master.hand_force.dot(&touch.inward) > 1e-9);
    }
    assert!(since_ms.is_some(), "it was touched");
    let outcome = world.outcome();
    (felt.injected_j, felt.observer_min_j) = (outcome.energy_injected_j, outcome.observer_min_j);
    felt
}

#[test]
fn what_does_not_move_is_felt_to_give_way_for_a_round_trip_and_then_where_it_is() {
    for one_way_ms in [0, 25, 50, 125, 250, 500] {
        for (friction_n, k_p) in [
            (18.0, 1000.0),
            (160.0, 1000.0),
            (40.0, 300.0),
            (40.0, 500.0),
            (40.0, 3000.0),
        ] {
            for seed in 11..=13 {
                let mut config = over(&format!("delay {one_way_ms}ms"), seed);
                let environment = &mut config.slave.environment;
                environment.mass_kg = 5.0;
                environment.friction_coefficient = friction_n / (5.0 * 9.81);
                config.stiffness_n_per_m = Some(k_p);
                let round_trip_ms = 2 * one_way_ms + PLAYOUT_MS;
                let felt = felt(&config, round_trip_ms);
                println!(
                    "{one_way_ms:4} ms, {friction_n:5} N, {k_p:4} N/m, seed {seed}: {felt:.4?}"
                );
                felt.is_harmless(round_trip_ms);
                assert!(one_way_ms > 250 || felt.most_m <= 0.1, "{felt:?}");
                assert!(felt.after_one_m <= 0.010, "{felt:?}");
                assert!(felt.after_two_m <= 0.005, "{felt:?}");
            }
        }
    }
}

#[test]
fn a_light_box_that_a_wall_holds_is_felt_where_it_is_as_well() {
    for one_way_ms in [0, 25, 50, 125, 250] {
        for seed in 11..=13 {
            let mut config = over(&format!("delay {one_way_ms}ms"), seed);
            config.slave.environment.wall = Some(Wall {
                distance_m: 0.18,
                angle_rad: 0.0,
            });
            let round_trip_ms = 2 * one_way_ms + PLAYOUT_MS;
            let felt = felt(&config, round_trip_ms);
            println!("{one_way_ms:4} ms, a wall, seed {seed}: {felt:.4?}");
            felt.is_harmless(round_trip_ms);
            assert!(felt.most_m <= 0.1, "{felt:?}");
            assert!(
                felt.after_one_m <= 0.010 && felt.after_two_m <= 0.005,
                "{felt:?}"
            );
        }
    }
}

/// An object of 3 kg that starts to move at `heavy_n` (N) is pushed by a hand and a device that can, `strong_n` (N), with a tool that
/// presses with `tool_n` (N) at the most: the relative error of the force is at most `error_most`.
fn heavy([heavy_n, strong_n, tool_n]: [f64; 3], error_most: f64) {
    for one_way_ms in [0, 50, 125] {
        for seed in 21..=23 {
            let mut config = over(&format!("delay {one_way_ms}ms"), seed);
            let environment = &mut config.slave.environment;
            environment.mass_kg = 3.0;
            environment.friction_coefficient = heavy_n / (3.0 * 9.81);
            config.operator.press_max_n = strong_n;
            config.slave.tool_force_max_n = tool_n;
            config.slave.tool_energy.hand_force_max_n = strong_n;
            let device = DeviceLinkConfig {
                force_max_n: strong_n,
                stiffness_n_per_m: 1000.0,
                ..DeviceLinkConfig::default()
            };
            let device = DeviceProfile::plugged_in(&device).unwrap();
            let mut world = World::at_device(&config, device).unwrap();
            let mut last = world.slave().environment().pose().position;
            let mut way_m = 0.0;
            world.run(Duration::from_secs(30), |tick| {
                if let Some(slave) = &tick.slave {
                    way_m += (slave.truth.position - last).norm();
                    last = slave.truth.position;
                }
            });
            let (outcome, at) = (world.outcome(), (heavy_n, one_way_ms, seed));
            let error = relative_error(&world);
            let pose_m = outcome.pose.position_max_m().unwrap();
            let c = world.slave().estimate().c;
            println!("{at:?}: over {way_m:.2} m, error {error:.4}, pose {pose_m:.4} m, c {c:.2} N");
            assert!(way_m > 1.0, "{at:?}: pushed over {way_m} m");
            assert_eq!(world.slave().tool_energy().held_ticks(), 0, "{at:?}");
            assert!(error <= error_most, "{at:?}: {error}");
            let round_trip_s = (2 * one_way_ms + PLAYOUT_MS) as f64 * 1e-3;
            assert!(pose_m <= 0.010 + 0.1 * round_trip_s, "{at:?}: {pose_m} m");
            assert!((c - heavy_n).abs() < 0.01 * heavy_n, "{at:?}: {c} N");
            assert!(outcome.energy_injected_j <= 1e-9, "{at:?}");
        }
    }
}

#[test]
fn what_starts_to_move_at_12_n_is_pushed_by_a_hand_and_a_device_that_can() {
    heavy([12.0, 16.0, 15.0], 0.15);
}

#[test]
fn what_starts_to_move_at_17_n_is_pushed_by_a_tool_that_can() {
    // where the replay pushes with 15 N the error is 0.19
    heavy([17.0, 20.0, 30.0], 0.16);
}

#[test]
fn what_the_tool_does_not_move_is_held_although_its_contact_gave_way() {
    // as long as it did, the object seemed to slide under nearly all that the tool may press with
    let random = RandomWorld::new(11_048);
    let mut world = World::try_new(&random.config).unwrap();
    world.run(Duration::from_secs(20), |_| {});
    let rate_hz = world.outcome().updates.rate_hz();
    println!("{rate_hz:?} updates/s");
    assert!(rate_hz.is_some_and(|rate_hz| rate_hz < 8.0));
}
