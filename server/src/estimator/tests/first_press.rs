//! The first press on an object that nobody has moved.

use super::*;

/// A tick of a press on an object that does not move, through a contact of so many times the stiffness that is believed.
fn pressed(force_n: f64, times: f64) -> Measured {
    Measured {
        tool: Vec2::new(force_n / (times * COUPLING.stiffness_n_per_m), 0.0),
        force: Vec2::new(force_n, 0.0),
        back: Vec2::zeros(),
        force_noise_n: 0.0,
        held_back: false,
        normal: Some(Vec2::new(1.0, 0.0)),
        seen: None,
    }
}

#[test]
fn the_give_of_a_soft_contact_is_no_motion_of_an_object_that_nobody_has_moved() {
    let mut estimator = recommended(|_| ());
    let mut holding = None;
    for k in 0..100 {
        // the contact is softer than the device: the surface seems to give way, at 11 mm/s
        let depth = 4e-5 * f64::from(k);
        let force = COUPLING.stiffness_n_per_m * depth / 1.4;
        holding = estimator.step(&pressed(force, 1.0 / 1.4)).holding;
    }
    let most = COUPLING.stiffness_n_per_m * 4e-3 / 1.4;
    assert!(holding.is_some_and(|c| c > 0.8 * most), "{holding:?}");
}

#[test]
fn a_surface_that_seems_to_come_back_as_the_force_rises_is_that_of_a_stiffer_contact_and_teaches_nothing()
 {
    let mut estimator = recommended(|_| ());
    // at 40 mm/s, and the hand trembles
    for k in 0..1500 {
        let tremor = 0.3 * libm::sin(0.06 * f64::from(k));
        let force = (0.048 * f64::from(k)).min(14.4) + tremor;
        estimator.step(&pressed(force.max(0.0), 8.0));
    }
    let found = estimator.estimate();
    assert_eq!(found.samples, 0, "{found:?}");
    assert_eq!(found.holding, Some(OBSTACLE_N));
}

#[test]
fn an_object_that_stands_under_a_trembling_press_stands_although_it_was_seen_to_slide() {
    let (mut estimator, _) = learned(1);
    let known = values(estimator.estimate());
    // the tremor is too quick to stick for 20 ms
    let mut held = 0;
    for k in 0..1500 {
        let tremor = 0.4 * libm::sin(0.15 * f64::from(k));
        let force = (0.048 * f64::from(k)).min(12.0) + tremor;
        estimator.step(&pressed(force.max(0.0), 0.5));
        held += u32::from(estimator.estimate().holding.is_some());
    }
    assert!(held > 900, "{held}");
    // what was learned last returns to a copy of before
    let moved = errors(values(estimator.estimate()), known);
    assert!(moved.iter().all(|moved| *moved < 0.01), "{moved:?}");
}

#[test]
fn what_stood_under_all_that_a_hand_has_is_met_as_it_is_until_it_slides_or_is_seen_elsewhere() {
    let seen_at = |x: f64| {
        let centre = Vec2::new(x, 0.0);
        Some(Seen {
            centre,
            turning: 0.0,
            body_turning: 0.0,
            side: 0.4,
        })
    };
    let press = |force: f64, x: f64| Measured {
        seen: seen_at(x),
        ..pressed(force, 1.0)
    };
    let free = |x: f64| Measured {
        normal: None,
        ..press(0.0, x)
    };
    let mut stood = recommended(|_| ());
    for k in 0..300 {
        stood.step(&press(0.04 * f64::from(k), 0.2));
    }
    assert_eq!(stood.step(&free(0.2)).holding, Some(OBSTACLE_N));
    assert_eq!(stood.step(&press(0.1, 0.2)).holding, Some(OBSTACLE_N));
    // images show it a little beside
    assert_eq!(stood.step(&free(0.203)).holding, Some(OBSTACLE_N));
    // for a moment, as what follows a tool that touches no more
    for _ in 0..100 {
        assert_eq!(stood.step(&free(0.19)).holding, Some(OBSTACLE_N));
    }
    assert_eq!(stood.step(&free(0.2)).holding, Some(OBSTACLE_N));
    // nor does it slide where a tool that goes back reads what a bias leaves of the force
    for k in 0..100 {
        let mut tick = press(0.2, 0.2);
        tick.tool.x -= 1e-4 * f64::from(k);
        assert_eq!(stood.step(&tick).holding, Some(OBSTACLE_N), "{k}");
    }
    assert_eq!(stood.step(&free(0.2)).holding, Some(OBSTACLE_N));
    let mut carried_off = stood.clone();
    for _ in 0..400 {
        carried_off.step(&free(0.21));
    }
    assert_eq!(carried_off.estimate().holding, None);
    assert_eq!(carried_off.step(&press(0.1, 0.21)).holding, None);
    // at 0.1 m/s under 2 N: only another face was held
    let slides = |k: i32| {
        let way = 1e-4 * f64::from(k);
        let mut tick = press(2.0, 0.2);
        tick.tool.x += way;
        tick
    };
    let found = (0..100).find(|k| stood.step(&slides(*k)).holding.is_none());
    assert!(found.is_some_and(|k| k < 50), "{found:?}");
    // pressed by less than a hand has
    let mut weakly = recommended(|_| ());
    for k in 0..150 {
        weakly.step(&press(0.04 * f64::from(k), 0.2));
    }
    assert!(weakly.estimate().holding.is_some());
    assert_eq!(weakly.step(&free(0.2)).holding, None);
}
