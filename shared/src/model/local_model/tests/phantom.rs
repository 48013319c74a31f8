//! What goes at once to where it should be, and costs the hand nothing.

use super::*;
use crate::model::geometry::{Face, rotate};

/// Pushes a model, then sends it an update in which the box has gone so far, m, and is touched so. Returns the model, how far off it
/// is in the next tick and 50 ticks on (m), and what it renders then.
fn after_going(x: f64, y: f64, touched: Option<Face>) -> (LocalModel, [f64; 2], Rendered) {
    let mut model = replayed();
    push(&mut model, 1..=400);
    let mut gone = with(answer(&model, 400), |of| {
        of.pose.position += Vec2::new(x, y);
        of.twist = Twist::default();
    });
    gone.touched_face = touched;
    let wanted = gone.state.pose().position;
    model.apply(&gone);
    let off = |model: &LocalModel| (model.state().pose.position - wanted).norm();
    push(&mut model, 401..=401);
    let at_once = off(&model);
    let felt = push(&mut model, 402..=450);
    let later = off(&model);
    (model, [at_once, later], felt)
}

#[test]
fn what_has_slipped_from_the_hand_is_no_longer_felt_and_the_hand_does_not_hold_it_up() {
    // to the side, clear of the HIP; and back past the HIP
    for (x, y) in [(0.0, 0.25), (-0.45, 0.0), (0.05, -0.3)] {
        let (model, [at_once, _], felt) = after_going(x, y, None);
        assert!(at_once < 1e-9, "{x}, {y}: {at_once}");
        assert!(!felt.in_contact(), "{x}, {y}");
        assert_eq!(model.energy_injected_j(), 0.0);
    }
    // nearer than that, ahead of the push, or with the HIP in it
    let west = Some(Face::West);
    for (x, y, touched) in [(0.0, 0.09, west), (0.15, 0.0, None), (0.0, 0.12, west)] {
        let (model, [at_once, later], _) = after_going(x, y, touched);
        let way = Vec2::new(x, y).norm();
        assert!(
            at_once > 0.9 * way && later > 0.5 * way,
            "{x}, {y}: {at_once}, {later}"
        );
        assert_eq!(model.energy_injected_j(), 0.0);
    }
}

/// Pushes the west face; sends an update of the box that is pushed at `last_ms`, if at all, and at 1220 ms one of a box that has the
/// HIP so deep (m) behind its east face. How far the model is from there in the next tick, m, and the model.
fn after_another(deep: f64, last_ms: Option<u64>) -> (f64, LocalModel) {
    let mut model = replayed();
    push(&mut model, 1..=1200);
    if let Some(ms) = last_ms {
        model.apply(&answer(&model, ms));
    }
    push(&mut model, 1201..=1220);
    let (_, hip) = model.previous.unwrap();
    let mut another = with(answer(&model, 1220), |of| {
        of.pose.position = Vec2::new(hip.x + deep - 0.2, 0.05);
        of.twist = Twist::default();
    });
    another.touched_face = Some(Face::East);
    model.apply(&another);
    push(&mut model, 1221..=1221);
    let off = (model.state().pose.position - another.state.pose().position).norm();
    push(&mut model, 1222..=1222);
    (off, model)
}

#[test]
fn another_object_is_felt_at_once_where_it_is_and_no_harder() {
    let (off, model) = after_another(1e-3, Some(1200));
    assert!(off < 1e-9, "{off}");
    let touch = model.rendered().touch.unwrap();
    assert!(
        touch.inward.x < -0.99 && touch.penetration < 2e-3,
        "{touch:?}"
    );
    assert_eq!(model.energy_injected_j(), 0.0);
    // harder than now; so long ago that the object may have gone there; and no update before
    for (deep, last_ms) in [(6e-3, Some(1200)), (1e-3, Some(400)), (1e-3, None)] {
        let (off, model) = after_another(deep, last_ms);
        assert!(off > 0.3, "{deep} m, {last_ms:?}: {off}");
        assert_eq!(model.energy_injected_j(), 0.0);
    }
}

