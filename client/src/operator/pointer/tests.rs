//! What a person at a pointer is promised.

use super::*;
use crate::operator::scripted::ScriptedConfig;
use mmt_shared::model::geometry::{BoxFootprint, Pose};

fn view() -> View {
    View {
        pose: Pose::default(),
        footprint: BoxFootprint::square(0.4),
        in_contact: false,
    }
}

fn person(driver: Driver) -> Person {
    let scripted = Scripted::try_new(ScriptedConfig::default(), view()).unwrap();
    Person::new(scripted, driver, HandTuning::POINTER)
}

fn ms(n: u64) -> Duration {
    Duration::from_millis(n)
}

/// The page's clock is far from the loop's, and readings arrive 2 ms after their stamp.
fn reading(at: Duration, x: f64) -> PointerSample {
    PointerSample {
        page_s: 777.0 + at.as_secs_f64() - 0.002,
        at: Vec2::new(x, 0.4),
    }
}

/// Steps over these ticks, with a reading every eighth, at `x` of the tick.
fn push(person: &mut Person, ticks: std::ops::Range<u64>, x: impl Fn(u64) -> f64) -> Vec2 {
    for n in ticks {
        if n % 8 == 0 {
            person.handle(ms(n), HandEvent::Move(reading(ms(n), x(n))));
        }
        person.step(ms(n), &view(), Vec2::zeros());
    }
    person.hip()
}

#[test]
fn a_press_engages_where_the_hip_is_and_the_way_of_the_pointer_is_the_way_of_the_hip() {
    let mut person = person(Driver::Pointer);
    let start = person.hip();
    assert!(!person.engaged(), "nobody presses");
    person.handle(ms(0), HandEvent::Press(reading(ms(0), 0.9)));
    assert!(person.engaged());
    assert_eq!(person.step(ms(0), &view(), Vec2::zeros()), start, "no jump");
    let end = push(&mut person, 1..1000, |n| 0.9 + 1e-4 * n.min(500) as f64);
    assert!((end - start - Vec2::new(0.05, 0.0)).norm() < 1e-4, "{end}");
}

#[test]
fn a_steady_way_is_played_behind_playout_and_filter_without_a_ripple() {
    let mut person = person(Driver::Pointer);
    let start = person.hip();
    person.handle(ms(0), HandEvent::Press(reading(ms(0), 0.0)));
    let mut last = push(&mut person, 0..1000, |n| 1e-4 * n as f64);
    for n in 1000..1200 {
        let hip = push(&mut person, n..n + 1, |n| 1e-4 * n as f64);
        let speed = (hip - last).x / 1e-3;
        assert!((speed - 0.1).abs() < 0.002, "{speed} m/s");
        last = hip;
    }
    // 24 ms of play-out and 27 ms of the filter, less the tick that it is read at
    let lag_ms = (0.1 * 1.199 - (last - start).x) / 1e-4;
    assert!((48.5..50.5).contains(&lag_ms), "{lag_ms}");
}

#[test]
fn a_hand_that_lets_go_is_released_and_the_hip_stays() {
    let mut person = person(Driver::Pointer);
    person.handle(ms(0), HandEvent::Press(reading(ms(0), 0.0)));
    let held = push(&mut person, 0..500, |n| 2e-4 * n as f64);
    person.handle(ms(500), HandEvent::Release);
    assert!(!person.engaged());
    let later = push(&mut person, 500..1000, |_| 5.0);
    assert_eq!(
        later, held,
        "readings of a pointer that is not pressed move nothing"
    );
    person.handle(ms(1000), HandEvent::Press(reading(ms(1000), -3.0)));
    let again = person.step(ms(1000), &view(), Vec2::zeros());
    assert_eq!(again, held, "a new press engages where the HIP is");
}

#[test]
fn silence_of_120_ms_releases_and_one_tick_less_does_not() {
    let mut person = person(Driver::Pointer);
    person.handle(ms(50), HandEvent::Press(reading(ms(50), 0.0)));
    for n in 50..170 {
        person.step(ms(n), &view(), Vec2::zeros());
        assert!(person.engaged(), "tick {n}");
    }
    person.step(ms(170), &view(), Vec2::zeros());
    assert!(!person.engaged());
}

