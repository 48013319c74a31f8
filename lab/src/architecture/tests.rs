//! What is known of each architecture from the literature must hold here. Print the tables with `--nocapture`.

use super::*;
use mmt_client::choice::{STIFFNESS_N_PER_M, TDPA_ERROR, tdpa_error};
use mmt_client::either::ChoiceOutcome;
use mmt_client::operator::hand::{Hand, HandConfig};
use mmt_netem::config::LinkConfig;
use mmt_server::model_error::UNKNOWN;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::rng::Substream;
use mmt_shared::time::TICK_S;

const RUN: Duration = Duration::from_secs(20);

fn over(words: &str, k_p: f64, seed: u64) -> WorldConfig {
    let link: LinkConfig = words.parse().unwrap();
    WorldConfig {
        up: link.clone(),
        down: link,
        stiffness_n_per_m: Some(k_p),
        ..WorldConfig::default()
    }
    .seeded(seed)
}

/// Runs of three seeds over one delay.
fn rows(architecture: Architecture, one_way_ms: u64, k_p: f64) -> Vec<DelayRow> {
    let words = format!("delay {one_way_ms}ms");
    (1..=3)
        .map(|seed| run(architecture, &over(&words, k_p, seed), RUN).unwrap())
        .collect()
}

/// The mean over the rows that have the number.
fn mean(rows: &[DelayRow], of: impl Fn(&DelayRow) -> Option<f64>) -> f64 {
    let values: Vec<f64> = rows.iter().filter_map(of).collect();
    values.iter().sum::<f64>() / values.len() as f64
}

fn print(architecture: Architecture, one_way_ms: u64, k_p: f64, rows: &[DelayRow]) {
    let pushes: u64 = rows.iter().map(|row| row.pushes).sum();
    println!(
        "{:18} {k_p:4} N/m {one_way_ms:4} ms {pushes:3} pushes {:6.2} breaks {:5.2} N peak {:6.3} error {:7.1} packets/s \
         {:5.1} kB/s {:7.1} mJ hand {:9.2} mJ network {:6.2} mass",
        architecture.name(),
        mean(rows, |row| row.breaks_per_push),
        mean(rows, |row| row.force_peak_n),
        mean(rows, |row| row.relative_error),
        mean(rows, |row| Some(row.packet_rate_hz)),
        mean(rows, |row| Some(row.wire_bytes_per_s * 1e-3)),
        mean(rows, |row| Some(row.observer_min_j * 1e3)),
        mean(rows, |row| row.network_min_j.map(|j| j * 1e3)),
        mean(rows, |row| row.apparent_mass_ratio),
    );
}

#[test]
fn what_watches_its_energy_makes_none_and_what_does_not_breaks_contact() {
    for baseline in Baseline::ALL {
        let architecture = Architecture::Bilateral(baseline);
        let mut peak_at_zero_n = 0.0;
        for one_way_ms in [0, 1, 2, 5, 10, 14, 20, 50, 100, 250] {
            let rows = rows(architecture, one_way_ms, 1000.0);
            print(architecture, one_way_ms, 1000.0, &rows);
            let breaks = mean(&rows, |row| row.breaks_per_push);
            let peak_n = mean(&rows, |row| row.force_peak_n);
            let made_mj = mean(&rows, |row| row.network_min_j.map(|j| j * 1e3));
            if one_way_ms == 0 {
                peak_at_zero_n = peak_n;
                assert!((breaks - 1.0).abs() < 1e-9, "{baseline:?}");
                let mass = mean(&rows, |row| row.apparent_mass_ratio);
                // a deadband blurs what it holds back; waves add the tool's mass and their own
                let (least, most) = match baseline {
                    Baseline::Waves => (1.2, 1.8),
                    _ if baseline.has_deadband() => (0.7, 1.1),
                    _ => (0.95, 1.05),
                };
                assert!((least..most).contains(&mass), "{baseline:?}: {mass}");
            }
            let watched = baseline.has_passivity_control() || baseline == Baseline::Waves;
            if watched {
                assert!(
                    made_mj > -1.0,
                    "{baseline:?}, {one_way_ms} ms: {made_mj} mJ"
                );
                assert!(
                    one_way_ms > 100 || breaks < 2.0,
                    "{baseline:?}, {one_way_ms} ms"
                );
            } else if one_way_ms >= 20 {
                assert!(breaks > 2.0, "{baseline:?}, {one_way_ms} ms: {breaks}");
                assert!(
                    peak_n > 2.0 * peak_at_zero_n,
                    "{baseline:?}, {one_way_ms} ms"
                );
                assert!(
                    made_mj < -1000.0,
                    "{baseline:?}, {one_way_ms} ms: {made_mj} mJ"
                );
            }
        }
    }
}

