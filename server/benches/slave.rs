//! The shadow's tick and the slave's whole tick, from the HIP sample to the update. Budget of the
//! shadow's 10 µs; the slave's is the sum of its parts' and must leave most of the millisecond free.

#![allow(missing_docs, reason = "the criterion macros make undocumented items")]
#![allow(clippy::unwrap_used, reason = "a bench is a test: it may panic")]

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, criterion_group, criterion_main};
use mmt_server::slave::{Slave, SlaveConfig};
use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::model::local_model::LocalModel;
use mmt_shared::model::sample::{ForceCounts, HipCounts, HipSample};
use mmt_shared::model::settings::Mode;
use mmt_shared::time::{TICK, Time};

/// Ticks of one push, before everything begins anew.
const TICKS: u32 = 4000;

/// The HIP of a push along x with a modulated speed, a little off the middle, from 1 cm before the box.
fn hip(tick: u32) -> Vec2 {
    let t = f64::from(tick) * 1e-3;
    let swing = 0.075 * (1.0 - libm::cos(4.0 * t)) + 0.009 * (1.0 - libm::cos(13.0 * t));
    Vec2::new(-0.21 + 0.16 * (t + 0.16 * swing), 0.02)
}

fn slave(mode: Mode) -> Slave {
    Slave::try_new(&SlaveConfig::of_mode(mode), Coupling::for_stiffness(1000.0)).unwrap()
}

/// The names of the modes as the benches print them.
const MODES: [(&str, Mode); 2] = [("recommended", Mode::Recommended), ("paper", Mode::Paper)];

fn shadow(criterion: &mut Criterion) {
    for (name, mode) in MODES {
        let start = slave(mode);
        let fresh = || {
            LocalModel::new(
                *start.settings(),
                *start.state(),
                start.tool_force().max_n(),
            )
        };
        let (mut model, mut tick, mut contact) = (fresh(), 0, 0_u64);
        criterion.bench_function(&format!("shadow/tick/{name}"), |bencher| {
            bencher.iter(|| {
                if tick == TICKS {
                    (model, tick) = (fresh(), 0);
                }
                tick += 1;
                let stamp = Time::from_millis(u64::from(tick));
                let rendered = model.step(stamp, black_box(hip(tick)));
                contact += u64::from(rendered.in_contact());
                rendered
            });
        });
        assert!(contact > 0, "nothing was touched");
    }
}

fn whole(criterion: &mut Criterion) {
    for (name, mode) in MODES {
        let (mut side, mut now, mut tick, mut updates) = (slave(mode), Time::ZERO, 0, 0_u64);
        criterion.bench_function(&format!("slave/tick/{name}"), |bencher| {
            bencher.iter(|| {
                if tick == TICKS {
                    (side, now, tick) = (slave(mode), Time::ZERO, 0);
                }
                tick += 1;
                now += TICK;
                let sample = HipSample {
                    stamp: now,
                    hip: HipCounts::nearest(hip(tick)),
                    force: ForceCounts::default(),
                };
                side.handle_sample(now, black_box(&sample), updates as u32);
                let done = side.tick(now);
                updates += u64::from(done.is_some_and(|done| done.update.is_some()));
                done
            });
        });
        assert!(updates > 0, "nothing was sent");
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default()
        .sample_size(50)
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(2));
    targets = shadow, whole
}
criterion_main!(benches);
