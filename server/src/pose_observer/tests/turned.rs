//! A box that more than the push turns.

use super::*;

/// Pushes the real box with 5 N and a noisy sensor, `aside` (m) of the middle of its face, for so many ticks from `start` on, along a wall that
/// keeps it from turning; vision looks every 33 ms. Returns by how much its angle is off at the most, rad.
fn kept_straight(observer: &mut PoseObserver, aside: f64, start: u32, ticks: u32) -> f64 {
    let mut truth = Pose::new(observer.pose().position.x, 0.0, 0.0);
    let force = Vec2::new(5.0, 0.0);
    let contact = ContactForce {
        noise_n: 0.1,
        ..force.into()
    };
    let mut most = 0.0_f64;
    for n in start + 1..=start + ticks {
        truth.position.x += 1e-4;
        let surface = truth.point_to_world(Vec2::new(-HALF, aside));
        let tool = surface + force / COUPLING.stiffness_n_per_m;
        let now = Time::ZERO + TICK * n;
        observer.step(now, tool, contact, true, &params());
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
    let first = kept_straight(&mut observer, 0.1, 1000, 200);
    assert!(first > 0.05, "{first} rad: by the moment it would turn");
    let then = kept_straight(&mut observer, 0.1, 1200, 300);
    assert!(is_box(&observer));
    assert!(then < 0.03, "{then} rad");
    // in the next contact the push is all again
    let now = Time::ZERO + TICK * 1501;
    observer.step(now, Vec2::new(-1.0, 0.0), Vec2::zeros(), false, &params());
    let Tracker::Box(tracker) = &observer.tracker else {
        unreachable!()
    };
    assert!(tracker.reckons());
}

#[test]
fn the_moment_of_a_push_does_not_turn_what_an_obstacle_holds() {
    let turned = |obstacle: bool| {
        let mut observer = observer(true);
        let truth = push(&mut observer, 1000, 0.0);
        // next to no mass, and more friction than the force
        let held = ModelParams::of_square(0.1, 8.0, 14.0, 2.0 * HALF, &COUPLING).unwrap();
        let force = Vec2::new(12.0, 0.0);
        let mut most = 0.0_f64;
        for n in 1001..=1100_u32 {
            // it slides on along a wall that keeps it from turning
            let centre = truth.position + Vec2::new(1e-4 * f64::from(n - 1000), 0.0);
            let surface = centre + Vec2::new(-HALF, 0.1);
            let contact = ContactForce {
                obstacle,
                ..force.into()
            };
            let tool = surface + force / COUPLING.stiffness_n_per_m;
            observer.step(Time::ZERO + TICK * n, tool, contact, true, &held);
            most = most.max(observer.pose().angle.abs());
        }
        most
    };
    let [reckoned, held] = [false, true].map(turned);
    assert!(held < 2e-3, "{held} rad");
    assert!(reckoned > 10.0 * held, "{reckoned} rad");
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
