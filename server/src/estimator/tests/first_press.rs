//! The first press on an object that nobody has moved.

use super::*;

#[test]
fn the_give_of_a_soft_contact_is_no_motion_of_an_object_that_nobody_has_moved() {
    let mut estimator = recommended(|_| ());
    let mut holding = None;
    for k in 0..100 {
        let depth = 4e-5 * f64::from(k);
        // the contact is softer than the device: the surface seems to give way, at 11 mm/s
        let force = Vec2::new(COUPLING.stiffness_n_per_m * depth / 1.4, 0.0);
        let measured = Measured {
            tool: Vec2::new(depth, 0.0),
            force,
            back: Vec2::zeros(),
            force_noise_n: 0.0,
            normal: Some(Vec2::new(1.0, 0.0)),
            seen: None,
        };
        holding = estimator.step(&measured).holding;
    }
    let most = COUPLING.stiffness_n_per_m * 4e-3 / 1.4;
    assert!(holding.is_some_and(|c| c > 0.8 * most), "{holding:?}");
}