/// The least one-way delay of `tried` with more than two breaks per push at position–force.
fn limit_ms(k_p: f64, tried: impl IntoIterator<Item = u64>) -> Option<u64> {
    let architecture = Architecture::Bilateral(Baseline::PositionForce);
    tried.into_iter().find(|one_way_ms| {
        let rows = rows(architecture, *one_way_ms, k_p);
        print(architecture, *one_way_ms, k_p, &rows);
        mean(&rows, |row| row.breaks_per_push) > 2.0
    })
}

#[test]
fn position_force_limit_cycles_beyond_a_delay_that_falls_with_stiffness() {
    let soft = limit_ms(1000.0, [8, 10, 12, 14, 16, 18]);
    let stiff = limit_ms(3000.0, [2, 3, 4, 5, 6, 8, 10]);
    println!(
        "first delay with more than 2 breaks per push: {soft:?} ms at 1000 N/m, {stiff:?} ms at 3000 N/m"
    );
    let (soft, stiff) = (soft.unwrap(), stiff.unwrap());
    assert!((12..=18).contains(&soft), "{soft} ms at 1000 N/m");
    assert!(stiff < soft && stiff > 2, "{stiff} ms at 3000 N/m");
}

#[test]
fn without_delay_position_force_is_direct_coupling() {
    let config = over("delay 0ms", 1000.0, 1);
    let mut world = Bilateral::try_new(&config, Baseline::PositionForce, Picture::Delayed).unwrap();
    let start = world.operator().start();
    let (mut sensed, mut touched) = (Vec2::zeros(), 0);
    for n in 0..8000 {
        // a slow press by up to 3 mm
        let x = 0.0715 * (1.0 - libm::cos(f64::from(n) * 1e-3)) * 0.5;
        let hip = start + Vec2::new(0.25 + x - 0.0685, 0.0) * f64::from(n.min(2000)) / 2000.0;
        let tick = world.step_at(hip, false).unwrap();
        let off = (tick.tool - hip).norm();
        assert!(off <= 1e-6, "tick {n}: the tool is {off} m from the hand");
        if n > 300 {
            let felt = -world.hand_force();
            assert!(
                (felt - sensed).norm() <= 1e-4,
                "what was met a tick ago is felt"
            );
        }
        let noise = tick.f_s.norm() < mmt_shared::metrics::F_MIN_N;
        sensed = if noise { Vec2::zeros() } else { tick.f_s };
        touched += u32::from(tick.in_contact);
    }
    assert!(touched > 500, "in contact for {touched} ticks");
}

#[test]
fn a_run_is_a_function_of_its_configuration_and_of_what_the_operator_sees() {
    let config = over("delay 100ms 5ms loss 5%", 1000.0, 7);
    for architecture in Architecture::ALL {
        let row = || run(architecture, &config, Duration::from_secs(6)).unwrap();
        assert_eq!(row(), row(), "{}", architecture.name());
    }
    let error = |picture| {
        let mut world = Bilateral::try_new(&config, Baseline::Waves, picture).unwrap();
        world.run(Duration::from_secs(6));
        world.force().relative_error
    };
    assert_ne!(error(Picture::Delayed), error(Picture::Model));
}

#[test]
fn mediated_architectures_give_the_same_columns() {
    for architecture in &Architecture::ALL[Baseline::ALL.len()..] {
        for one_way_ms in [0, 50, 250] {
            let rows = rows(*architecture, one_way_ms, 1000.0);
            print(*architecture, one_way_ms, 1000.0, &rows);
            for row in rows {
                assert!(row.pose_rms_mm.unwrap() < 50.0);
                assert!(row.packet_rate_hz < 100.0 && row.wire_rate_hz > row.packet_rate_hz);
                let replay = *architecture == Architecture::Mediated(PoseCorrection::Replay);
                assert!(!replay || row.breaks_per_push.unwrap() < 1.5);
                assert!(!replay || row.apparent_mass_ratio.unwrap() < 1.5);
            }
        }
    }
}

