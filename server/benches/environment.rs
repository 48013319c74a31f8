//! One world step of the slave: contact, ground friction, rapier. Budget 6 µs, aim 4 µs.

#![allow(missing_docs, reason = "the criterion macros make undocumented items")]
#![allow(clippy::unwrap_used, reason = "a bench is a test: it may panic")]

use criterion::{Criterion, criterion_group, criterion_main};
use mmt_server::environment::{Environment, EnvironmentConfig};
use mmt_shared::model::geometry::Vec2;
use std::hint::black_box;
use std::time::Duration;

/// A tool that pushes off-centre at 0.15 m/s for 2 s, then goes back to the start of the push.
fn push(criterion: &mut Criterion, name: &str, speed: f64) {
    criterion.bench_function(name, |bencher| {
        let mut environment = Environment::try_new(EnvironmentConfig::default()).unwrap();
        let mut tick = 0_u32;
        bencher.iter(|| {
            if tick == 0 {
                environment = Environment::try_new(EnvironmentConfig::default()).unwrap();
            }
            let x = -0.1805 + speed * f64::from(tick) * 1e-3;
            tick = (tick + 1) % 2000;
            black_box(environment.step(Vec2::new(x, 0.01), Vec2::new(speed, 0.0)))
        });
    });
}

fn world_step(criterion: &mut Criterion) {
    push(criterion, "environment/step/pushed", 0.15);
    push(criterion, "environment/step/pressed", 0.0001);
    criterion.bench_function("environment/step/free", |bencher| {
        let mut environment = Environment::try_new(EnvironmentConfig::default()).unwrap();
        bencher.iter(|| black_box(environment.step(Vec2::new(-1.0, 0.0), Vec2::zeros())));
    });
}

criterion_group! {
    name = benches;
    config = Criterion::default()
        .sample_size(50)
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(2));
    targets = world_step
}
criterion_main!(benches);
