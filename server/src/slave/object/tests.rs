//! What the estimate of an object promises.

use super::*;
use crate::slave::StartModel;
use mmt_shared::model::geometry::Vec2;

#[test]
fn the_friction_torque_is_accepted_however_large_the_radius_was_learned() {
    assert_eq!(friction_torque(2.0, 0.15), 0.3);
    let coupling = Coupling::for_stiffness(1000.0);
    let e = friction_torque(OBSTACLE_N, 3.0);
    assert!(ModelParams::try_new(1.0, 3.0, OBSTACLE_N, 0.02, e, &coupling).is_ok());
}

#[test]
fn what_is_held_turns_by_9_however_it_turned_where_it_slid() {
    let object = pushed_slowly();
    let slides = *object.estimator.estimate();
    let held = Estimate {
        holding: Some(20.0),
        ..slides
    };
    let e_of = |estimate| object.accept(&estimate, 0.4, false).unwrap().e();
    let radius = object.observer.friction_radius();
    assert_eq!(e_of(slides), object.params.c() * radius);
    assert_eq!(e_of(held), friction_torque_of_square(20.0, 0.4));
}

#[test]
fn a_gain_of_the_sensor_that_is_found_late_multiplies_what_was_learned_before() {
    for gives in [false, true] {
        let mut config = SlaveConfig::of_mode(Mode::Recommended);
        config.tool_compliance = gives.then(|| Coupling::for_stiffness(1200.0));
        let mut object = object_of(&config, 1000.0);
        let of = |object: &ObjectEstimate| {
            let found = object.estimator.estimate();
            [found.m, found.b, found.c]
        };
        let before = of(&object);
        let later = Contact {
            rescaled: 1.25,
            ..contact_with(0)
        };
        object.step(Time::from_millis(1), 1, &later, false);
        assert_eq!(
            of(&object),
            before.map(|value| 1.25 * value),
            "gives: {gives}"
        );
    }
}

#[test]
fn what_pushes_of_one_body_have_shown_predicts_no_contact_with_another() {
    let mut object = pushed_slowly();
    let fresh = format!("{:?}", object.predictor);
    let push = contact_under(4.0);
    object.step(Time::from_millis(1), 1, &push, false);
    assert_ne!(format!("{:?}", object.predictor), fresh);
    assert!(!object.follow_body(&push));
    assert!(object.follow_body(&contact_with(1)));
    assert_eq!(format!("{:?}", object.predictor), fresh);
}

#[test]
fn until_it_slides_an_object_is_as_hard_to_push_as_was_expected() {
    let mut object = pushed_slowly();
    object.step(Time::from_millis(1), 1, &contact_under(1.5), false);
    assert_eq!(object.params.c(), StartModel::default().friction_n);
    object.predictor = Some(ContactPredictor::expecting(Expected {
        point: Vec2::zeros(),
        force: Vec2::new(0.0, 2.5),
    }));
    object.step(Time::from_millis(2), 1, &contact_under(1.5), false);
    assert_eq!(object.params.c(), 2.5);
    // 2 mm later it slides, and the measured force counts
    let slid = Contact {
        tool: Vec2::new(0.002, 0.0),
        ..contact_under(1.5)
    };
    object.step(Time::from_millis(3), 1, &slid, false);
    assert_eq!(object.params.c(), 1.5);
}

fn pushed_slowly() -> ObjectEstimate {
    let config = SlaveConfig {
        estimator: Some(EstimatorConfig::QuasiStatic(Default::default())),
        ..SlaveConfig::of_mode(Mode::Recommended)
    };
    object_of(&config, 1000.0)
}

/// At the prior, for a device that renders `k_p` (N/m).
fn object_of(config: &SlaveConfig, k_p: f64) -> ObjectEstimate {
    let coupling = Coupling::for_stiffness(k_p);
    ObjectEstimate::try_new(config, coupling, Pose::default(), Vec::new()).unwrap()
}

/// A contact under so many N along x.
fn contact_under(force_n: f64) -> Contact {
    let force = Vec2::new(force_n, 0.0);
    Contact {
        force,
        steady: force,
        in_contact: true,
        ..contact_with(0)
    }
}

fn contact_with(body: usize) -> Contact {
    let none = Vec2::zeros();
    Contact {
        tool: none,
        back: none,
        force: none,
        steady: none,
        noise_n: 0.0,
        in_contact: false,
        rescaled: 1.0,
        averaged: 1,
        vision: None,
        true_force: none,
        truth: Pose::default(),
        body,
    }
}

/// What becomes of an estimate of m (kg), b (N s/m) and 5 N of friction, or of `holding` N that hold the object.
fn accepted(mode: Mode, k_p: f64, [m, b]: [f64; 2], holding: Option<f64>) -> Option<ModelParams> {
    let object = object_of(&SlaveConfig::of_mode(mode), k_p);
    let estimate = Estimate {
        m,
        b,
        c: 5.0,
        holding,
        ..*object.estimator.estimate()
    };
    object.accept(&estimate, 0.36, false)
}

#[test]
fn friction_is_not_withheld_because_the_mass_came_out_too_light_for_the_coupling() {
    let light = [0.05, 0.0];
    for k_p in [300.0, 1000.0, 3000.0] {
        let params = accepted(Mode::Recommended, k_p, light, None).unwrap();
        assert_eq!(params.c(), 5.0, "{k_p} N/m");
        assert!(params.m() >= 0.05);
    }
    assert_eq!(accepted(Mode::Paper, 3000.0, light, None), None);
}

#[test]
fn what_holds_an_object_is_told_although_mass_or_damping_came_out_as_no_object_has_them() {
    let last = StartModel::default();
    for found in [[113.6, 3.0], [0.7, 300.0], [0.7, -1.0]] {
        let held = accepted(Mode::Recommended, 1000.0, found, Some(150.0)).unwrap();
        assert_eq!(held.c(), 150.0, "{found:?}");
        let others = [held.m(), held.b()];
        assert_eq!(others, [last.mass_kg, last.damping_ns_per_m], "{found:?}");
        assert_eq!(accepted(Mode::Recommended, 1000.0, found, None), None);
    }
}
