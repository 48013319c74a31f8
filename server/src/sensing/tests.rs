//! Promises of the sensors.

use super::*;
use mmt_shared::stats::values::rms;
use mmt_shared::time::TICK;

const TOOL: Vec2 = Vec2::new(0.1, -0.2);
const FORCE: Vec2 = Vec2::new(3.0, -1.0);

fn pose() -> Pose {
    Pose::new(0.5, 0.25, 1.0)
}

fn run(config: SensingConfig, ticks: u64) -> (Sensing, Vec<(Time, Sensed)>) {
    let mut sensing = Sensing::try_new(config, 1).unwrap();
    let sensed = (0..ticks)
        .map(|tick| {
            let now = Time::from_millis(1000 + tick);
            (now, sensing.sense(now, TOOL, FORCE, &pose()))
        })
        .collect();
    (sensing, sensed)
}

fn images(sensed: &[(Time, Sensed)]) -> Vec<(Time, VisionSample)> {
    let seen = |(now, s): &(Time, Sensed)| s.vision.map(|image| (*now, image));
    sensed.iter().filter_map(seen).collect()
}

#[test]
fn noise_has_the_configured_size_on_every_axis() {
    let (_, sensed) = run(SensingConfig::default(), 20_000);
    // four standard errors of an r.m.s. of 20 000: 2 %
    let near = |got: Option<f64>, want: f64| {
        assert!((got.unwrap() / want - 1.0).abs() < 0.02, "{got:?} {want}");
    };
    near(rms(sensed.iter().map(|(_, s)| s.tool.x - TOOL.x)), 10e-6);
    near(rms(sensed.iter().map(|(_, s)| s.tool.y - TOOL.y)), 10e-6);
    near(rms(sensed.iter().map(|(_, s)| s.force.x - FORCE.x)), 10e-3);
    near(rms(sensed.iter().map(|(_, s)| s.force.y - FORCE.y)), 10e-3);
    let images = images(&sensed);
    let within = |got: Option<f64>, want: f64| {
        assert!((got.unwrap() / want - 1.0).abs() < 0.12, "{got:?} {want}");
    };
    within(
        rms(images.iter().map(|(_, i)| i.pose.position.x - 0.5)),
        1e-3,
    );
    within(rms(images.iter().map(|(_, i)| i.pose.angle - 1.0)), 5e-3);
}

/// The measured forces of sensors that are ideal but for the force, with a seed.
fn forces(change: fn(&mut SensingConfig), seed: u64, ticks: u64) -> Vec<Vec2> {
    let mut config = SensingConfig::ideal();
    change(&mut config);
    let mut sensing = Sensing::try_new(config, seed).unwrap();
    let at = |tick| Time::from_millis(1000 + tick);
    (0..ticks)
        .map(|tick| sensing.sense(at(tick), TOOL, FORCE, &pose()).force)
        .collect()
}

#[test]
fn a_bias_has_its_size_and_a_direction_of_the_seed_and_drifts_in_another() {
    let bias = |seed| forces(|config| config.force_bias_n = 0.2, seed, 2)[1] - FORCE;
    assert!((bias(1).norm() - 0.2).abs() < 1e-12 && (bias(1) - bias(2)).norm() > 0.01);
    let drifted = forces(|config| config.force_drift_n_per_s = 0.01, 1, 10_001);
    assert_eq!(drifted[0], FORCE);
    let way = drifted[10_000] - FORCE;
    assert!((way.norm() - 0.1).abs() < 1e-9, "{way}");
    assert!(
        (way / 0.1 - bias(1) / 0.2).norm() > 0.01,
        "its own direction"
    );
}

#[test]
fn the_force_lags_by_its_time_constant_and_has_its_gain() {
    let lagging = forces(|config| config.force_lag_ms = 5.0, 1, 50);
    // after five ticks 1 − 1/e of a step
    let share = lagging[4].norm() / FORCE.norm();
    assert!((share - (1.0 - libm::exp(-1.0))).abs() < 1e-12, "{share}");
    assert!((lagging[49] - FORCE).norm() < 2e-4 * FORCE.norm());
    assert_eq!(
        forces(|config| config.force_gain = 1.1, 1, 1)[0],
        FORCE * 1.1
    );
}

#[test]
fn ideal_sensors_tell_the_truth_to_the_bit() {
    let (_, sensed) = run(SensingConfig::ideal(), 100);
    for (_, s) in sensed {
        assert_eq!((s.tool, s.force, s.vision), (TOOL, FORCE, None));
    }
}

#[test]
fn images_before_the_session_show_each_face_with_their_error_or_no_size() {
    let truth = vec![BoxFootprint::square(0.3); 200];
    let vision = |rate_hz, size_noise_m| VisionConfig {
        rate_hz,
        size_noise_m,
        ..VisionConfig::default()
    };
    let seen = |vision| sizes_seen(&vision, 1, truth.clone());
    assert!(seen(vision(30.0, None)).is_empty());
    assert!(seen(vision(0.0, Some(1e-3))).is_empty(), "no images");
    assert_eq!(seen(vision(30.0, Some(0.0))), truth);
    let errors: Vec<f64> = seen(vision(30.0, Some(1e-3)))
        .iter()
        .flat_map(|footprint| Face::ALL.map(|face| footprint.offset(face) - 0.15))
        .collect();
    let rms = rms(errors.iter().copied()).unwrap();
    assert!((rms - 1e-3).abs() < 1e-4, "{rms}");
    let apart = errors.iter().zip(errors.iter().skip(1));
    assert!(apart.clone().all(|(one, next)| one != next));
}