/// A hand of random impedance that wants to be at random places in and around the box; what the network made, J.
fn least_with_random_hand(baseline: Baseline, words: &str, noise_n: f64, seed: u64) -> f64 {
    let mut stream = Substream::new(seed, "test/hand", 0);
    let hand = HandConfig {
        mass_kg: stream.uniform_in(0.3, 1.0),
        stiffness_n_per_m: stream.uniform_in(100.0, 600.0),
        damping_ns_per_m: stream.uniform_in(5.0, 30.0),
        tremor_hz: stream.uniform_in(6.0, 11.0),
        tremor_m: stream.uniform_in(0.0, 5e-4),
    };
    let mut config = over(words, 1000.0, seed);
    config.slave.sensing.force_noise_n = noise_n;
    let mut world = Bilateral::try_new(&config, baseline, Picture::Delayed).unwrap();
    let mut wish = world.operator().start();
    let mut hand = Hand::new(hand, seed, wish);
    let mut velocity = Vec2::zeros();
    for tick in 0..10_000 {
        if tick % 400 == 0 {
            let pose = world.slave().environment().pose();
            let inside = Vec2::new(stream.uniform_in(-0.30, 0.10), stream.uniform_in(-0.1, 0.1));
            let there = pose.point_to_world(inside) - wish;
            velocity = there * (stream.uniform_in(0.0, 0.35) / there.norm().max(1e-3));
        }
        let hip = hand.step(wish, velocity, world.hand_force());
        wish += velocity * TICK_S;
        world.step_at(hip, true);
    }
    let outcome = world.outcome();
    let worked_j = outcome.tool_port.energy_j();
    assert!(worked_j > 0.01, "nothing was touched: {worked_j} J");
    outcome.network_min_j
}

/// The least over some hands, mJ.
fn least_mj(baseline: Baseline, words: &str, noise_n: f64) -> f64 {
    let least_j = (1..=3)
        .map(|seed| least_with_random_hand(baseline, words, noise_n, seed))
        .fold(0.0, f64::min);
    println!(
        "{:15} {words:26} noise {noise_n} N: {:9.3} mJ",
        baseline.name(),
        least_j * 1e3
    );
    least_j * 1e3
}

#[test]
fn tdpa_and_waves_make_no_energy_at_any_delay_in_any_hand() {
    let constant = [0, 1, 5, 20, 50, 150, 500].map(|ms| format!("delay {ms}ms"));
    let bad = ["delay 50ms 10ms loss 20%".to_owned()];
    for words in constant.iter().chain(&bad) {
        for baseline in [Baseline::Tdpa, Baseline::TdpaDeadband, Baseline::Waves] {
            for noise_n in [0.0, 0.01] {
                let made_mj = least_mj(baseline, words, noise_n);
                assert!(made_mj > -1.0, "{baseline:?} over {words}: {made_mj} mJ");
            }
        }
    }
    let made_mj = least_mj(Baseline::PositionForce, "delay 50ms", 0.0);
    assert!(
        made_mj < -1000.0,
        "position-force has no such law: {made_mj} mJ"
    );
}

#[test]
fn the_first_push_of_an_unknown_object_is_as_wrong_as_is_said_before_it() {
    let first_push = |one_way_ms, k_p| {
        let first = |seed| {
            let config = over(&format!("delay {one_way_ms}ms"), k_p, seed);
            let mut world = World::try_new(&config).unwrap();
            while world.operator().pushes_completed() == Some(0) {
                world.step();
            }
            world.force().relative_error
        };
        let first = crate::statistics::median((1..=8).filter_map(first)).unwrap();
        println!("{k_p} N/m, {one_way_ms} ms: relative error of the first push {first:.3}");
        first
    };
    for one_way_ms in [0, 10, 20] {
        let first = first_push(one_way_ms, 1000.0);
        assert!((first - UNKNOWN).abs() < 0.02, "{one_way_ms} ms: {first}");
        // a stiff device feels more of what the model does not know; that is not said
        assert!(first_push(one_way_ms, 3000.0) > UNKNOWN);
    }
}

