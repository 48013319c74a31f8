//! How well the slave knows the object in the setting of the paper's experiment, in numbers.
//!
//! Perfect links, no play-out delay, poses set on arrival: what errs is the estimation alone.

use super::*;
use mmt_server::playout::PlayoutConfig;
use mmt_shared::settings::{Mode, PoseCorrection};

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

fn signed(world: &World) -> [f64; 3] {
    let (e, truth) = (
        world.slave().estimate(),
        world.slave().environment().truth(),
    );
    [
        e.m / truth.m() - 1.0,
        e.b / truth.b() - 1.0,
        e.c / truth.c() - 1.0,
    ]
}

#[test]
fn probe() {
    for lateral in [0.05, 0.0] {
        let mut all = [vec![], vec![], vec![]];
        let mut all_time = [vec![], vec![], vec![]];
        let (mut pmse, mut rate, mut relative) = (vec![], vec![], vec![]);
        for seed in 1..=10 {
            let mut config = experiment(seed);
            config.operator.lateral_max_m = lateral;
            let mut world = World::try_new(&config).unwrap();
            let mut k = 0;
            let mut omega = (0.0, 0);
            let mut lever = 0.0;
            let mut sum = [vec![], vec![], vec![]];
            while k < 30_000 {
                let t = world.step();
                k += 1;
                let (seen, truth) = (world.slave().observer(), world.slave().environment());
                if let Some(touch) = seen.touching()
                    && world.slave().estimate().speed > 0.02
                {
                    omega.0 += (seen.twist().angular - truth.twist().angular).powi(2);
                    omega.1 += 1;
                    let off = mmt_shared::geometry::cross(
                        seen.pose().position - truth.pose().position,
                        touch.inward,
                    );
                    lever += off * off;
                }
                if k > 6000 && t.slave.is_some_and(|s| s.in_contact) {
                    let e = signed(&world);
                    (0..3).for_each(|i| sum[i].push(e[i].abs()));
                }
            }
            let e = signed(&world);
            let s = sum.map(median);
            println!(
                "lateral {lateral} seed {seed}: final {:+.4} {:+.4} {:+.4}  contact median {:.4} {:.4} {:.4} pushes {:?}",
                e[0],
                e[1],
                e[2],
                s[0],
                s[1],
                s[2],
                world.operator().pushes_completed()
            );
            (0..3).for_each(|i| {
                all[i].push(e[i].abs());
                all_time[i].push(s[i]);
            });
            let by: Vec<_> = world
                .outcome()
                .updates
                .by_cause()
                .filter(|(_, n)| *n > 0)
                .collect();
            println!(
                "    {by:?} pmse {:?} omega rms err {:.4} d rms err {:.5}",
                world.force().pmse,
                (omega.0 / omega.1 as f64).sqrt(),
                (lever / omega.1 as f64).sqrt()
            );
            pmse.push(world.force().pmse.unwrap());
            rate.push(world.outcome().updates.rate_hz().unwrap());
            relative.push(world.force().relative_error.unwrap());
        }
        let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
        println!(
            "== lateral {lateral}: |final| {:.4?} over contact {:.4?} pmse mean {:.4} rate {:.2} relative {:.4}",
            all.map(median),
            all_time.map(median),
            mean(&pmse),
            mean(&rate),
            mean(&relative)
        );
    }
}
