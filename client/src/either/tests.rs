//! What a fade promises, with a hand and a tool that are made up.

use std::time::Duration;

use super::*;
use crate::limiter::{ForceLimiter, Limits};
use crate::master::{Master, MasterTick};
use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::{BoxFootprint, Pose, Twist};
use mmt_shared::model::params::{ModelParams, ModelState};
use mmt_shared::model::sample::ForceCounts;
use mmt_shared::model::settings::Mode;
use mmt_shared::rng::Substream;
use mmt_shared::wire::{Label, Welcome};

fn master(architecture: Architecture) -> Master {
    let coupling = Coupling::for_stiffness(1000.0);
    let params = ModelParams::of_square(0.7, 3.0, 2.06, 0.4, &coupling).unwrap();
    let (footprint, pose) = (BoxFootprint::square(0.4), Pose::default());
    let welcome = Welcome {
        settings: Mode::Recommended.model_settings(coupling),
        state: ModelState::try_new(params, footprint, pose, Twist::default()).unwrap(),
        scheme: Label::clipped("timer 150ms"),
        program: Label::clipped("test"),
    };
    let limiter = ForceLimiter::try_new(Limits::default()).unwrap();
    Master::with_architecture(&welcome, limiter, architecture)
}

fn turn(master: &mut Master, n: u64, hip: Vec2) -> MasterTick {
    master.tick(Time::from_millis(n), hip, Duration::ZERO)
}

fn model_share(master: &Master) -> f64 {
    master.either().unwrap().model_share()
}

fn choice(master: &Master) -> &Choice {
    master.either().unwrap().choice()
}

/// A tool that answers a tick later with a force, and a model that is so wrong.
fn says(tick: u64, force: Vec2, model_error: f64) -> Tool {
    Tool {
        answers: Time::from_millis(tick),
        force: Some(ForceCounts::nearest(force)),
        in_contact: force != Vec2::zeros(),
        in_j: 0.0,
        model_error,
    }
}

/// The west face of the model is at −0.2 m: pushed at 0.1 m/s from 1 cm before it.
fn pushing(tick: u64) -> Vec2 {
    Vec2::new(-0.21 + 1e-4 * tick as f64, 0.0)
}

#[test]
fn without_news_of_the_tool_the_model_is_felt_and_nothing_is_asked_for() {
    let mut master = master(Architecture::Auto);
    for n in 1..3000 {
        let tick = turn(&mut master, n, pushing(n));
        let port = tick.port.unwrap();
        assert!(!port.wants_force && !port.passive_tool);
        assert!(n < 300 || (tick.hand_force + tick.rendered.force).norm() < 1e-12);
    }
    assert_eq!(model_share(&master), 1.0);
}

#[test]
fn the_tools_force_is_faded_in_only_while_it_comes_and_the_tool_is_passive_only_when_it_is_felt_alone()
 {
    let mut master = master(Architecture::Tdpa);
    let tick = turn(&mut master, 1, pushing(1));
    let port = tick.port.unwrap();
    assert!(port.wants_force && !port.passive_tool);
    for n in 2..1000 {
        turn(&mut master, n, pushing(n));
    }
    assert_eq!(model_share(&master), 1.0, "no force came");
    // the hand has pushed for a while and does not let go
    let begins = 100 + u64::from(PATIENCE_TICKS);
    let ends = begins + u64::from(FADE_TICKS);
    for n in 1000..ends + 50 {
        master.hear_tool(Time::from_millis(n), &says(n, Vec2::new(5.0, 0.0), 0.4));
        let tick = turn(&mut master, n, pushing(n));
        assert!(n >= begins - 100 || model_share(&master) == 1.0, "tick {n}");
        assert_eq!(tick.port.unwrap().passive_tool, model_share(&master) == 0.0);
    }
    let tick = turn(&mut master, ends + 50, pushing(ends + 50));
    assert!(tick.port.unwrap().passive_tool);
    assert!(
        (tick.hand_force.x + 5.0).abs() < 0.2,
        "{:?}",
        tick.hand_force
    );
}

