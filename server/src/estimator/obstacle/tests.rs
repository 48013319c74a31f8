//! What is taken for an obstacle, and what is not.

use super::*;

const C: Friction = Friction {
    c: 2.0,
    known: true,
    seen: true,
    share: 1.0,
};
const HAND: Hand = Hand {
    force_max_n: 8.0,
    device_n_per_m: 1000.0,
};
const UNKNOWN: Friction = Friction {
    c: 1.0,
    known: false,
    seen: false,
    share: 1.0,
};

/// Presses from 0 to `most` N at a rate in N/ms, then holds it for 100 ticks.
fn press(rate: f64, most: f64) -> Obstacle {
    let mut obstacle = Obstacle::new(HAND);
    let rise = (most / rate) as u32;
    for n in 0..rise + 100 {
        obstacle.step(
            ((rate * f64::from(n)).min(most), false),
            0.0,
            MotionState::Sticks,
            0,
            C,
        );
    }
    obstacle
}

#[test]
fn what_friction_holds_is_no_obstacle_and_more_is() {
    assert_eq!(press(0.02, 1.25 * C.c).holding(), None);
    let held = press(0.02, 5.0).holding().unwrap();
    assert!(held > 5.0 / 0.8 && held <= 10.0, "{held}");
    assert_eq!(press(10.0, 1000.0).holding(), Some(150.0));
}

#[test]
fn friction_that_is_not_known_is_at_least_the_force_and_what_no_hand_moves_is_held() {
    let mut obstacle = Obstacle::new(HAND);
    let mut press = |force, motion, friction| {
        (0..20).for_each(|_| {
            obstacle.step((force, false), 0.0, motion, 0, friction);
        });
        obstacle.holding()
    };
    assert_eq!(press(1.5, MotionState::Sticks, UNKNOWN), None);
    assert_eq!(press(2.0, MotionState::Sticks, UNKNOWN), Some(2.0));
    assert_eq!(press(5.0, MotionState::Sticks, UNKNOWN), Some(5.0));
    assert_eq!(press(4.0, MotionState::Sticks, UNKNOWN), Some(5.0));
    let broken_away = press(4.0, MotionState::Slides, UNKNOWN);
    assert_eq!(broken_away, Some(5.0), "until its own friction is seen");
    let seen = Friction {
        seen: true,
        ..UNKNOWN
    };
    assert_eq!(press(4.0, MotionState::Slides, seen), None);
    assert_eq!(press(9.0, MotionState::Sticks, seen), Some(OBSTACLE_N));
}

#[test]
fn what_stands_12_mm_deep_in_front_of_a_soft_device_is_held_unless_its_friction_is_known() {
    let soft = Hand {
        device_n_per_m: 300.0,
        ..HAND
    };
    for (friction, force, held) in [
        (UNKNOWN, 3.5, Some(3.5)),
        (UNKNOWN, 3.8, Some(OBSTACLE_N)),
        (C, 3.8, Some(2.0 * 3.8)),
    ] {
        let mut obstacle = Obstacle::new(soft);
        for _ in 0..20 {
            obstacle.step((force, false), 0.0, MotionState::Sticks, 0, friction);
        }
        assert_eq!(obstacle.holding(), held);
    }
}

#[test]
fn what_broke_away_was_held_by_no_more_than_the_force_before_that_could_be_seen() {
    let mut obstacle = Obstacle::new(HAND);
    let mut press = |n: u32, motion| {
        obstacle.step((0.1 * f64::from(n), false), 0.0, motion, 0, UNKNOWN);
        obstacle.holding()
    };
    for n in 0..60 {
        press(n, MotionState::Sticks);
    }
    assert_eq!(press(60, MotionState::Slowly), Some(6.0));
    let unseen = UNSEEN_TICKS as u32;
    for n in 61..100 {
        let held = press(n, MotionState::Slides);
        assert_eq!(held, Some(0.1 * f64::from(61 - unseen)));
    }
}

