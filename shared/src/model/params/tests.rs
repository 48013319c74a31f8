//! The promises of `params`.

use super::*;
use crate::fixtures::COUPLING;
use crate::model::geometry::{Pose, Twist};

#[test]
fn inertia_8_and_torque_9_have_their_closed_forms() {
    assert!((inertia_of_square(0.7, 0.36) - 0.01512).abs() < 1e-12);
    assert!((friction_torque_of_square(1.0, 1.0) - 0.382_598).abs() < 1e-6);
}

#[test]
fn torque_9_equals_its_integral() {
    // midpoint rule over the square, 400 x 400
    let (c, l, n) = (2.06, 0.36, 400);
    let h = l / f64::from(n);
    let mut sum = 0.0;
    for i in 0..n {
        for j in 0..n {
            let x = (f64::from(i) + 0.5) * h - l / 2.0;
            let y = (f64::from(j) + 0.5) * h - l / 2.0;
            sum += c / (l * l) * (x * x + y * y).sqrt() * h * h;
        }
    }
    assert!((friction_torque_of_square(c, l) / sum - 1.0).abs() < 1e-5);
}

#[test]
fn a_model_40_cm_wide_of_a_36_cm_cube_errs_by_23_and_11_percent() {
    assert!((inertia_of_square(0.7, 0.40) / inertia_of_square(0.7, 0.36) - 1.235).abs() < 1e-3);
    assert!(
        (friction_torque_of_square(2.0, 0.40) / friction_torque_of_square(2.0, 0.36) - 1.111).abs()
            < 1e-3
    );
}

#[test]
fn every_number_that_is_not_finite_or_out_of_range_is_named() {
    let good = ModelParams::of_square(0.7, 3.0, 2.06, 0.36, &COUPLING);
    assert!(good.is_ok());
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1.0, f64::MAX] {
        for index in 0..5 {
            let mut a = good.unwrap().to_array();
            a[index] = bad;
            assert!(
                ModelParams::try_new(a[0], a[1], a[2], a[3], a[4], &COUPLING).is_err(),
                "{a:?}"
            );
        }
    }
    let error = ModelParams::of_square(0.01, 0.0, 1.0, 0.36, &COUPLING).unwrap_err();
    assert_eq!(
        error.to_string(),
        "mass 0.01 is outside the accepted range 0.05 to 50 kg"
    );
}

#[test]
fn a_mass_near_the_stability_bound_is_refused_and_blends_of_accepted_sets_are_accepted() {
    let least = least_stable_mass(100.0, &COUPLING);
    assert!(ModelParams::of_square(least * 0.999, 100.0, 1.0, 0.4, &COUPLING).is_err());
    let edge = ModelParams::of_square(least * 1.000_001, 100.0, 1.0, 0.4, &COUPLING).unwrap();
    let far = ModelParams::of_square(5.0, 0.0, 9.0, 0.4, &COUPLING).unwrap();
    for k in 0..=10 {
        let a = edge.blend(&far, f64::from(k) / 10.0).to_array();
        assert!(ModelParams::try_new(a[0], a[1], a[2], a[3], a[4], &COUPLING).is_ok());
    }
}

#[test]
fn the_nearest_state_is_the_same_within_the_ranges_and_on_their_edge_beyond() {
    let params = ModelParams::of_square(0.7, 3.0, 2.06, 0.36, &COUPLING).unwrap();
    let nearest = |pose, twist| {
        ModelState::nearest(params, BoxFootprint::square(0.36), pose, twist, &COUPLING).unwrap()
    };
    let (pose, twist) = (Pose::new(4.99, -4.99, 6282.0), Twist::new(9.0, -9.0, 99.0));
    let inside = ModelState::try_new(params, BoxFootprint::square(0.36), pose, twist, &COUPLING);
    assert_eq!(Ok(nearest(pose, twist)), inside);
    let state = nearest(Pose::new(7.0, -7.0, 1e4), Twist::new(-99.0, 99.0, -1e3));
    assert_eq!(state.pose(), Pose::new(5.0, -5.0, 6283.0));
    assert_eq!(state.twist(), Twist::new(-10.0, 10.0, -100.0));
    let nowhere = Pose::new(f64::NAN, 0.0, 0.0);
    let none = ModelState::nearest(
        params,
        BoxFootprint::square(0.36),
        nowhere,
        twist,
        &COUPLING,
    );
    assert!(none.is_err());
}

#[test]
fn an_inertia_that_is_too_small_for_the_faces_that_were_found_is_the_least_that_is_stable() {
    let params = ModelParams::try_new(0.1, 0.0, 0.4, 4e-4, 0.02, &COUPLING).unwrap();
    let (faces, pose) = (BoxFootprint::square(0.6), Pose::default());
    let exact = ModelState::try_new(params, faces, pose, Twist::default(), &COUPLING);
    assert!(matches!(exact, Err(ParamsError::Unstable { .. })));
    let state = ModelState::nearest(params, faces, pose, Twist::default(), &COUPLING).unwrap();
    let least = least_stable_inertia(&faces, &COUPLING);
    assert_eq!(state.params().to_array(), [0.1, 0.0, 0.4, least, 0.02]);
}