#[test]
fn a_path_that_becomes_longer_and_shorter_again_is_followed_without_a_jolt() {
    for seed in 1..=3 {
        let config = over("delay 2ms", 1000.0, seed);
        let mut world = World::try_new(&auto(config)).unwrap();
        let mut felt = Vec::new();
        for (words, seconds) in [
            ("delay 2ms", 10),
            ("delay 100ms 5ms loss 5%", 20),
            ("delay 2ms", 10),
        ] {
            let link: LinkConfig = words.parse().unwrap();
            world.rewire(&link, seed).unwrap();
            let tdpa_before = choice(&world).tool_ticks;
            for _ in 0..seconds * 1000 {
                world.step();
            }
            felt.push((choice(&world).tool_ticks - tdpa_before) as f64 / f64::from(seconds * 1000));
        }
        let (outcome, pushes) = (
            world.outcome(),
            world.operator().pushes_completed().unwrap(),
        );
        let breaks = outcome.breaks.per_push(pushes).unwrap();
        let (peak_n, step_n) = (
            outcome.on_hand.largest_n().unwrap(),
            choice(&world).fade_step_n,
        );
        let least_mj = world.master().port().least_j() * 1e3;
        println!(
            "seed {seed}: TDPA {felt:.2?} of the time, {pushes} pushes, {breaks:.2} breaks a push, peak {peak_n:.2} N, \
             steps to {step_n:.2} N in a fade, hand {least_mj:.2} mJ, relative error {:.3}",
            world.force().relative_error.unwrap()
        );
        assert!(felt[0] > 0.2 && felt[1] < 0.5, "{felt:?}");
        assert!(breaks < 2.0 && peak_n < 5.0 && step_n <= 0.2);
        assert!(least_mj > -1.0);
    }
}

fn auto(config: WorldConfig) -> WorldConfig {
    WorldConfig {
        architecture: wire::Architecture::Auto,
        ..config
    }
}

fn choice(world: &World) -> ChoiceOutcome {
    *world.master().either().unwrap().outcome()
}

/// What the choice did over three seeds of one delay: share of the time with TDPA, switches, largest step in a fade.
fn chosen(one_way_ms: u64) -> (f64, u32, f64) {
    let (mut share, mut switches, mut step_n) = (0.0, 0, 0.0_f64);
    for seed in 1..=3 {
        let config = over(&format!("delay {one_way_ms}ms"), 1000.0, seed);
        let mut world = World::try_new(&auto(config)).unwrap();
        (0..20_000).for_each(|_| {
            world.step();
        });
        let outcome = choice(&world);
        share += outcome.tool_ticks as f64 / outcome.ticks as f64 / 3.0;
        switches += world.master().either().unwrap().choice().switches();
        step_n = step_n.max(outcome.fade_step_n);
    }
    (share, switches, step_n)
}

#[test]
fn the_choice_is_as_good_as_the_better_of_the_two_and_crosses_where_they_cross() {
    for one_way_ms in [0, 2, 5, 7, 10, 14, 20, 50, 250] {
        let error = |architecture| {
            let rows = rows(architecture, one_way_ms, 1000.0);
            print(architecture, one_way_ms, 1000.0, &rows);
            (mean(&rows, |row| row.relative_error), rows)
        };
        let (tdpa, _) = error(Architecture::Bilateral(Baseline::Tdpa));
        let (mmt, _) = error(Architecture::Mediated(PoseCorrection::Replay));
        let (auto, rows) = error(Architecture::Auto);
        let (share, switches, step_n) = chosen(one_way_ms);
        println!(
            "    TDPA {share:.2} of the time, {switches} switches in 3 runs, steps to {step_n:.2} N in a fade"
        );
        assert!(
            (tdpa < mmt) == (one_way_ms < 8),
            "the errors cross at {one_way_ms} ms"
        );
        assert!(
            auto <= 1.1 * tdpa.min(mmt) + 0.02,
            "{one_way_ms} ms: {auto}"
        );
        // a first touch that falls into a fade is a step of up to 0.7 N, with a fade or without
        assert!(switches <= 12 && step_n <= 0.7, "{switches}, {step_n} N");
        for row in rows {
            assert!(row.breaks_per_push.unwrap() < 2.0, "{row:?}");
            assert!(
                row.force_peak_n.unwrap() < 5.0 && row.observer_min_j > -1e-3,
                "{row:?}"
            );
        }
    }
    let (near, far) = (chosen(0), chosen(50));
    assert!(near.0 > 0.2 && far.0 == 0.0, "{near:?} {far:?}");
}

