//! What the limit of the tool's force promises.

use super::*;
use mmt_shared::model::settings::{CONTACT_DAMPING_NS_PER_M, STIFFNESS_N_PER_M};
use mmt_shared::rng::Substream;
use mmt_shared::stats::values::{mean, standard_deviation};

const SOFT: Coupling = Coupling {
    stiffness_n_per_m: 1000.0,
    damping_ns_per_m: 10.0,
};
/// The way of a tick at 0.6 m/s, m.
const QUICK: f64 = 6e-4;
/// What a tool with a limit of 15 N presses with, N: the rest is the margin.
const PRESSED_N: f64 = 14.4;

/// A tool at x that wants to be at a place behind a wall at 0; what it exerts, and whether it was held.
struct Press {
    limit: ToolForce,
    x: f64,
    force: Vec2,
    noise: Option<Substream>,
    /// The longest way of a tick, m.
    quick: f64,
}

impl Press {
    fn new(max_n: f64, coupling: Coupling, noise: Option<u64>) -> Self {
        Self {
            limit: ToolForce::try_new(max_n, coupling).unwrap(),
            x: -0.01,
            force: Vec2::zeros(),
            noise: noise.map(|seed| Substream::new(seed, "test/noise", 0)),
            quick: QUICK,
        }
    }

    /// One tick towards `aim`; the true force.
    fn tick(&mut self, aim: f64) -> f64 {
        let wanted = Vec2::new((aim - self.x).clamp(-self.quick, self.quick), 0.0);
        let way = self.limit.allowed(wanted, TICK_S, self.force);
        self.x += way.x;
        let velocity = way / TICK_S;
        self.limit.moved(velocity, way != wanted);
        let coupling = self.limit.coupling;
        let f = if self.x > 0.0 {
            coupling.force(self.x, velocity.x)
        } else {
            0.0
        };
        let noise = self.noise.as_mut().map_or(0.0, |noise| noise.normal());
        let measured = Vec2::new(f + 0.01 * noise, 0.0);
        self.force = if measured.x > 0.04 {
            measured
        } else {
            Vec2::zeros()
        };
        self.limit.measured(measured);
        f
    }
}

#[test]
fn a_press_on_a_wall_comes_to_the_limit_and_stays_there() {
    for (coupling, aim) in [
        (SOFT, 0.2),
        (Coupling::for_stiffness(3000.0), 0.2),
        (SOFT, 0.0145),
    ] {
        let mut press = Press::new(15.0, coupling, None);
        let forces: Vec<f64> = (0..2000).map(|_| press.tick(aim)).collect();
        let most = forces.iter().copied().fold(0.0, f64::max);
        assert!(most <= PRESSED_N + 1e-9, "{most} N");
        assert!(forces[1999] > PRESSED_N - 0.01, "{} N", forces[1999]);
        assert!(press.limit.held_ticks() > 100);
    }
    let mut press = Press::new(15.0, SOFT, None);
    (0..2500).for_each(|n| {
        press.tick(f64::from(n.min(2000)) * 7.1e-6);
    });
    assert_eq!(press.limit.held_ticks(), 0, "14.2 N are allowed");
}

/// Spread of the true force (N) in the last of 3 s in which a tool presses on a wall with all it may: the contact is so many
/// times as stiff as k_p (N/m), and the sensor lags.
fn swing(times: f64, k_p: f64, lag_s: f64) -> f64 {
    let coupling = Coupling::for_stiffness(k_p);
    let real = Coupling {
        stiffness_n_per_m: times * k_p,
        ..coupling
    };
    let mut limit = ToolForce::try_new(15.0, coupling).unwrap();
    let (mut x, mut measured) = (-1e-3, 0.0);
    let (mut least, mut most) = (f64::MAX, f64::MIN);
    for tick in 0..3000 {
        let wanted = Vec2::new(1e-4, 0.0);
        let way = limit.allowed(wanted, TICK_S, Vec2::new(measured, 0.0));
        x += way.x;
        limit.moved(way / TICK_S, way != wanted);
        let force = if x > 0.0 {
            real.force(x, way.x / TICK_S)
        } else {
            0.0
        };
        measured += (force - measured) * TICK_S / lag_s;
        limit.measured(Vec2::new(measured, 0.0));
        if tick >= 2000 {
            (least, most) = (least.min(force), most.max(force));
        }
    }
    assert!(most > 14.0, "pressed with {most} N");
    most - least
}

