//! A force that is not normal to the face: the tool rubs.

use super::*;

/// Pushes the real box for so many seconds with a force that is turned by `error` (rad) from the normal of the face and passes the
/// centre at `aside` (m), so that the box turns; vision looks every 33 ms of the first `seen_s` seconds and is off by 5 mrad either
/// way. Returns how far the box is taken to be turned too far, rad: the mean of the last half second.
fn turned_by(
    observer: &mut PoseObserver,
    error: f64,
    aside: f64,
    seconds: u32,
    seen_s: u32,
) -> f64 {
    let mut truth = Motion::default();
    let mut too_far = 0.0;
    observer.faces = FaceMap::new(BoxFootprint::square(2.0 * HALF), None);
    let contact = Vec2::new(-HALF, aside - HALF * libm::tan(error));
    for n in 1..=seconds * 1000 {
        let inward = rotate(truth.pose.angle, Vec2::new(1.0, 0.0));
        let force = rotate(error, inward) * 2.6;
        let surface = truth.pose.point_to_world(contact);
        let tool = surface + inward * (inward.dot(&force) / COUPLING.stiffness_n_per_m);
        let now = Time::ZERO + TICK * n;
        observer.step(now, tool, force, true, &params());
        if n > seconds * 1000 - 500 {
            too_far += wrap_angle(observer.pose().angle - truth.pose.angle);
        }
        if n % 33 == 0 && n < seen_s * 1000 {
            let off = if n % 66 == 0 { 5e-3 } else { -5e-3 };
            let pose = Pose {
                angle: truth.pose.angle + off,
                ..truth.pose
            };
            observer.see(&VisionSample { taken: now, pose });
        }
        let lever = rotate(truth.pose.angle, contact);
        truth = truth.step(FrictionLaw::LimitSurface, &params(), force, lever);
    }
    assert_eq!(truth.pose.angle.abs() > 0.2, aside != 0.0, "{truth:?}");
    too_far / 500.0
}

/// An observer whose tool has at most this friction.
fn with_friction(friction: f64) -> PoseObserver {
    let mut observer = observer(true);
    observer.config.tool_friction = friction;
    observer
}

#[test]
fn a_tool_that_rubs_turns_no_box_that_is_seen() {
    for (error, friction) in [(0.05, 0.05), (-0.04, 0.05), (0.2, 0.2)] {
        let turned = turned_by(&mut with_friction(friction), error, 0.0, 2, 2);
        assert!(turned.abs() < 5e-3, "{error}: {turned}");
    }
    // a tool that rubs and is taken for smooth turns the box
    let turned = turned_by(&mut with_friction(0.0), 0.04, 0.0, 2, 2);
    assert!(turned > 0.03, "{turned}");
}

#[test]
fn a_box_that_turns_under_a_tool_that_rubs_is_followed() {
    let turned = turned_by(&mut with_friction(0.05), 0.05, 0.015, 2, 2);
    assert!(turned.abs() < 5e-3, "{turned}");
}

#[test]
fn a_smooth_tool_that_is_taken_for_rough_turns_no_box_either() {
    let turned = turned_by(&mut with_friction(0.05), 0.0, 0.015, 2, 2);
    assert!(turned.abs() < 5e-3, "{turned}");
}

#[test]
fn without_images_the_force_is_taken_for_normal() {
    for seen_s in [0, 1] {
        let turned = turned_by(&mut with_friction(0.2), 0.04, 0.0, 8, seen_s);
        assert!((turned - 0.04).abs() < 5e-3, "{seen_s}: {turned}");
    }
}

#[test]
fn a_force_that_is_turned_by_more_than_the_friction_is_of_no_box() {
    for (error, is_box) in [(0.2, true), (0.3, false)] {
        let mut observer = with_friction(0.2);
        turned_by(&mut observer, error, 0.0, 1, 1);
        let still = matches!(observer.tracker, Tracker::Box(_));
        assert_eq!(still, is_box, "{error}");
        // the force is normal to a tangent
        assert_eq!(observer.angle.error() != 0.0, is_box, "{error}");
    }
}

#[test]
fn an_error_of_the_direction_is_forgotten_with_the_contact() {
    let mut observer = with_friction(0.05);
    turned_by(&mut observer, 0.05, 0.0, 2, 2);
    assert!((observer.angle.error() - 0.05).abs() < 5e-3);
    observer.step(
        Time::from_millis(2001),
        Vec2::zeros(),
        Vec2::zeros(),
        false,
        &params(),
    );
    assert_eq!(observer.angle.error(), 0.0);
}

#[test]
fn the_first_force_of_a_rough_tool_turns_no_box_that_was_seen() {
    let mut observer = with_friction(0.2);
    let (tool, force) = (Vec2::new(-HALF, 0.0), rotate(0.2, Vec2::new(2.6, 0.0)));
    for n in 1..=110 {
        let now = Time::from_millis(n);
        let in_contact = n > 100;
        let felt = if in_contact { force } else { Vec2::zeros() };
        observer.step(now, tool, felt, in_contact, &params());
        if n % 33 == 0 {
            let pose = Pose::default();
            observer.see(&VisionSample { taken: now, pose });
        }
    }
    let turned = observer.pose().angle;
    assert!(turned.abs() < 5e-3, "{turned}");
}
