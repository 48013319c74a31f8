//! Promises of the conditioner, on a tool that presses on something that does not move.

use mmt_shared::fixtures::COUPLING;
use mmt_shared::rng::Substream;
use mmt_shared::time::TICK_S;

use super::*;
use crate::slave::{Slave, SlaveConfig};

const K_P: f64 = COUPLING.stiffness_n_per_m;

/// A tool before a wall at x = 0, and its sensor.
struct Press {
    conditioner: Conditioner,
    noise: Substream,
    noise_n: f64,
    bias: Vec2,
    drift: Vec2,
    /// Weight of the newest force in the measured one: 1 without lag.
    weight: f64,
    lagging: Vec2,
}

impl Press {
    fn new(noise_n: f64, bias: Vec2, drift_n_per_s: Vec2) -> Self {
        let config = ConditioningConfig::default();
        Self {
            conditioner: Conditioner::new(config, ContactConfig::default(), &COUPLING),
            noise: Substream::new(1, "test/noise", 0),
            noise_n,
            bias,
            drift: drift_n_per_s * TICK_S,
            weight: 1.0,
            lagging: Vec2::zeros(),
        }
    }

    /// One tick with the tool at `x` (m).
    fn tick(&mut self, x: f64) -> Conditioned {
        let (a, b) = self.noise.normal_pair();
        let truth = Vec2::new((K_P * x).max(0.0), 0.0);
        self.lagging += (truth - self.lagging) * self.weight;
        self.bias += self.drift;
        let measured = self.lagging + self.bias + Vec2::new(a, b) * self.noise_n;
        self.conditioner.step(measured, Vec2::new(x, 0.0))
    }

    /// So many ticks at `x`; in how many there was contact.
    fn stay(&mut self, x: f64, ticks: u32) -> u32 {
        (0..ticks).map(|_| u32::from(self.tick(x).in_contact)).sum()
    }

    /// From one place to another at 0.1 m/s; the last tick.
    fn go(&mut self, from: f64, to: f64) -> Conditioned {
        let ticks = ((to - from).abs() / 1e-4).round();
        let ways = (0..=ticks as u32).map(|n| from + (to - from) * f64::from(n) / ticks);
        let ticks: Vec<Conditioned> = ways.map(|x| self.tick(x)).collect();
        ticks[ticks.len() - 1]
    }
}

const FREE: f64 = -0.01;

#[test]
fn the_default_sensor_s_forces_pass_bit_by_bit() {
    let (mut press, none) = (
        Press::new(0.01, Vec2::zeros(), Vec2::zeros()),
        Vec2::zeros(),
    );
    let mut noise = press.noise.clone();
    for n in 0..20_000 {
        let (a, b) = noise.normal_pair();
        // half a metre a second in, half a metre a second out
        let into = f64::from((n % 4000 - 3000).min(3999 - n % 4000));
        let x = (FREE + 5e-4 * into).clamp(FREE, 2e-3);
        let tick = press.tick(x);
        assert_eq!(tick.force, press.lagging + none + Vec2::new(a, b) * 0.01);
        assert_eq!(tick.averaged, 1);
        assert!(into < 30.0 || tick.in_contact);
    }
}

#[test]
fn a_noise_of_0_1_n_is_no_contact_and_half_a_newton_is() {
    let mut press = Press::new(0.1, Vec2::zeros(), Vec2::zeros());
    assert_eq!(press.stay(FREE, 60_000), 0, "a minute in free space");
    press.go(FREE, 5e-4);
    assert!(press.stay(5e-4, 5000) > 4980);
    press.go(5e-4, FREE);
    assert_eq!(press.stay(FREE, 1000), 0);
    assert!(press.tick(FREE).averaged == JUDGED_MAX);
}

#[test]
fn a_bias_is_tared_and_its_drift_followed() {
    let mut press = Press::new(0.01, Vec2::new(0.0, 0.2), Vec2::new(-0.02, 0.0));
    assert_eq!(press.stay(FREE, 10_000), 0);
    let left = (0..1000).map(|_| press.tick(FREE).force);
    let mean = left.fold(Vec2::zeros(), |sum, force| sum + force) / 1000.0;
    // a follower of 0.25 s would be 5 mN behind
    assert!(mean.norm() < 0.002, "{mean}");
}

#[test]
fn a_bias_goes_on_drifting_while_the_tool_touches_as_it_has_drifted_before() {
    for noise_n in [0.01, 0.1] {
        let drift = Vec2::new(0.006, 0.008);
        let mut press = Press::new(noise_n, Vec2::new(0.0, 0.2), drift);
        let mut off = Vec2::zeros();
        for n in 0..20 {
            press.stay(FREE, 1000);
            press.go(FREE, 2e-3);
            press.stay(2e-3, 2000);
            if n >= 10 {
                off += press.conditioner.bias.known() - press.bias;
            }
            press.go(2e-3, FREE);
        }
        // in the time of a contact the bias goes on by 20 mN
        let mean = off.norm() / 10.0;
        assert!(mean < 0.004, "noise {noise_n} N: {mean} N");
    }
}