#[test]
fn a_tool_that_presses_through_a_stiffer_contact_than_its_own_comes_to_rest_though_the_sensor_lags()
{
    for k_p in [300.0, 1000.0, 2000.0, 3000.0] {
        for times in [1.0, 3.0, 10.0] {
            for lag_s in [TICK_S, 2e-3, 5e-3, 10e-3, 20e-3] {
                let swing = swing(times, k_p, lag_s);
                println!("{times} times {k_p} N/m, {lag_s} s: {swing} N");
                assert!(swing < 0.1);
            }
        }
    }
}

#[test]
fn forces_that_were_not_foreseen_cost_none_in_front_of_an_object_that_gives_way() {
    for lag_s in [TICK_S, 5e-3] {
        let mut limit = ToolForce::try_new(15.0, SOFT).unwrap();
        for _ in 0..5 {
            limit.measured(Vec2::new(14.9, 0.0));
            limit.measured(Vec2::new(14.0, 0.0));
        }
        // 4 kg on 50 N s/m and 2 N: at 14.4 N it goes at 0.25 m/s
        let (mut x, mut object, mut velocity) = (0.0, -0.01, 0.0);
        let (mut force, mut measured) = (0.0, 10.0);
        for _ in 0..3000 {
            let wanted = Vec2::new(QUICK, 0.0);
            let way = limit.allowed(wanted, TICK_S, Vec2::new(measured, 0.0));
            x += way.x;
            limit.moved(way / TICK_S, way != wanted);
            force = SOFT.force(x - object, way.x / TICK_S - velocity).max(0.0);
            velocity += (force - 50.0 * velocity - 2.0) / 4.0 * TICK_S;
            object += velocity * TICK_S;
            measured += (force - measured) * TICK_S / lag_s;
            limit.measured(Vec2::new(measured, 0.0));
        }
        println!("{force} N at {velocity} m/s");
        assert!(force > 14.0);
    }
}

#[test]
fn a_first_touch_at_full_speed_cannot_be_foreseen() {
    for (k_p, most_n) in [(1000.0, 6.6), (3000.0, 13.8)] {
        let coupling = Coupling::for_stiffness(k_p);
        let limit = ToolForce::try_new(1.0, coupling).unwrap();
        let way = Vec2::new(QUICK, 0.0);
        assert_eq!(limit.allowed(way, TICK_S, Vec2::zeros()), way);
        assert!((coupling.force(QUICK, QUICK / TICK_S) - most_n).abs() < 1e-9);
    }
}

/// Largest force of a tool that goes at `speed` (m/s) against a wall, over where a tick finds it before the wall.
fn first_touch(coupling: Coupling, speed: f64) -> f64 {
    let most = (0..20).map(|part| {
        let mut press = Press::new(15.0, coupling, None);
        let way = speed * TICK_S;
        press.quick = way;
        press.x = -way * (3.0 + f64::from(part) / 20.0);
        (0..50).map(|_| press.tick(1.0)).fold(0.0, f64::max)
    });
    most.fold(0.0, f64::max)
}

#[test]
fn a_first_touch_costs_no_more_than_the_limit_for_every_accepted_coupling() {
    let range = |(least, most): (f64, f64)| {
        (0..=20).map(move |n| least + (most - least) * f64::from(n) / 20.0)
    };
    let (mut worst, mut unbound) = (0.0_f64, 0.0_f64);
    for k_p in range(STIFFNESS_N_PER_M) {
        for k_d in range(CONTACT_DAMPING_NS_PER_M) {
            let coupling = Coupling {
                stiffness_n_per_m: k_p,
                damping_ns_per_m: k_d,
            };
            let limit = ToolForce::try_new(15.0, coupling).unwrap();
            let speed = limit.approach_speed().unwrap().min(0.6);
            worst = worst.max(first_touch(coupling, speed));
            unbound = unbound.max(first_touch(coupling, 0.6));
        }
    }
    assert!(unbound > 46.0, "the effect exists: {unbound} N");
    assert!(worst <= PRESSED_N + 1e-9, "{worst} N");
}

