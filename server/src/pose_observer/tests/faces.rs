//! Where the faces are: by touch, by images, and by a tool that gives.

use super::*;

#[test]
fn touch_and_vision_teach_the_offset_of_a_face_and_the_others_guess_by_it() {
    let mut observer = observer(true);
    let truth = push(&mut observer, 1000, 0.0);
    let footprint = observer.footprint();
    assert!((footprint.west - HALF).abs() < 1e-4, "{footprint:?}");
    assert_eq!(
        footprint.north, footprint.west,
        "the first face is the best guess for the others"
    );
    assert!((observer.pose().position - truth.position).norm() < 3e-4);
    assert!((observer.twist().linear.x - 0.1).abs() < 0.01);
}

#[test]
fn a_tool_that_gives_farther_than_the_model_renders_teaches_the_offset_as_it_is() {
    for beyond_m in [2e-3, -1e-3] {
        let mut observer = observer(true);
        let truth = push_beyond(&mut observer, 1000, 0.0, beyond_m);
        let offset = observer.footprint().west;
        assert!((offset - HALF).abs() < 1e-4, "{offset} m");
        // the model's spring pushes as hard only if its face is so much farther
        let ahead = observer.pose().position.x - truth.position.x;
        assert!((ahead - beyond_m).abs() < 2e-4, "{ahead} m");
    }
}

/// Lets the tool run into a box at rest at 0.1 m/s; returns the offset of the face after the first tick of contact.
fn offset_at_first_touch() -> f64 {
    let mut observer = observer(true);
    let Coupling {
        stiffness_n_per_m,
        damping_ns_per_m,
    } = COUPLING;
    for n in 0..20 {
        // 0.05 mm into the face in tick 10
        let depth = 1e-4 * (f64::from(n) - 9.5);
        let tool = Vec2::new(-HALF + depth, 0.0);
        let touching = depth > 0.0;
        let force = if touching {
            stiffness_n_per_m * depth + damping_ns_per_m * 0.1
        } else {
            0.0
        };
        let now = Time::ZERO + TICK * n;
        observer.step(now, tool, Vec2::new(force, 0.0), touching, &params());
        if touching {
            break;
        }
    }
    observer.footprint().west
}

#[test]
fn the_first_touch_of_a_box_at_rest_teaches_the_offset_of_its_face() {
    let offset = offset_at_first_touch();
    assert!((offset - HALF).abs() < 2e-4, "{offset} m");
}

#[test]
fn the_paper_keeps_its_side_and_finds_the_plane_of_the_face() {
    let mut observer = observer(false);
    let truth = push(&mut observer, 1000, 0.0);
    assert_eq!(observer.footprint(), BoxFootprint::square(0.40));
    // the plane of the face is right, so the centre is 2 cm too far
    assert!((observer.pose().position.x - truth.position.x - 0.02).abs() < 2e-4);
}

#[test]
fn in_the_paper_the_tool_touches_a_face_between_its_ends_however_far_off_the_centre_was_taken_to_be()
 {
    let mut observer = observer(false);
    // the west face, 0.25 m from its middle, where a face of 0.40 m ends at 0.2 m
    let tool = Vec2::new(-0.198, 0.25);
    for n in 1..=20 {
        let now = Time::ZERO + TICK * n;
        observer.step(now, tool, Vec2::new(2.36, 0.0), true, &params());
    }
    let touched = observer.pose().point_to_object(tool);
    assert!((touched.y - 0.2).abs() < 1e-9, "{touched}");
    assert!((observer.pose().position.y - 0.05).abs() < 1e-9);
    // the plane is where it was felt all the same
    assert!(
        (touched.x + 0.2 - 2.36 / COUPLING.stiffness_n_per_m).abs() < 1e-3,
        "{touched}"
    );
}

#[test]
fn an_unknown_face_is_retracted_in_growing_steps_and_a_known_one_stays() {
    let mut unknown = observer(true);
    let mut depths = Vec::new();
    for _ in 0..3 {
        let face = -unknown.footprint().west;
        unknown.retract_face(Vec2::new(face + 1e-3, 0.0), Face::West);
        depths.push(-face - unknown.footprint().west);
    }
    assert!((depths[0] - 2e-3).abs() < 1e-12 && depths[1] > depths[0] && depths[2] > depths[1]);
    assert_eq!(unknown.pose(), Pose::default());

    let mut known = observer(true);
    let truth = push(&mut known, 1000, 0.0);
    let footprint = known.footprint();
    let inside = truth.position + Vec2::new(-HALF + 2e-3, 0.0);
    known.retract_face(inside, Face::West);
    assert_eq!(known.footprint(), footprint);
    assert!(
        known.pose().position.x > truth.position.x + 2e-3,
        "the box is further away"
    );
}

#[test]
fn a_box_that_the_tool_has_left_by_another_face_is_neither_moved_nor_changed() {
    for learn in [true, false] {
        let mut left = observer_of(true, learn);
        let truth = push(&mut left, 1000, 0.0);
        let (pose, footprint) = (left.pose(), left.footprint());
        for beyond in [Vec2::new(0.25, 0.0), Vec2::new(0.0, 0.25)] {
            left.retract_face(truth.position + beyond, Face::West);
        }
        assert_eq!((left.pose(), left.footprint()), (pose, footprint));
    }
}

#[test]
fn a_box_at_rest_whose_face_is_learned_does_not_seem_to_move() {
    let mut observer = observer(true);
    let force = Vec2::new(1.0, 0.0);
    let tool = Vec2::new(-HALF, 0.0) + force / COUPLING.stiffness_n_per_m;
    let mut fastest = 0.0_f64;
    for n in 1..=500 {
        let now = Time::ZERO + TICK * n;
        observer.step(now, tool, force, true, &params());
        if n % 33 == 0 {
            let (taken, pose) = (now, Pose::default());
            observer.see(&VisionSample { taken, pose });
        }
        fastest = fastest.max(observer.twist().linear.norm());
    }
    assert!((observer.footprint().west - HALF).abs() < 1e-6, "learned");
    assert!(fastest < 1e-6, "{fastest} m/s");
}
