//! What a correction promises: bounded rates, and nothing for nothing.

use super::*;
use crate::fixtures::COUPLING;
use crate::model::contact::GodObject;
use crate::model::geometry::BoxFootprint;

const HIP: Vec2 = Vec2::new(-0.198, 0.02);

fn touch(pose: &Pose) -> Option<Touch> {
    GodObject::default().follow(&BoxFootprint::square(0.4), pose, HIP)
}

fn bleed(correction: &mut Correction, pose: &mut Pose, ticks: u32) {
    bleed_at(IN_CONTACT, correction, pose, ticks);
}

fn bleed_at(rates: BleedRates, correction: &mut Correction, pose: &mut Pose, ticks: u32) {
    for _ in 0..ticks {
        let touch = touch(pose);
        correction.bleed(pose, touch.as_ref(), &COUPLING, rates);
    }
}

fn aimed(shift: Vec2, turn: f64) -> Correction {
    Correction {
        remaining: PoseChange { shift, turn },
        ..Correction::default()
    }
}

#[test]
fn the_rates_are_bounded() {
    let (mut correction, mut pose) = (aimed(Vec2::new(1.0, 0.0), -3.0), Pose::default());
    let before = pose;
    let touched = touch(&pose);
    correction.bleed(&mut pose, touched.as_ref(), &COUPLING, IN_CONTACT);
    // the shift, and what the turn about the proxy moves the centre by
    let most = IN_CONTACT.shift_m_per_s * TICK_S + IN_CONTACT.turn_rad_per_s * TICK_S * 0.2;
    assert!((pose.position - before.position).norm() <= most);
    assert!((pose.angle - before.angle).abs() <= IN_CONTACT.turn_rad_per_s * TICK_S + 1e-15);
}

#[test]
fn all_of_it_arrives_in_the_end() {
    let (mut correction, mut pose) = (aimed(Vec2::new(0.003, -0.002), 0.02), Pose::default());
    bleed(&mut correction, &mut pose, 2000);
    assert!((pose.position - Vec2::new(0.003, -0.002)).norm() < 1e-6);
    assert!((pose.angle - 0.02).abs() < 1e-6);
}

#[test]
fn motion_towards_the_hip_is_refused_by_an_empty_tank_and_paid_by_a_full_one() {
    let towards = Vec2::new(-0.002, 0.001);
    let depth = |pose: &Pose| touch(pose).unwrap().penetration;
    let (mut correction, mut pose) = (aimed(towards, 0.0), Pose::default());
    let start = depth(&pose);
    bleed(&mut correction, &mut pose, 6000);
    assert!(
        (depth(&pose) - start).abs() < 1e-12,
        "no energy without payment"
    );
    assert!(
        (pose.position.y - 0.001).abs() < 1e-6,
        "along the face is free"
    );

    correction.tank.fill(1.0);
    let full = correction.tank.level_j();
    bleed(&mut correction, &mut pose, 6000);
    let gained = COUPLING.energy(depth(&pose)) - COUPLING.energy(start);
    assert!(depth(&pose) > start + 0.0019);
    assert!(
        (full - correction.tank.level_j() - gained).abs() < 1e-12,
        "paid to the last bit"
    );
}

#[test]
fn along_the_face_a_replayed_correction_is_as_quick_as_an_object_that_slides() {
    let (mut correction, mut pose) = (aimed(Vec2::new(0.0, 0.15), 0.0), Pose::default());
    let depth = touch(&pose).unwrap().penetration;
    bleed_at(IN_CONTACT_REPLAYED, &mut correction, &mut pose, 300);
    assert!(pose.position.y > 0.1, "{}", pose.position.y);
    assert!((touch(&pose).unwrap().penetration - depth).abs() < 1e-12);
}

#[test]
fn turning_about_the_contact_point_stores_no_energy() {
    let (mut correction, mut pose) = (aimed(Vec2::zeros(), 0.2), Pose::default());
    let start = touch(&pose).unwrap().penetration;
    for _ in 0..100 {
        let touch = touch(&pose);
        correction.remaining.shift = Vec2::zeros();
        correction.bleed(&mut pose, touch.as_ref(), &COUPLING, IN_CONTACT);
    }
    assert!(pose.angle > 0.05);
    assert!(touch(&pose).unwrap().penetration <= start + 1e-12);
}

#[test]
fn what_was_corrected_since_the_stamp_is_not_corrected_again() {
    let mut correction = Correction::default();
    let (own, said) = (Pose::default(), Pose::new(0.01, 0.0, 0.1));
    let then = correction.done;
    correction.aim(&said, &own, &then);
    let mut pose = own;
    correction.snap(&mut pose);
    // a second answer to the same old sample carries the same pose again
    correction.aim(&said, &own, &then);
    assert!(correction.remaining.shift.norm() < 1e-15);
    assert!(correction.remaining.turn.abs() < 1e-15);
}

#[test]
fn the_tank_is_bounded_and_pays_only_what_it_holds() {
    let mut tank = Tank::default();
    assert!(!tank.pay(1e-9));
    tank.fill(100.0);
    assert_eq!(tank.level_j(), TANK_MAX_J);
    assert!(!tank.pay(TANK_MAX_J * 1.001));
    assert!(tank.pay(TANK_MAX_J));
    tank.fill(-0.01);
    tank.fill(0.01);
    assert!(!tank.pay(1e-9), "what the ground gave is owed");
}