/// A hand that stands in front of the west face for a while, and how far (m) the box then is in the next tick from where an
/// update has it that is so far off to the side, m.
fn off_in_free_space(to_the_side: f64) -> f64 {
    let mut model = replayed();
    push(&mut model, 1..=400);
    model.apply(&answer(&model, 400));
    let stand = |model: &mut LocalModel, ticks: std::ops::RangeInclusive<u64>| {
        for n in ticks {
            model.step(Time::from_millis(n), Vec2::new(-0.3, 0.0));
        }
    };
    stand(&mut model, 401..=2000);
    let elsewhere = with(answer(&model, 2000), |of| {
        of.pose.position.y += to_the_side;
        of.twist = Twist::default();
    });
    model.apply(&elsewhere);
    stand(&mut model, 2001..=2001);
    assert_eq!(model.energy_injected_j(), 0.0);
    (model.state().pose.position - elsewhere.state.pose().position).norm()
}

#[test]
fn what_is_where_nothing_has_pushed_the_object_is_another_and_is_there_at_once() {
    assert!(off_in_free_space(0.25) < 1e-9);
    // no farther than images and friction may be wrong
    assert!(off_in_free_space(0.09) > 0.08);
}

/// A box of 0.2 m has been touched, and the HIP stands just in front of its west face. Where it is (m) 100 ms after an update that
/// has it at `place` (m).
fn past_the_hip(place: f64) -> f64 {
    let mut model = replayed();
    let held = state(5.0, 3.0, 150.0).into();
    let at = |x: f64| BodyState {
        footprint: BoxFootprint::square(0.2),
        pose: Pose::new(x, 0.0, 0.0),
        ..held
    };
    for n in 1..=800 {
        let hip = match n {
            601..=680 => -0.135,
            681.. => -0.105,
            _ => (-0.3 + 1e-3 * n as f64).min(-0.098),
        };
        if n == 50 {
            model.apply(&update(Cause::Deadband, 49, at(0.0)));
        }
        if n == 700 {
            model.apply(&update(Cause::Deadband, 699, at(place)));
        }
        model.step(Time::from_millis(n), Vec2::new(hip, 0.0));
    }
    assert!(model.energy_injected_j() < 1e-12);
    model.state().pose.position.x
}

#[test]
fn a_hand_that_touches_nothing_does_not_keep_the_box_from_its_place_on_the_other_side() {
    let x = past_the_hip(-0.204);
    assert!((x + 0.204).abs() < 3e-3, "{x}");
    // where the HIP would be deep in it, the hand has run ahead of the box
    let x = past_the_hip(-0.17);
    assert!(x > -0.01, "{x}");
}

/// A HIP stands just in front of the north face of a box of 0.2 m, near its west end. How far (m) the box is from its place, in
/// which that HIP is `deep` (m) in the west face, half a second after it was told.
fn beside_the_hip(deep: f64) -> f64 {
    let mut model = replayed();
    let at = |x: f64, y: f64| BodyState {
        footprint: BoxFootprint::square(0.2),
        pose: Pose::new(x, y, 0.0),
        ..state(5.0, 3.0, 150.0).into()
    };
    let place = at(0.1 - deep, 0.06);
    for n in 1..=1200 {
        if n == 50 {
            model.apply(&update(Cause::Deadband, 49, at(0.05, 0.0)));
        }
        if n == 700 {
            model.apply(&update(Cause::Elsewhere, 699, place));
        }
        model.step(Time::from_millis(n), Vec2::new(0.0, 0.102));
    }
    assert!(model.energy_injected_j() < 1e-12);
    (model.state().pose.position - place.pose.position).norm()
}

#[test]
fn a_box_that_would_have_to_come_round_the_hip_goes_at_once() {
    let off = beside_the_hip(1e-3);
    assert!(off < 3e-3, "{off} m");
    // where the HIP would be deep in it, the hand has run ahead of the box
    let off = beside_the_hip(8e-3);
    assert!(off > 0.05, "{off} m");
}

