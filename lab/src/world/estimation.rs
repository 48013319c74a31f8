//! How well the slave knows the object in the setting of the paper's experiment, in numbers.
//!
//! Perfect links, no play-out delay, poses set on arrival: what errs is the estimation, not the network.
//! Every law prints what it found; all times are virtual and count sliding contact only.

use super::*;
use mmt_server::playout::PlayoutConfig;
use mmt_shared::params::ModelParams;
use mmt_shared::settings::{Mode, PoseCorrection};

const SEEDS: std::ops::RangeInclusive<u64> = 1..=10;
/// What counts as sliding, m/s: the least speed at which the estimator listens.
const SLIDES_M_PER_S: f64 = 0.020;

fn experiment(seed: u64) -> WorldConfig {
    let coupling = DeviceProfile::default().coupling();
    let mut config = WorldConfig {
        settings: Some(ModelSettings {
            correction: PoseCorrection::Snap,
            ..Mode::Recommended.model_settings(coupling)
        }),
        samples_per_command: 1,
        ..WorldConfig::default()
    };
    config.slave.trigger.scheme = "useful 10% 150ms".parse().unwrap();
    config.slave.playout = PlayoutConfig {
        delay_ms: 0.0,
        ..PlayoutConfig::default()
    };
    config.seeded(seed)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    if values.len() % 2 == 1 {
        values[middle]
    } else {
        values[middle - 1].midpoint(values[middle])
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn truth(world: &World) -> ModelParams {
    world.slave().environment().truth()
}

/// |error| of the estimates of m, b and c, relative.
fn errors(world: &World) -> [f64; 3] {
    let (e, truth) = (world.slave().estimate(), truth(world));
    [e.m / truth.m(), e.b / truth.b(), e.c / truth.c()].map(|ratio| (ratio - 1.0).abs())
}

/// The same with b weighed by the force that it stands for: |Delta b| v over the force of (1) at this speed.
fn felt_errors(world: &World) -> [f64; 3] {
    let (e, truth) = (world.slave().estimate(), truth(world));
    let [m, _, c] = errors(world);
    let b = (e.b - truth.b()).abs() * e.speed;
    [m, b / (truth.b() * e.speed + truth.c()), c]
}

/// Error of the force that (1) predicts with the estimates in the present motion, relative.
fn force_error(world: &World) -> f64 {
    let (e, truth) = (world.slave().estimate(), truth(world));
    let force = |m: f64, b: f64, c: f64| m * e.acceleration + b * e.speed + c;
    (force(e.m, e.b, e.c) / force(truth.m(), truth.b(), truth.c()) - 1.0).abs()
}

fn slides(world: &World) -> bool {
    world.slave().estimate().speed > SLIDES_M_PER_S
}

/// Medians of the errors of m, b, c after 30 s; mean PMSE and mean packet rate (1/s).
fn after_30_s(lateral_max_m: f64) -> ([f64; 3], f64, f64) {
    let mut all = [vec![], vec![], vec![]];
    let (mut pmse, mut rate) = (vec![], vec![]);
    for seed in SEEDS {
        let mut config = experiment(seed);
        config.operator.lateral_max_m = lateral_max_m;
        let mut world = World::try_new(&config).unwrap();
        world.run(Duration::from_secs(30), |_| {});
        let found = errors(&world);
        all.iter_mut().zip(found).for_each(|(all, e)| all.push(e));
        pmse.push(world.force().pmse.unwrap());
        rate.push(world.outcome().updates.rate_hz().unwrap());
    }
    (all.map(median), mean(&pmse), mean(&rate))
}

#[test]
fn pushes_beside_the_centre_do_not_bias_m_b_and_c() {
    let ([m, b, c], pmse, rate) = after_30_s(0.05);
    println!("lateral 5 cm: m {m:.4} b {b:.4} c {c:.4}; PMSE {pmse:.4} at {rate:.2} packets/s");
    assert!(m <= 0.01 && b <= 0.015 && c <= 0.004);
    assert!(pmse <= 0.02 && rate <= 2.0);
}

#[test]
fn pushes_through_the_centre_leave_less_than_half_a_percent() {
    let ([m, b, c], pmse, rate) = after_30_s(0.0);
    println!("lateral 0: m {m:.4} b {b:.4} c {c:.4}; PMSE {pmse:.4} at {rate:.2} packets/s");
    assert!(m <= 0.005 && b <= 0.01 && c <= 0.003);
    assert!(pmse <= 0.02 && rate <= 2.0);
}

#[test]
fn the_first_push_shows_m_b_and_c() {
    let mut last = [vec![], vec![], vec![], vec![]];
    for seed in SEEDS {
        let mut world = World::try_new(&experiment(seed)).unwrap();
        let (mut sliding, mut off) = (0.0, [0.0; 4]);
        while sliding < 2000.0 {
            world.step();
            if slides(&world) {
                sliding += 1.0;
                let [m, b, c] = felt_errors(&world);
                let now = [m, b, c, force_error(&world)];
                off.iter_mut()
                    .zip(now)
                    .filter(|(_, e)| *e > 0.1)
                    .for_each(|(off, _)| *off = sliding);
            }
        }
        println!("{seed}: {off:?}");
        last.iter_mut()
            .zip(off)
            .for_each(|(last, off)| last.push(off));
    }
    let all = last.map(median);
    println!("first push: m, b (as force), c, force within 10 % after {all:?} ms of sliding");
}

/// After mu has gone from 0.30 to 0.45 in the middle of a push: sliding contact (ms) until c and the
/// predicted force stay within 10 % for the next second of it, and the packets of that time.
fn after_a_step_of_mu(scheme: &str, seed: u64) -> [f64; 4] {
    let mut config = experiment(seed);
    config.slave.trigger.scheme = scheme.parse().unwrap();
    let mut world = World::try_new(&config).unwrap();
    world.run(Duration::from_secs(10), |_| {});
    let mut slid = 0;
    while slid < 700 {
        world.step();
        slid = if slides(&world) { slid + 1 } else { 0 };
    }
    world.environment_mut().set_friction(0.45).unwrap();
    let sent = world.outcome().updates.total();
    let (mut sliding, mut off, mut packets, mut in_contact) = (0.0, [0.0; 3], 0, 0.0);
    while sliding < 1000.0 {
        let tick = world.step();
        let Some(slave) = tick.slave.filter(|slave| slave.in_contact) else {
            continue;
        };
        in_contact += 1.0;
        if !slides(&world) {
            continue;
        }
        sliding += 1.0;
        let model = (slave.f_s - slave.f_shadow).norm() / slave.f_s.norm().max(0.3);
        let now = [errors(&world)[2], force_error(&world), model];
        for (i, e) in now.into_iter().enumerate() {
            if e > 0.1 {
                off[i] = in_contact;
                if i < 2 {
                    packets = world.outcome().updates.total() - sent;
                }
            }
        }
    }
    println!(
        "{scheme} {seed}: {off:?} {packets} all {}",
        world.outcome().updates.total() - sent
    );
    let [c, force, model] = off;
    [c, force, model, packets as f64]
}

#[test]
fn a_step_of_mu_is_followed() {
    for scheme in ["useful 10% 150ms", "hybrid 10% 150ms"] {
        let mut all = [vec![], vec![], vec![], vec![]];
        for seed in SEEDS {
            let found = after_a_step_of_mu(scheme, seed);
            all.iter_mut().zip(found).for_each(|(all, v)| all.push(v));
        }
        println!(
            "{scheme}: c, force, model force, packets {:?}",
            all.map(median)
        );
    }
}

#[test]
fn probe_slow() {
    for seed in 1..=5 {
        let mut config = experiment(seed);
        config.operator.push_speed_m_per_s = (0.010, 0.010);
        config.operator.approach_m_per_s = 0.010;
        let mut world = match World::try_new(&config) { Ok(w) => w, Err(e) => { println!("{e}"); return; } };
        for second in 0..30 {
            world.run(Duration::from_secs(1), |_| {});
            if second % 5 == 4 {
                let e = world.slave().estimate();
                println!("{seed} {second}: {:.4?} speed {:.4} sticking {} samples {} {:?}", errors(&world), e.speed, e.sticking, e.samples, world.outcome().updates.total());
            }
        }
    }
}