#[test]
fn a_first_touch_after_missed_ticks_costs_no_more_than_the_limit() {
    let coupling = Coupling {
        stiffness_n_per_m: 2110.0,
        damping_ns_per_m: 15.55,
    };
    let limit = ToolForce::try_new(15.0, coupling).unwrap();
    let mut longest = 0.0_f64;
    for missed in 0..100 {
        let period_s = f64::from(missed + 1) * TICK_S;
        let wanted = Vec2::new(0.6 * period_s, 0.0);
        let way = limit.allowed(wanted, period_s, Vec2::zeros());
        assert!(way == wanted || missed > 2, "{missed}");
        // it stood just before the wall, and the sensor has a bias, or something is rubbed along
        for bias in [-0.2, 0.0, 0.2] {
            let mut limit = limit;
            limit.moved(Vec2::new(0.6, 0.0), false);
            let way = limit.allowed(wanted, period_s, Vec2::new(bias, 0.0));
            let force = coupling.force(way.x, way.x / period_s);
            assert!(
                force <= PRESSED_N + 1e-9,
                "{force} N after {missed} missed ticks, with a bias of {bias} N"
            );
        }
        longest = longest.max(way.x);
    }
    assert!(longest > 6e-3, "{longest} m");
}

#[test]
fn a_coupling_that_leaves_less_than_a_tenth_of_a_metre_a_second_is_refused() {
    let damped = |k_d| Coupling {
        stiffness_n_per_m: 10_000.0,
        damping_ns_per_m: k_d,
    };
    let speed = |max_n, k_d| {
        ToolForce::try_new(max_n, damped(k_d))
            .unwrap()
            .approach_speed()
    };
    assert!((speed(12.5, 100.0).unwrap() - 0.1).abs() < 1e-12);
    assert!(speed(12.4, 100.0).is_err() && speed(1.0, 0.0).is_err());
}

#[test]
fn a_noisy_sensor_makes_the_force_no_more_unsteady_than_it_is() {
    let mut press = Press::new(15.0, SOFT, Some(1));
    let forces: Vec<f64> = (0..20_000).map(|_| press.tick(0.2)).skip(1000).collect();
    let mean = mean(forces.iter().copied()).unwrap();
    let deviation = standard_deviation(&forces).unwrap();
    let most = forces.iter().copied().fold(0.0, f64::max);
    assert!((mean - PRESSED_N).abs() < 1e-3, "{mean} N");
    assert!(deviation < 0.0105, "{deviation} N at a noise of 0.01 N");
    assert!(most < PRESSED_N + 0.05, "{most} N");
}

#[test]
fn it_goes_back_at_once_and_slides_along_the_face_freely() {
    let mut press = Press::new(15.0, SOFT, None);
    (0..500).for_each(|_| {
        press.tick(0.2);
    });
    let (limit, force) = (press.limit, press.force);
    let way = limit.allowed(Vec2::new(QUICK, 3e-4), TICK_S, force);
    assert_eq!(way.y, 3e-4);
    assert!(way.x.abs() < 1e-9, "{way}");
    let back = Vec2::new(-QUICK, 1e-4);
    assert_eq!(limit.allowed(back, TICK_S, force), back);
    assert_eq!(
        limit.allowed(back, TICK_S, Vec2::zeros()),
        back,
        "nothing touched"
    );
}

#[test]
fn a_tool_that_is_pressed_on_gives_way() {
    let mut limit = ToolForce::try_new(15.0, SOFT).unwrap();
    limit.moved(Vec2::zeros(), false);
    let way = limit.allowed(Vec2::zeros(), TICK_S, Vec2::new(0.0, 26.0));
    let back = (PRESSED_N - 26.0) / (1000.0 + 10.0 / TICK_S);
    assert!((way - Vec2::new(0.0, back)).norm() < 1e-12, "{way}");
}

#[test]
fn an_object_that_is_pushed_at_a_steady_speed_meets_no_limit() {
    // 12 N at 0.3 m/s: the damping's share of the force is not the tool's own doing
    let mut limit = ToolForce::try_new(15.0, SOFT).unwrap();
    limit.moved(Vec2::new(0.3, 0.0), false);
    let way = Vec2::new(3e-4, 0.0);
    assert_eq!(limit.allowed(way, TICK_S, Vec2::new(12.0, 0.0)), way);
    // nor after four missed ticks, since the speed is the same
    let late = way * 5.0;
    assert_eq!(
        limit.allowed(late, 5.0 * TICK_S, Vec2::new(12.0, 0.0)),
        late
    );
}

#[test]
fn a_limit_that_is_none_is_refused_by_name() {
    for value in [0.0, -1.0, 1e4, f64::NAN, f64::INFINITY] {
        let error = ToolForce::try_new(value, SOFT).unwrap_err().to_string();
        assert!(
            error.starts_with("tool force: limit ") && error.ends_with("0.1 to 1000 N"),
            "{error}"
        );
    }
}