#[test]
fn a_thin_box_that_goes_at_once_to_the_other_side_of_the_hip_is_not_pressed_through() {
    let mut model = replayed();
    let at = |x: f64| BodyState {
        footprint: BoxFootprint {
            east: 0.01,
            west: 0.01,
            ..BoxFootprint::square(0.4)
        },
        pose: Pose::new(x, 0.0, 0.0),
        ..state(0.7, 3.0, 2.06).into()
    };
    model.body.state = at(0.0);
    model.step(Time::from_millis(1), Vec2::new(-0.0105, 0.0));
    let hip = Vec2::new(-0.0095, 0.0);
    assert!(model.step(Time::from_millis(2), hip).in_contact());
    // the box gives way, and its place has the HIP just inside of the east face
    model.body.state.pose.position.x = 0.55e-3;
    assert!(model.body.touch(hip).is_none());
    model.apply(&update(Cause::Deadband, 2, at(hip.x - 0.0095)));
    model.go_on_replaying();
    let east = model.body.gap(hip);
    assert!(east.0 == Face::East && east.1 > 0.0, "{east:?}");
    let injected = model.energy_injected_j();
    assert!(injected < 1e-9, "{injected} J");
    assert!(model.body.touch(hip).is_none());
}

/// Pushes the west face near its north end, then sends an update in which the HIP is `deep` (m) behind the north face and `aside`
/// (m) behind the west one, and the tool at one of them. What is rendered in the last tick before it is known, and 10 ms and half a
/// second later; the model.
fn near_the_corner(touched: Face, deep: f64, aside: f64) -> ([Rendered; 3], LocalModel) {
    let mut model = replayed();
    let hip = |n: u64| Vec2::new(-0.21 + 1e-4 * n as f64, 0.19);
    let run = |model: &mut LocalModel, ticks: std::ops::RangeInclusive<u64>| {
        let mut last = Rendered::default();
        for n in ticks {
            last = model.step(Time::from_millis(n), hip(n.min(420)));
        }
        last
    };
    let felt = run(&mut model, 1..=400);
    let mut other = with(answer(&model, 400), |of| {
        let hip_in_object = Vec2::new(aside - 0.2, 0.2 - deep);
        of.pose.position = hip(400) - rotate(of.pose.angle, hip_in_object);
        of.twist = Twist::default();
        of.params = state(5.0, 3.0, 20.0).params();
    });
    other.touched_face = Some(touched);
    model.apply(&other);
    let soon = run(&mut model, 401..=410);
    let later = run(&mut model, 411..=900);
    ([felt, soon, later], model)
}

#[test]
fn a_hand_feels_the_face_that_the_object_is_touched_by() {
    // behind the face that was felt, no farther than a soft contact goes, and much farther
    for aside in [0.03, 0.12] {
        for deep in [1e-3, 3e-3] {
            let ([felt, soon, later], model) = near_the_corner(Face::North, deep, aside);
            let pressed = |of: &Rendered| of.touch.map(|touch| (touch.face, touch.penetration));
            let (face, before) = pressed(&felt).unwrap();
            assert_eq!(face, Face::West);
            let (face, now) = pressed(&soon).unwrap();
            assert_eq!(face, Face::North, "{aside} m aside, {deep} m deep");
            assert!(now < before + 5e-4, "{before} m, then {now} m: no jolt");
            let (_, then) = pressed(&later).unwrap();
            assert!((then - deep).abs() < 5e-4, "{then} m, not {deep}");
            assert!(model.energy_injected_j() < 1e-12);
        }
    }
}

#[test]
fn a_hand_that_has_run_into_what_is_held_goes_on_feeling_the_face_that_the_tool_presses_on() {
    // hardly behind the face that is nearer, deep behind both, and deeper behind the one that is pressed on
    for (deep, aside) in [(0.009, 0.1), (0.04, 0.045), (0.058, 0.074)] {
        let ([felt, soon, later], model) = near_the_corner(Face::West, deep, aside);
        let faces = [felt, soon, later].map(|of| of.touch.map(|touch| touch.face));
        assert_eq!(faces, [Some(Face::West); 3], "{deep} m, {aside} m");
        assert!(model.energy_injected_j() < 1e-12);
    }
}
