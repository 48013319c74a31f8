//! What is known of each architecture from the literature must hold here.

use super::*;
use mmt_client::operator::hand::{Hand, HandConfig};
use mmt_netem::config::LinkConfig;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::rng::Substream;
use mmt_shared::stats::values;
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

/// A world whose architecture nobody tunes.
fn plain(
    config: &WorldConfig,
    baseline: Baseline,
    visual_feedback: VisualFeedback,
) -> Result<Bilateral, WorldError> {
    Bilateral::try_new(config, (baseline, &Tuning::default()), visual_feedback)
}

/// Runs of three seeds over one delay.
fn rows(architecture: ComparedArchitecture, one_way_ms: u64, k_p: f64) -> Vec<DelayRow> {
    let words = format!("delay {one_way_ms}ms");
    (1..=3)
        .map(|seed| run(architecture, &over(&words, k_p, seed), RUN).unwrap())
        .collect()
}

/// The mean over the rows that have the number.
fn mean(rows: &[DelayRow], of: impl Fn(&DelayRow) -> Option<f64>) -> f64 {
    values::mean(rows.iter().filter_map(of)).unwrap_or(f64::NAN)
}

fn print(architecture: ComparedArchitecture, one_way_ms: u64, k_p: f64, rows: &[DelayRow]) {
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
        let architecture = ComparedArchitecture::Bilateral(baseline);
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
            let watched = matches!(
                baseline,
                Baseline::Tdpa | Baseline::TdpaDeadband | Baseline::Waves
            );
            if watched {
                assert!(
                    made_mj > -1.0,
                    "{baseline:?}, {one_way_ms} ms: {made_mj} mJ"
                );
                assert!(
                    one_way_ms > 100 || breaks < 2.0,
                    "{baseline:?}, {one_way_ms} ms"
                );
            } else if baseline == Baseline::DampedPositionForce {
                // damping carries it further, and the hand pays what the network makes
                let is_usable = breaks < 2.0;
                assert_eq!(is_usable, one_way_ms <= 20, "{one_way_ms} ms: {breaks}");
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
    let architecture = ComparedArchitecture::Bilateral(Baseline::PositionForce);
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
    let mut world = plain(&config, Baseline::PositionForce, VisualFeedback::Delayed).unwrap();
    let start = world.operator.start();
    let (mut sensed, mut touched) = (Vec2::zeros(), 0);
    for n in 0..8000 {
        // a slow press by up to 3 mm
        let x = 0.0715 * (1.0 - libm::cos(f64::from(n) * 1e-3)) * 0.5;
        let share = f64::from(n.min(2000)) / 2000.0;
        let gently = share * share * (3.0 - 2.0 * share);
        let hip = start + Vec2::new(0.25 + x - 0.0685, 0.0) * gently;
        let tick = world.step_at(hip, false).unwrap();
        let off = (tick.tool - hip).norm();
        assert!(off <= 1e-6, "tick {n}: the tool is {off} m from the hand");
        if n > 300 {
            let felt = -world.hand_force;
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
    for architecture in ComparedArchitecture::ALL {
        let row = || run(architecture, &config, Duration::from_secs(6)).unwrap();
        assert_eq!(row(), row(), "{}", architecture.name());
    }
    let error = |visual_feedback| {
        let mut world = plain(&config, Baseline::Waves, visual_feedback).unwrap();
        world.run(Duration::from_secs(6));
        world.force().relative_error
    };
    assert_ne!(error(VisualFeedback::Delayed), error(VisualFeedback::Model));
}

#[test]
fn mediated_architectures_give_the_same_columns() {
    for architecture in &ComparedArchitecture::ALL[Baseline::ALL.len()..] {
        for one_way_ms in [0, 50, 250] {
            let rows = rows(*architecture, one_way_ms, 1000.0);
            print(*architecture, one_way_ms, 1000.0, &rows);
            for row in rows {
                assert!(row.pose_rms_mm.unwrap() < 50.0);
                assert!(row.packet_rate_hz < 100.0 && row.wire_rate_hz > row.packet_rate_hz);
                let replay =
                    *architecture == ComparedArchitecture::Mediated(PoseCorrection::Replay);
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
    let mut world = plain(&config, baseline, VisualFeedback::Delayed).unwrap();
    let mut wish = world.operator.start();
    let mut hand = Hand::new(hand, seed, wish);
    let mut velocity = Vec2::zeros();
    for tick in 0..10_000 {
        if tick % 400 == 0 {
            let pose = world.slave.environment().pose();
            let inside = Vec2::new(stream.uniform_in(-0.30, 0.10), stream.uniform_in(-0.1, 0.1));
            let there = pose.point_to_world(inside) - wish;
            velocity = there * (stream.uniform_in(0.0, 0.35) / there.norm().max(1e-3));
        }
        let hip = hand.step(wish, velocity, world.hand_force);
        wish += velocity * TICK_S;
        world.step_at(hip, true);
    }
    let outcome = &world.outcome;
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
fn tdpa_and_the_model_cross_at_a_short_delay_and_a_stiff_device_breaks_contact_with_tdpa() {
    for (k_p, delays_ms) in [(1000.0, [0, 5, 10, 20]), (3000.0, [0, 3, 7, 10])] {
        for one_way_ms in delays_ms {
            let of = |architecture| {
                let rows = rows(architecture, one_way_ms, k_p);
                print(architecture, one_way_ms, k_p, &rows);
                rows
            };
            let tdpa = of(ComparedArchitecture::Bilateral(Baseline::Tdpa));
            let mmt = of(ComparedArchitecture::Mediated(PoseCorrection::Replay));
            let error = |rows: &[DelayRow]| mean(rows, |row| row.relative_error);
            let crosses_ms = if k_p > 1000.0 { 5 } else { 8 };
            assert_eq!(
                error(&tdpa) < error(&mmt),
                one_way_ms < crosses_ms,
                "{k_p} N/m, {one_way_ms} ms"
            );
            let breaks = mean(&tdpa, |row| row.breaks_per_push);
            assert_eq!(breaks > 2.0, k_p > 1000.0 && one_way_ms > 7, "{breaks}");
        }
    }
}

#[test]
fn the_live_master_feels_the_tool_from_the_first_sample_and_makes_no_energy() {
    for words in ["delay 0ms", "delay 5ms", "delay 50ms 10ms loss 20%"] {
        let config = WorldConfig {
            architecture: mmt_shared::model::architecture::Architecture::Tdpa,
            ..over(words, 1000.0, 1)
        };
        let mut world = World::try_new(&config).unwrap();
        let (mut touched_ms, mut felt_ms) = (None, None);
        for ms in 0..20_000_u64 {
            let tick = world.step();
            let touches = tick.slave.is_some_and(|slave| slave.in_contact);
            touched_ms = touched_ms.or(touches.then_some(ms));
            // before, the hand feels the drag that pays its port's reserve
            let felt = touched_ms.is_some() && tick.master.displayed.norm() > 0.1;
            felt_ms = felt_ms.or(felt.then_some(ms));
        }
        let outcome = world.outcome();
        let least_mj = outcome.observer_min_j * 1e3;
        let ticks = 20_000 - outcome.forces;
        println!(
            "{words}: touch at {touched_ms:?}, felt at {felt_ms:?}, hand {least_mj:.3} mJ, {ticks} ticks without a force"
        );
        assert!(ticks < 200, "each tick of the tool sends its force");
        let late_ms = felt_ms.unwrap() - touched_ms.unwrap();
        assert!(late_ms < 100, "{late_ms} ms");
        assert!(least_mj > -2.0, "TDPA keeps a reserve of 2 mJ: {least_mj}");
        assert!(outcome.energy_injected_j < 1e-9);
    }
}