#[test]
fn vision_delivers_30_images_a_second_each_once_after_its_latency() {
    let (sensing, sensed) = run(SensingConfig::default(), 10_001);
    let images = images(&sensed);
    assert_eq!(images.len(), 300);
    for (delivered, image) in &images {
        let age = delivered.signed_since(image.taken);
        assert_eq!(age, 30_000_000, "taken at {:?}", image.taken);
    }
    assert!(images.windows(2).all(|w| w[0].1.taken < w[1].1.taken));
    assert_eq!(sensing.images_dropped(), 0);
}

#[test]
fn the_noise_of_one_sensor_does_not_depend_on_the_settings_of_another() {
    let silent = SensingConfig {
        position_noise_m: 0.0,
        ..SensingConfig::ideal()
    };
    let only_force = SensingConfig {
        force_noise_n: 10e-3,
        ..silent
    };
    let (_, all) = run(SensingConfig::default(), 500);
    let (_, one) = run(only_force, 500);
    assert!(all.iter().zip(&one).all(|(a, b)| a.1.force == b.1.force));
    assert!(all.iter().zip(&one).all(|(a, b)| a.1.tool != b.1.tool));
}

#[test]
fn a_gap_in_time_yields_the_newest_image_and_counts_the_rest() {
    let config = SensingConfig {
        vision: VisionConfig {
            rate_hz: 100.0,
            latency_ms: 50.0,
            ..VisionConfig::default()
        },
        ..SensingConfig::default()
    };
    let (mut sensing, _) = run(config, 45);
    let late = Time::from_millis(60_000);
    let seen = sensing.sense(late, TOOL, FORCE, &pose()).vision.unwrap();
    assert_eq!(seen.taken, Time::from_millis(1040));
    assert_eq!(sensing.images_dropped(), 4);
    // and then one image a period again, not a burst
    let next = |ms: i64| late.offset_by(ms * 1_000_000);
    let burst = (1..=49).filter(|&ms| {
        let sensed = sensing.sense(next(ms), TOOL, FORCE, &pose());
        sensed.vision.is_some()
    });
    assert_eq!(burst.count(), 0);
    assert!(sensing.on_their_way.len() <= 6);
    // each image is given to a tick, dropped under its name or on its way
    let accounted = 1 + sensing.images_dropped() + sensing.on_their_way.len() as u64;
    assert_eq!(sensing.images_taken, accounted);
}

#[test]
fn after_the_clock_was_set_back_images_come_again_and_none_of_before() {
    // one image is on its way
    let (mut sensing, _) = run(SensingConfig::default(), 1005);
    let back = Time::from_millis(500);
    let dropped = sensing.images_dropped();
    let mut seen = Vec::new();
    for tick in 0..100 {
        let now = back + TICK * tick;
        let image = sensing.sense(now, TOOL, FORCE, &pose()).vision;
        seen.extend(image.map(|image| image.taken));
    }
    assert_eq!(seen.len(), 3, "{seen:?}");
    assert!(
        seen.iter()
            .all(|taken| *taken >= back && *taken < back + TICK * 100)
    );
    assert_eq!(sensing.images_dropped(), dropped + 1);
}

#[test]
fn sensors_break_as_they_are_bidden_and_are_whole_again_after() {
    let mut sensing = Sensing::try_new(SensingConfig::ideal(), 1).unwrap();
    let mut measured = |ms, faults, newtons| {
        sensing.set_faults(SensorFaults {
            force: faults,
            no_images: true,
        });
        let force = Vec2::new(newtons, 0.0);
        sensing
            .sense(Time::from_millis(ms), TOOL, force, &pose())
            .force
            .x
    };
    assert_eq!(measured(1, None, 2.0), 2.0);
    assert_eq!(measured(2, Some(ForceFault::Frozen), 5.0), 2.0);
    let off = ForceFault::Off(Vec2::new(-3.0, 0.0));
    assert_eq!(measured(3, Some(off), 5.0), 2.0);
    assert_eq!(measured(4, None, 5.0), 5.0);
    // no camera meanwhile, and then one image at once
    let (mut blind, mut seen) = (SensorFaults::default(), Vec::new());
    let mut sensing = Sensing::try_new(SensingConfig::default(), 1).unwrap();
    for ms in 0..1000 {
        blind.no_images = (200..800).contains(&ms);
        sensing.set_faults(blind);
        let image = sensing
            .sense(Time::from_millis(ms), TOOL, FORCE, &pose())
            .vision;
        seen.extend(image.map(|image| image.taken));
    }
    let gap = |from, to| Time::from_millis(from)..Time::from_millis(to);
    assert!(
        !seen.iter().any(|taken| gap(200, 800).contains(taken)),
        "{seen:?}"
    );
    assert!(seen.contains(&Time::from_millis(800)), "{seen:?}");
    assert_eq!(sensing.images_dropped(), 0);
}

#[test]
fn wrong_settings_are_named() {
    let config = SensingConfig {
        force_noise_n: f64::NAN,
        ..SensingConfig::default()
    };
    let error = Sensing::try_new(config, 1).unwrap_err();
    assert!(error.to_string().contains("force noise NaN"), "{error}");
    let mut config = SensingConfig::default();
    config.vision.latency_ms = 5_000.0;
    let error = Sensing::try_new(config, 1).unwrap_err();
    assert!(error.to_string().contains("62 images"), "{error}");
    assert!(Sensing::try_new(SensingConfig::ideal(), 1).is_ok());
}