#[test]
fn what_is_pressed_and_has_not_gone_on_for_250_ms_stands_however_it_trembles_until_it_goes_on() {
    let mut obstacle = Obstacle::new(HAND);
    let trembles = |n: u32| match n % 10 {
        0..5 => MotionState::Sticks,
        _ => MotionState::Slides,
    };
    for n in 0..250 {
        obstacle.step((5.0, false), 0.0, trembles(n), n, C);
        assert_eq!(obstacle.holding(), None, "{n}");
    }
    for n in 250..300 {
        obstacle.step((5.0, false), 0.0, trembles(n), n, C);
        assert!(obstacle.holding().is_some(), "{n}");
    }
    obstacle.step((5.0, false), 0.0, MotionState::Slides, 0, C);
    assert_eq!(obstacle.holding(), None);
    // one that friction holds may tremble as long as it likes
    for n in 0..1000 {
        obstacle.step((1.25 * C.c, false), 0.0, trembles(n), n, C);
        assert_eq!(obstacle.holding(), None);
    }
}

#[test]
fn a_surface_stays_where_it_is_until_it_has_gone_1_25_mm_along_the_normal() {
    let mut stays = Stays::default();
    let normal = Vec2::new(1.0, 0.0);
    let mut at = |x: f64, y: f64| stays.step(Vec2::new(x, y), normal);
    assert_eq!(at(0.0, 0.0), 0);
    for n in 1..=100 {
        let x = 1.2e-3 * libm::sin(f64::from(n));
        assert_eq!(at(x, 1e-3 * f64::from(n)), n);
    }
    assert_eq!(at(1.3e-3, 0.1), 0);
    assert_eq!(at(0.1e-3, 0.1), 1);
    assert_eq!(at(0.0, 0.1), 0);
}

#[test]
fn static_friction_that_gives_way_within_20_ms_is_no_obstacle() {
    let mut obstacle = Obstacle::new(HAND);
    for _ in 0..19 {
        assert!(!obstacle.step((1.5 * C.c, false), 0.0, MotionState::Sticks, 0, C));
    }
    obstacle.step((1.5 * C.c, false), 0.0, MotionState::Slides, 0, C);
    assert!(!obstacle.step((1.5 * C.c, false), 0.0, MotionState::Sticks, 0, C));
    assert_eq!(obstacle.holding(), None);
}

#[test]
fn what_stands_under_all_that_the_tool_presses_with_is_held_whatever_its_friction_is_taken_for() {
    let taken_for = Friction { c: 14.0, ..C };
    for (held_back, holding) in [(false, None), (true, Some(OBSTACLE_N))] {
        let mut obstacle = Obstacle::new(HAND);
        for _ in 0..HOLD_TICKS {
            let pressed = (14.4, held_back);
            obstacle.step(pressed, 0.0, MotionState::Sticks, 0, taken_for);
        }
        assert_eq!(obstacle.holding(), holding);
    }
}

#[test]
fn a_noisy_speed_does_not_end_it_and_sliding_does() {
    let mut obstacle = press(0.02, 5.0);
    obstacle.step((5.0, false), 0.0, MotionState::Slowly, 0, C);
    assert!(obstacle.holding().is_some());
    obstacle.step((5.0, false), 0.0, MotionState::Slides, 0, C);
    assert_eq!(obstacle.holding(), None);
}

#[test]
fn an_object_that_moves_on_under_a_force_beyond_any_push_has_hit_something() {
    let mut obstacle = Obstacle::new(HAND);
    for (force, sent) in [(3.0 * C.c + 1.0, None), (10.0, Some(10.0))] {
        for _ in 0..5 {
            assert!(!obstacle.step((force, false), 0.0, MotionState::SlidesOn, 0, C));
        }
        assert_eq!(obstacle.holding(), sent);
    }
    obstacle.step((2.0, false), 0.0, MotionState::SlidesOn, 0, C);
    assert_eq!(obstacle.holding(), None);
    for _ in 0..5 {
        obstacle.step((10.0, false), 5.0, MotionState::SlidesOn, 0, C);
        obstacle.step((10.0, false), 0.0, MotionState::Slides, 0, C);
    }
    assert_eq!(obstacle.holding(), None, "a quick hand is no obstacle");
}
