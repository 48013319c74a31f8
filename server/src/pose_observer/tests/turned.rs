//! A box that more than the push turns.

use super::*;

/// Pushes the real box 0.1 m beside the middle of its face, for so many ticks from `start` on, along a wall that keeps it from
/// turning; `params` are what it is believed to have, and vision looks every 33 ms. Returns by how much its angle is off at the
/// most, rad.
fn kept_straight(
    observer: &mut PoseObserver,
    contact: ContactForce,
    params: &ModelParams,
    start: u32,
    ticks: u32,
) -> f64 {
    let mut truth = Pose::new(observer.pose().position.x, 0.0, 0.0);
    let mut most = 0.0_f64;
    for n in start + 1..=start + ticks {
        truth.position.x += 1e-4;
        let surface = truth.point_to_world(Vec2::new(-HALF, 0.1));
        let tool = surface + contact.force / COUPLING.stiffness_n_per_m;
        let now = Time::ZERO + TICK * n;
        observer.step(now, tool, contact, true, params);
        if n % 33 == 0 {
            observer.see(&VisionSample {
                taken: now,
                pose: truth,
            });
        }
        most = most.max(observer.pose().angle.abs());
    }
    most
}

fn is_box(observer: &PoseObserver) -> bool {
    matches!(observer.tracker, Tracker::Box(_))
}

#[test]
fn a_box_that_a_wall_keeps_from_turning_stays_a_box_and_is_followed() {
    let mut observer = observer(true);
    push(&mut observer, 1000, 0.0);
    let noisy = ContactForce {
        noise_n: 0.1,
        ..Vec2::new(5.0, 0.0).into()
    };
    let first = kept_straight(&mut observer, noisy, &params(), 1000, 200);
    assert!(first > 0.05, "{first} rad: by the moment it would turn");
    let then = kept_straight(&mut observer, noisy, &params(), 1200, 300);
    assert!(is_box(&observer));
    assert!(then < 0.03, "{then} rad");
    let reckons = |observer: &PoseObserver| match &observer.tracker {
        Tracker::Box(tracker) => tracker.reckons(),
        _ => false,
    };
    assert!(!reckons(&observer));
    // in the next contact the push is all again
    let now = Time::ZERO + TICK * 1501;
    observer.step(now, Vec2::new(-1.0, 0.0), Vec2::zeros(), false, &params());
    assert!(reckons(&observer));
}

#[test]
fn the_moment_of_a_push_does_not_turn_what_an_obstacle_holds() {
    let turned = |obstacle: bool| {
        let mut observer = observer(true);
        push(&mut observer, 1000, 0.0);
        // next to no mass, and more friction than the force
        let held = ModelParams::of_square(0.1, 8.0, 14.0, 2.0 * HALF, &COUPLING).unwrap();
        let contact = ContactForce {
            obstacle,
            ..Vec2::new(12.0, 0.0).into()
        };
        kept_straight(&mut observer, contact, &held, 1000, 100)
    };
    let [reckoned, held] = [false, true].map(turned);
    assert!(held < 2e-3, "{held} rad");
    assert!(reckoned > 5.0 * held, "{reckoned} rad");
}

#[test]
fn what_is_left_of_the_bias_does_not_turn_a_body_that_is_let_go() {
    let mut observer = observer(true);
    let (centre, normal) = push_disc(&mut observer, -0.15, 0.0, 1000);
    assert!(!is_box(&observer));
    let inward = rotate(normal, Vec2::new(1.0, 0.0));
    for n in 1001..=1020_u32 {
        // the force goes back to nothing, and 80 mN of bias across it remain
        let left = 2.36 * f64::from(1020 - n) / 20.0;
        let force = inward * left;
        let tool = centre - inward * HALF + force / COUPLING.stiffness_n_per_m;
        let felt = force + Vec2::new(-inward.y, inward.x) * 0.08;
        observer.step(Time::ZERO + TICK * n, tool, felt, true, &params());
    }
    let turned = wrap_angle(observer.pose().angle - normal);
    assert!(turned.abs() < 0.1, "{turned} rad");
}
