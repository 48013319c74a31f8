//! What becomes of ticks that do not come, or come twice.

use mmt_shared::rng::Substream;
use mmt_shared::time::TICK_S;

use super::*;
use crate::tool::compliance::spring_for;

/// m (kg) and c (N) after 6 s in which a hand pushes a cube with a changing speed, and the slave misses this share of its ticks.
fn found_with_missed_ticks(share: f64) -> [f64; 2] {
    let mut driven = Driven::new(Mode::Recommended, vec![cube(0.0, 0.7, false)]);
    let begin = driven.hip;
    let mut random = Substream::new(1, "missed ticks", 0);
    for ms in 1..6000 {
        let t = f64::from(ms) * TICK_S;
        let way = 0.15 * t + 0.015 * (1.0 - libm::cos(6.0 * t));
        driven.take(begin + Vec2::new(way, 0.0));
        if random.uniform() >= share {
            driven.tick();
        }
    }
    let Estimate { m, c, .. } = *driven.slave.estimate();
    [m, c]
}

#[test]
fn ticks_that_were_missed_leave_the_estimate_as_it_is() {
    let [m, c] = found_with_missed_ticks(0.0);
    for share in [0.01, 0.05, 0.2, 0.7] {
        let found = found_with_missed_ticks(share);
        println!("{share}: {found:?} instead of {:?}", [m, c]);
        assert!((found[0] / m - 1.0).abs() < 0.1, "{share}: {found:?}");
        assert!((found[1] / c - 1.0).abs() < 0.05, "{share}: {found:?}");
    }
}

#[test]
fn a_tick_that_comes_twice_in_a_moment_leaves_a_tool_that_gives_its_speed() {
    let mut config = SlaveConfig::of_mode(Mode::Recommended);
    config.tool_compliance = Some(spring_for(Coupling::for_stiffness(1000.0)));
    config.scene.bodies = vec![cube(0.0, 0.7, true)];
    let mut driven = Driven::of(&config);
    for ms in 1..2000 {
        let way = Vec2::new(0.15e-3, 0.0);
        driven.take(driven.hip + if ms < 850 { way } else { Vec2::zeros() });
        driven.tick();
        if ms % 100 == 0 {
            driven.tick();
        }
    }
    assert!(driven.peak_n > 1.0, "{} N", driven.peak_n);
    let refused = driven.slave.environment().refused();
    assert_eq!(refused, 0, "every velocity of the tool is a number");
}