#[test]
fn a_fade_changes_the_force_by_no_more_than_its_share_of_the_difference() {
    // a hand at rest in the model by 2 mm, which holds it at 2 N; the tool says 5 N the other way
    let mut master = master(Architecture::Auto);
    let mut last = None;
    let mut seen = (0.0_f64, 0.0_f64);
    for n in 1..50_000 {
        let x = (-0.21 + 1e-4 * n as f64).min(-0.1985);
        let wrong = if n / 12_000 % 2 == 0 { 0.4 } else { 0.01 };
        master.hear_tool(Time::from_millis(n), &says(n, Vec2::new(-5.0, 0.0), wrong));
        let tick = turn(&mut master, n, Vec2::new(x, 0.0));
        let force = tick.hand_force.x;
        seen = (seen.0.min(force), seen.1.max(force));
        if let Some(last) = last.filter(|_| n > 400) {
            let step: f64 = force - last;
            assert!(
                step.abs() <= 8.0 / f64::from(FADE_TICKS),
                "tick {n}: {step} N"
            );
        }
        last = Some(force);
    }
    assert!(choice(&master).switches() >= 3);
    assert!(seen.0 < -1.0 && seen.1 > 4.9, "both were felt: {seen:?}");
}

#[test]
fn no_tool_and_no_switching_gives_the_hand_energy() {
    for seed in 1..=20 {
        let mut draw = Substream::new(seed, "test/either", 0);
        let mut master = master(Architecture::Auto);
        let (mut hip, mut velocity) = (Vec2::new(-0.25, 0.0), Vec2::zeros());
        let mut wrong = 0.4;
        for n in 1..15_000 {
            if n % 200 == 0 {
                let to = Vec2::new(draw.uniform_in(-0.25, -0.15), draw.uniform_in(-0.1, 0.1));
                velocity = (to - hip) / 0.2;
            }
            if n % 700 == 0 {
                wrong = if draw.chance(0.5) { 0.4 } else { 0.01 };
            }
            hip += velocity * TICK_S;
            // a tool that pushes the hand wherever it goes, and says that it took in nothing for it
            let force = -velocity * draw.uniform_in(0.0, 40.0);
            master.hear_tool(Time::from_millis(n), &says(n, force, wrong));
            turn(&mut master, n, hip);
        }
        assert!(choice(&master).switches() > 3);
        // what TDPA's prediction of the velocity is wrong by when the hand turns at once: twice its reserve
        let least_j = master.port().least_j();
        assert!(least_j >= -2.0 * RESERVE_J, "seed {seed}: {least_j} J");
    }
}

#[test]
fn a_model_that_has_taken_nothing_is_not_faded_into_a_hand_that_presses_it_and_is_into_one_that_lets_go()
 {
    // 1 N does not move a box that 2.06 N hold: the model's tank stays empty
    let mut master = master(Architecture::Auto);
    let mut run = |ticks: std::ops::Range<u64>, x: f64, wrong: f64| {
        for n in ticks {
            let near = Vec2::new(x.min(-0.21 + 1e-4 * n as f64), 0.0);
            master.hear_tool(Time::from_millis(n), &says(n, Vec2::zeros(), wrong));
            turn(&mut master, n, near);
        }
        (choice(&master).chosen(), model_share(&master))
    };
    assert_eq!(run(1..8000, -0.199, 0.4), (Chosen::Tdpa, 0.0));
    assert_eq!(run(8000..20_000, -0.199, 0.01), (Chosen::Mediated, 0.0));
    assert_eq!(run(20_000..20_300, -0.21, 0.01), (Chosen::Mediated, 1.0));
}

#[test]
fn the_time_that_samples_wait_for_their_packet_is_no_part_of_a_forces_path() {
    // 4 ms of path, and 9 ms more where the samples come ten to a packet
    let mut master = master(Architecture::Auto).packing(10);
    let rest = Vec2::new(-0.3, 0.0);
    let mut run = |ticks: std::ops::Range<u64>, age_ms: u64, model_error: f64| {
        for n in ticks {
            let news = says(n.saturating_sub(age_ms), Vec2::zeros(), model_error);
            master.hear_tool(Time::from_millis(n), &news);
            turn(&mut master, n, rest);
        }
        choice(&master).round_trip_s().unwrap() * 1e3
    };
    // a model that is right: only its samples are sent
    assert!((run(20..1400, 13, 0.0) - 13.0).abs() < 0.1, "not settled");
    assert!((run(1400..4000, 13, 0.0) - 4.0).abs() < 0.1);
    // one that is wrong: every sample is sent alone, and play-out comes down to it
    assert!((run(4000..5500, 13, 0.4) - 4.0).abs() < 0.1);
    assert!((run(5500..9000, 4, 0.4) - 4.0).abs() < 0.1);
}