#[test]
fn a_press_takes_over_from_the_script_and_the_script_goes_on_from_the_hip() {
    let mut person = person(Driver::Scripted);
    assert!(person.engaged());
    let mut last = person.hip();
    for n in 0..500 {
        last = person.step(ms(n), &view(), Vec2::zeros());
    }
    assert_ne!(last, view().pose.position);
    person.handle(ms(500), HandEvent::Press(reading(ms(500), 0.0)));
    assert_eq!(person.driver(), Driver::Pointer);
    let pushed = push(&mut person, 500..900, |_| 0.02);
    assert!((pushed - last).norm() > 0.015);
    person.handle(ms(900), HandEvent::Drive(Driver::Scripted));
    let mut before = pushed;
    for n in 900..2000 {
        let hip = person.step(ms(n), &view(), Vec2::zeros());
        assert!((hip - before).norm() < 1e-3, "the HIP never jumps");
        before = hip;
    }
    assert!((before - pushed).norm() > 0.01, "it works again");
}

#[test]
fn a_pause_holds_the_hip_without_force_and_a_press_does_not_end_it() {
    let mut person = person(Driver::Scripted);
    let held = person.step(ms(0), &view(), Vec2::zeros());
    person.handle(ms(1), HandEvent::Pause(true));
    person.handle(ms(2), HandEvent::Press(reading(ms(2), 0.0)));
    assert!(!person.engaged());
    assert_eq!(push(&mut person, 2..300, |n| 1e-3 * n as f64), held);
    person.handle(ms(300), HandEvent::Pause(false));
    assert!(person.engaged());
}

#[test]
fn what_is_not_finite_is_not_taken_and_the_reach_is_kept() {
    let mut person = person(Driver::Pointer);
    person.handle(ms(0), HandEvent::Clock(f64::NAN));
    person.handle(ms(0), HandEvent::Press(reading(ms(0), f64::NAN)));
    assert!(!person.engaged());
    person.handle(ms(0), HandEvent::Press(reading(ms(0), 0.0)));
    person.handle(ms(1), HandEvent::Move(reading(ms(1), f64::INFINITY)));
    let far = push(&mut person, 0..8000, |_| 1e9);
    assert!((far.x - REACH_M).abs() < 1e-9, "{far}");
}

#[test]
fn another_page_has_another_clock() {
    let mut person = person(Driver::Pointer);
    person.handle(ms(0), HandEvent::Clock(1e6));
    person.handle(ms(1), HandEvent::NewPage);
    person.handle(ms(2), HandEvent::Press(reading(ms(2), 0.0)));
    let start = person.hip();
    let end = push(&mut person, 3..500, |_| 0.03);
    assert!((end.x - start.x - 0.03).abs() < 1e-3, "{end}");
}

#[test]
fn a_device_without_the_low_pass_is_followed_its_play_out_later() {
    let scripted = Scripted::try_new(ScriptedConfig::default(), view()).unwrap();
    let tuning = HandTuning {
        playout_s: 0.002,
        low_pass: false,
        silence: ms(40),
    };
    let mut person = Person::new(scripted, Driver::Pointer, tuning);
    let start = person.hip();
    person.handle(ms(0), HandEvent::Press(reading(ms(0), 0.0)));
    for n in 0..=500 {
        person.handle(ms(n), HandEvent::Move(reading(ms(n), 1e-4 * n as f64)));
        person.step(ms(n), &view(), Vec2::zeros());
    }
    // the stamps are 2 ms old when they arrive, and as much is the play-out
    let lag_ms = (0.05 - (person.hip() - start).x) / 1e-4;
    assert!((1.9..2.2).contains(&lag_ms), "{lag_ms}");
    person.step(ms(539), &view(), Vec2::zeros());
    assert!(person.engaged(), "one tick before its silence");
    person.step(ms(540), &view(), Vec2::zeros());
    assert!(!person.engaged());
}