#[test]
fn slow_noise_is_no_drift() {
    let mut press = Press::new(0.0, Vec2::zeros(), Vec2::zeros());
    let mut noise = Substream::new(2, "test/noise", 0);
    let mut slow = Vec2::zeros();
    let mut farthest = 0.0_f64;
    for n in 0..20_000 {
        // 20 mN with a time constant of 50 ms
        let (a, b) = noise.normal_pair();
        slow += (Vec2::new(a, b) * 0.2 - slow) * 0.02;
        press.bias = Vec2::new(0.0, 0.2) + slow;
        // a second in free space, a second in contact
        press.tick(if n % 2000 < 1000 { FREE } else { 2e-3 });
        if n > 2000 {
            let off = press.conditioner.bias.known() - Vec2::new(0.0, 0.2);
            farthest = farthest.max(off.norm());
        }
    }
    assert!(farthest < 0.03, "{farthest}");
}

#[test]
fn what_no_sensor_drifts_by_does_not_go_on_while_the_tool_touches() {
    let mut press = Press::new(0.01, Vec2::new(0.0, 0.2), Vec2::new(0.05, 0.0));
    press.stay(FREE, 10_000);
    press.go(FREE, 2e-3);
    let before = press.conditioner.bias.known();
    assert!(press.stay(2e-3, 1000) > 990);
    assert_eq!(press.conditioner.bias.known(), before);
}

#[test]
fn a_bias_whose_drift_ends_in_a_long_contact_is_found_after_it() {
    let mut press = Press::new(0.01, Vec2::new(0.0, 0.2), Vec2::new(0.01, 0.0));
    press.stay(FREE, 10_000);
    press.go(FREE, 2e-3);
    press.drift = Vec2::zeros();
    assert!(press.stay(2e-3, 60_000) > 59_000, "a minute, 0.6 N");
    press.go(2e-3, FREE);
    press.stay(FREE, 1000);
    assert_eq!(press.stay(FREE, 1000), 0);
    press.go(FREE, 2e-3);
    press.stay(2e-3, 1000);
    let off = (press.conditioner.bias.known() - press.bias).norm();
    assert!(off < 0.01, "{off}");
}

#[test]
fn a_touch_while_the_bias_is_measured_for_the_first_time_is_contact_at_once_and_no_bias() {
    for ticks in 0..99 {
        let mut press = Press::new(0.01, Vec2::new(0.0, 0.2), Vec2::zeros());
        press.stay(FREE, ticks);
        assert!(press.stay(2e-3, 200) >= 197, "after {ticks} ticks");
        let taken_off = 2.0 - press.tick(2e-3).force.x;
        assert!(taken_off < 0.1, "{taken_off} N after {ticks} ticks");
    }
}

#[test]
fn a_contact_in_which_the_bias_drifts_beyond_the_threshold_ends_and_is_tared_after() {
    for angle in 0..8 {
        let angle = f64::from(angle) * std::f64::consts::FRAC_PI_4;
        let drift = Vec2::new(libm::cos(angle), libm::sin(angle)) * 0.01;
        let mut press = Press::new(0.01, Vec2::zeros(), drift);
        press.stay(FREE, 1000);
        press.go(FREE, 2e-3);
        assert!(press.stay(2e-3, 60_000) > 59_000, "a minute, 0.6 N");
        press.go(2e-3, FREE);
        assert_eq!(press.stay(FREE, 1000), 0, "ended");
        assert!(press.tick(FREE).force.norm() < 0.06, "tared");
        press.go(FREE, 1e-3);
        assert!(press.stay(1e-3, 100) == 100, "and begins again");
    }
}

#[test]
fn a_contact_that_was_pressed_hard_and_is_let_go_ends_a_few_millimetres_behind_it_all_the_same() {
    let mut press = Press::new(0.01, Vec2::zeros(), Vec2::new(0.03, 0.0));
    press.stay(FREE, 1000);
    press.go(FREE, 8e-3);
    assert!(press.stay(8e-3, 5000) > 4990, "8 N, and 0.15 of bias");
    press.drift = Vec2::zeros();
    press.go(8e-3, -6e-3);
    assert_eq!(press.stay(-6e-3, 100), 0);
}

#[test]
fn a_bias_that_is_first_seen_after_a_long_contact_is_found_in_a_second() {
    let mut press = Press::new(0.01, Vec2::zeros(), Vec2::new(0.0, 0.008));
    press.stay(FREE, 500);
    press.go(FREE, 2e-3);
    press.stay(2e-3, 5000);
    press.go(2e-3, FREE);
    press.stay(FREE, 1000);
    for n in 0..3000 {
        press.tick(FREE);
        let left = press.bias - press.conditioner.bias.known();
        assert!(left.norm() < 6e-3, "after {n} ticks more: {left}");
    }
}