#[test]
fn with_a_stiff_device_the_choice_is_nearly_the_better_one_too_and_leaves_tdpa_before_it_breaks_contact()
 {
    for one_way_ms in [0, 2, 5, 7, 10, 14] {
        let of = |architecture| {
            let rows = rows(architecture, one_way_ms, 3000.0);
            print(architecture, one_way_ms, 3000.0, &rows);
            rows
        };
        let tdpa = of(Architecture::Bilateral(Baseline::Tdpa));
        let mmt = of(Architecture::Mediated(PoseCorrection::Replay));
        let auto = of(Architecture::Auto);
        let breaks = |rows: &[DelayRow]| mean(rows, |row| row.breaks_per_push);
        let error = |rows: &[DelayRow]| mean(rows, |row| row.relative_error);
        assert!((breaks(&tdpa) > 2.0) == (one_way_ms > 7), "{one_way_ms} ms");
        assert!(breaks(&auto) < 2.5, "{one_way_ms} ms: {}", breaks(&auto));
        assert!(mean(&auto, |row| row.force_peak_n) < 5.0, "{one_way_ms} ms");
        let counted_s = 2e-3 * one_way_ms as f64 * f64::sqrt(3000.0 / STIFFNESS_N_PER_M);
        let foretold = tdpa_error(counted_s);
        println!("    TDPA's error foretold: {foretold:.3}");
        assert!(one_way_ms > 7 || (foretold - error(&tdpa)).abs() < 0.1 * error(&tdpa));
        let better = error(&tdpa).min(error(&mmt));
        assert!(
            error(&auto) <= 1.1 * better + 0.035,
            "{one_way_ms} ms: {}, {better} alone",
            error(&auto)
        );
    }
}

#[test]
fn what_the_choice_expects_of_tdpa_is_the_median_of_runs_of_it() {
    for (round_trip_ms, expected) in TDPA_ERROR {
        let words = format!("delay {}ms", round_trip_ms / 2.0);
        let error = |seed| {
            let config = over(&words, STIFFNESS_N_PER_M, seed);
            let row = run(Architecture::Bilateral(Baseline::Tdpa), &config, RUN);
            row.unwrap().relative_error
        };
        let median = crate::statistics::median((1..=9).filter_map(error)).unwrap();
        println!("    ({round_trip_ms:.1}, {median:.3}),");
        // what another noise or another compiler may change is less
        assert!(
            (median - expected).abs() <= 0.01 * expected + 0.0005,
            "{round_trip_ms} ms: {median}, {expected} expected"
        );
    }
}

#[test]
fn a_path_too_narrow_for_the_tools_force_is_noticed_and_left_to_the_model() {
    // the stream takes 1 Mbit/s each way; the queue it makes is a round trip that the hand would feel
    for rate in ["256kbit", "600kbit"] {
        for seed in 1..=2 {
            let words = format!("delay 2ms rate {rate} 28 queue 200ms");
            let mut world = World::try_new(&auto(over(&words, 1000.0, seed))).unwrap();
            world.run(Duration::from_secs(60), |_| ());
            let (outcome, chosen) = (world.outcome(), choice(&world));
            let switches = world.master().either().unwrap().choice().switches();
            let share = chosen.tool_ticks as f64 / chosen.ticks as f64;
            let pushes = world.operator().pushes_completed().unwrap();
            let breaks = outcome.breaks.per_push(pushes).unwrap();
            let peak_n = outcome.on_hand.largest_n().unwrap();
            println!(
                "{rate}, seed {seed}: TDPA {share:.3} of the time, {switches} switches, {breaks:.2} breaks a push, peak {peak_n:.2} N"
            );
            assert!(switches <= 4 && share < 0.05, "{switches} {share}");
            assert!(breaks < 2.0 && peak_n < 5.0 && outcome.observer_min_j > -1e-3);
        }
    }
}
