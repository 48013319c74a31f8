//! Time of one tick of the estimators and of the trigger.
//!
//! Budgets: estimator 0.5 µs an update in either mode; trigger 0.1 µs a decision. The ticks are those of
//! a push, so that every tick reaches the regression.

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use mmt_server::estimator::{Estimator, EstimatorConfig, Measured, Seen, ToolGives};
use mmt_server::trigger::{Trigger, TriggerConfig, TriggerInput};
use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::model::params::ModelParams;
use mmt_shared::model::settings::Mode;
use mmt_shared::time::{TICK_S, Time};

const TICKS: usize = 4000;

/// Tool and force of a modulated push along x.
fn push() -> Vec<Measured> {
    let (mut position, mut measured) = (0.0, Vec::with_capacity(TICKS));
    for k in 0..TICKS {
        let t = k as f64 * TICK_S;
        let (slow, fast) = (libm::sin(4.0 * t), libm::sin(13.0 * t));
        let v = 0.16 * (1.0 + 0.3 * slow + 0.12 * fast);
        let a = 0.16 * (1.2 * libm::cos(4.0 * t) + 1.56 * libm::cos(13.0 * t));
        position += v * TICK_S;
        // seen and turning, so that every tick pays for it
        let seen = Seen {
            centre: Vec2::new(position + 0.18, 0.0),
            turning: 0.01,
            body_turning: 0.01,
            side: 0.36,
        };
        let force = 0.7 * a + 3.0 * v + 2.06;
        measured.push(Measured {
            back: Vec2::zeros(),
            force_noise_n: 0.0,
            held_back: false,
            tool: Vec2::new(position + force / 1000.0, 0.0),
            force: Vec2::new(force, 0.0),
            normal: Some(Vec2::new(1.0, 0.0)),
            seen: Some(seen),
        });
    }
    measured
}

fn estimators(criterion: &mut Criterion) {
    let ticks = push();
    for (name, mode) in [("paper", Mode::Paper), ("recommended", Mode::Recommended)] {
        let coupling = Coupling::for_stiffness(1000.0);
        let mut estimator = Estimator::new(
            &EstimatorConfig::of_mode(mode, coupling),
            coupling,
            8.0,
            ToolGives::No,
        );
        let mut next = ticks.iter().cycle();
        criterion.bench_function(&format!("estimator/{name}"), |bencher| {
            bencher.iter(|| next.next().map(|tick| estimator.step(black_box(tick))));
        });
        assert!(estimator.estimate().samples > 0, "every tick must count");
    }
}

fn trigger(criterion: &mut Criterion) {
    let coupling = Coupling::for_stiffness(1000.0);
    let Ok(params) = ModelParams::of_square(0.7, 3.0, 2.06, 0.4, &coupling) else {
        return;
    };
    let input = TriggerInput {
        f_s: Vec2::new(2.5, 0.1),
        f_m: Vec2::new(2.0, 0.1),
        noise_n: 0.0,
        slave_in_contact: true,
        shadow_in_contact: true,
        hip_stands: false,
        sticking: false,
        speed: 0.16,
        acceleration: 0.2,
        force_deviation: 0.0,
        params,
        only_friction_holds: false,
        shift: Vec2::zeros(),
        shift_deviation: 0.0,
        turn: 0.001,
        turn_deviation: 0.0,
    };
    for text in ["hybrid 10% 150ms", "useful 10% 150ms"] {
        let Ok(scheme) = text.parse() else { continue };
        let mut trigger = Trigger::new(TriggerConfig {
            scheme,
            ..TriggerConfig::of_mode(Mode::Recommended)
        });
        let mut ms = 0;
        criterion.bench_function(&format!("trigger/{text}"), |bencher| {
            bencher.iter(|| {
                ms += 1;
                trigger.step(Time::from_millis(ms), black_box(&input))
            });
        });
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default()
        .sample_size(50)
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(2));
    targets = estimators, trigger
}
criterion_main!(benches);