#[test]
fn a_session_that_begins_with_a_bias_it_takes_for_contact_finds_out_when_the_tool_goes_back() {
    let mut press = Press::new(0.01, Vec2::new(0.2, 0.0), Vec2::zeros());
    press.conditioner.resume();
    assert!(press.stay(FREE, 100) > 90, "nobody can know");
    press.go(FREE, FREE - 5e-3);
    assert_eq!(press.stay(FREE - 5e-3, 1000), 0);
}

#[test]
fn a_light_touch_that_stays_is_no_bias() {
    let mut press = Press::new(0.01, Vec2::zeros(), Vec2::zeros());
    press.stay(FREE, 1000);
    press.go(FREE, 1.5e-4);
    assert!(
        press.stay(1.5e-4, 30_000) > 29_990,
        "0.15 N for half a minute"
    );
    let force = press.tick(1.5e-4).force;
    assert!((force.x - 0.15).abs() < 0.06, "{force}");
}

#[test]
fn without_the_cures_every_force_passes() {
    let config = ConditioningConfig::of_mode(Mode::Paper);
    let mut conditioner = Conditioner::new(config, ContactConfig::default(), &COUPLING);
    for n in 0..1000 {
        let force = Vec2::new(0.2, f64::from(n % 7) * 0.1);
        let tick = conditioner.step(force, Vec2::zeros());
        assert_eq!((tick.force, tick.averaged), (force, 1));
        assert_eq!(tick.in_contact, n >= 2);
    }
}

/// An object that does not move is pressed on and let go by half again and again, at 0.3 m/s: it is touched all the time,
/// and what it takes of the force is no bias.
fn pressed_and_eased(mut press: Press) {
    press.stay(FREE, 1000);
    press.go(FREE, 8e-3);
    press.stay(8e-3, 100);
    for n in 0..20_000_u32 {
        // 8 to 2 mm and back within 40 ms
        let phase = f64::from(n % 40);
        let x = 8e-3 - 3e-4 * phase.min(40.0 - phase);
        assert!(press.tick(x).in_contact, "{n}");
    }
    press.stay(2e-3, 100);
    let forces = (0..1000).map(|_| press.tick(2e-3).force);
    let mean = forces.fold(Vec2::zeros(), |sum, force| sum + force) / 1000.0;
    assert!((mean - Vec2::new(2.0, 0.0)).norm() < 0.03, "{mean}");
    press.go(2e-3, FREE);
    assert_eq!(press.stay(FREE, 1000), 0);
}

#[test]
fn an_object_that_does_not_move_is_touched_as_long_as_it_is_whatever_the_lag() {
    let mut press = Press::new(0.01, Vec2::zeros(), Vec2::zeros());
    press.weight = 1.0 - libm::exp(-TICK_S / 5e-3);
    pressed_and_eased(press);
}

#[test]
fn an_object_that_does_not_move_is_touched_as_long_as_it_is_whatever_the_noise() {
    pressed_and_eased(Press::new(0.1, Vec2::zeros(), Vec2::zeros()));
}

/// Presses, while the bias drifts to 0.12 N, goes back by 1.5 mm, too little to be found out, and is seen there
/// `seen` times. In how many of the next 50 ticks there was contact.
fn seen_clear(depth: f64, seen: u32) -> u32 {
    let mut press = Press::new(0.005, Vec2::zeros(), Vec2::new(0.03, 0.0));
    press.stay(FREE, 500);
    press.go(FREE, depth);
    press.stay(depth, 4000);
    press.drift = Vec2::zeros();
    for _ in 0..seen {
        press.conditioner.see_clear();
        press.tick(depth - 1.5e-3);
    }
    press.stay(depth - 1.5e-3, 50)
}

#[test]
fn what_images_show_clear_ends_unless_it_presses_harder_than_any_drift() {
    assert_eq!(seen_clear(1e-3, 0), 50, "the bias looks like contact");
    assert_eq!(seen_clear(1e-3, 1), 0);
    assert_eq!(
        seen_clear(3e-3, 1),
        50,
        "1.5 N are contact, whatever is seen"
    );
}

#[test]
fn a_lag_that_no_sensor_has_is_refused() {
    for bad in [f64::NAN, -1.0, 101.0] {
        let mut config = SlaveConfig::default();
        config.conditioning.lag_ms = bad;
        let Err(refused) = Slave::try_new(&config, COUPLING) else {
            panic!("{bad} is accepted");
        };
        assert!(refused.to_string().contains("conditioning"), "{refused}");
    }
}
