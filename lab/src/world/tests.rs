//! What a world promises.

use super::*;
use mmt_shared::settings::Mode;
use mmt_shared::wire::Cause;

fn wan() -> LinkConfig {
    "delay 50ms 5ms loss 1%".parse().unwrap()
}

fn over(link: LinkConfig, seed: u64) -> WorldConfig {
    WorldConfig {
        up: link.clone(),
        down: link,
        ..WorldConfig::default()
    }
    .seeded(seed)
}

fn run(config: &WorldConfig, seconds: u64) -> World {
    let mut world = World::try_new(config).unwrap();
    world.run(Duration::from_secs(seconds), |_| {});
    world
}

#[test]
fn probe() {
    for seed in 1..=6 {
        for ms in [16.0, 21.0, 26.0] {
            let mut config = over(wan(), seed);
            config.slave.playout.delay_ms = ms;
            let world = run(&config, 20);
            let b = &world.slave().playout();
            println!("{ms} {:?}", b.counts());
            let (f, o) = (world.force(), world.outcome());
            let e = world.slave().estimate();
            println!(
                "seed {seed} rel {:.3} pmse {:.4} jnd7 {:.3} rate {:.2} pushes {:?} breaks {:.2} pose {:.1} mm peak {:.1} m {:.3} b {:.3} c {:.3} {:?}",
                f.relative_error.unwrap(),
                f.pmse.unwrap(),
                f.jnd7_share.unwrap(),
                o.updates.rate_hz().unwrap(),
                world.operator().pushes_completed(),
                o.breaks
                    .per_push(world.operator().pushes_completed().unwrap())
                    .unwrap(),
                o.pose.position_rms_m().unwrap() * 1e3,
                o.on_hand.largest_n().unwrap(),
                e.m,
                e.b,
                e.c,
                o.updates
                    .by_cause()
                    .map(|(c, n)| (c.name(), n))
                    .collect::<Vec<_>>(),
            );
        }
    }
}

#[test]
fn one_configuration_is_one_run_to_the_bit_and_another_seed_is_another() {
    let digest = |seed| run(&over(wan(), seed), 5).digest();
    assert_eq!(digest(1), digest(1));
    assert_ne!(digest(1), digest(2));
}
