//! What the pose observer promises.

mod direction;
mod faces;
mod turned;
mod untouched;

use super::*;
use crate::sensing::VisionSample;
use mmt_shared::fixtures::COUPLING;
use mmt_shared::model::geometry::{cross, wrap_angle};
use mmt_shared::model::params::friction_torque_of_square;
use mmt_shared::time::TICK;

/// The box as it really is: 0.36 m wide, pushed in x at its west face.
const HALF: f64 = 0.18;

fn observer(learn: bool) -> PoseObserver {
    observer_of(learn, learn)
}

fn observer_of(images: bool, learn: bool) -> PoseObserver {
    let config = ObserverConfig {
        quasi_static: false,
        coupling: COUPLING,
        force_noise_n: 0.01,
        vision_noise_m: 1e-3,
        vision_noise_rad: 5e-3,
        size_noise_m: None,
        tool_friction: 0.0,
        images,
        learn,
    };
    PoseObserver::new(config, Pose::default(), BoxFootprint::square(0.40))
}

fn params() -> ModelParams {
    ModelParams::of_square(0.7, 3.0, 2.06, 0.36, &COUPLING).unwrap()
}

/// Pushes the real box at 0.1 m/s for so many ticks; vision looks every 33 ms. Returns its true pose.
fn push(observer: &mut PoseObserver, ticks: u32, angle: f64) -> Pose {
    push_beyond(observer, ticks, angle, 0.0)
}

/// The same with a tool and a contact that give so much farther (m) than a contact of k_p would, which is known.
fn push_beyond(observer: &mut PoseObserver, ticks: u32, angle: f64, beyond_m: f64) -> Pose {
    let force = rotate(angle, Vec2::new(2.36, 0.0));
    let farther = rotate(angle, Vec2::new(beyond_m, 0.0));
    let contact = ContactForce {
        beyond_m,
        ..force.into()
    };
    let mut truth = Pose::new(0.0, 0.0, angle);
    for n in 1..=ticks {
        truth.position = rotate(angle, Vec2::new(1e-4 * f64::from(n), 0.0));
        let surface = truth.point_to_world(Vec2::new(-HALF, 0.0));
        let tool = surface + force / COUPLING.stiffness_n_per_m + farther;
        let now = Time::ZERO + TICK * n;
        observer.step(now, tool, contact, true, &params());
        if n % 33 == 0 {
            observer.see(&VisionSample {
                taken: now,
                pose: truth,
            });
        }
    }
    truth
}

/// How far from the true centre a box is taken to be that is pushed off its middle, turns and is never seen, m.
fn off_after_turning(mut observer: PoseObserver) -> f64 {
    observer.faces = FaceMap::new(BoxFootprint::square(2.0 * HALF), None);
    let mut truth = Motion::default();
    for n in 1..=3000 {
        let contact = Vec2::new(-HALF, 0.015);
        let inward = rotate(truth.pose.angle, Vec2::new(1.0, 0.0));
        let (force, lever) = (inward * 2.6, rotate(truth.pose.angle, contact));
        let surface = truth.pose.point_to_world(contact);
        let tool = surface + force / COUPLING.stiffness_n_per_m;
        observer.step(Time::ZERO + TICK * n, tool, force, true, &params());
        truth = truth.step(FrictionLaw::LimitSurface, &params(), force, lever);
    }
    assert!(truth.pose.angle.abs() > 0.4, "{truth:?}");
    (observer.pose().position - truth.pose.position).norm()
}

#[test]
fn a_box_that_turns_slides_along_its_face_and_is_followed_unseen() {
    let [stiff, sliding] = [false, true].map(|learn| off_after_turning(observer(learn)));
    assert!(stiff > 3e-3, "{stiff} m");
    assert!(sliding < 0.2 * stiff, "{sliding} m of {stiff} m");
}

#[test]
fn images_alone_show_the_touched_face_and_how_the_box_turns_is_not_reckoned_with() {
    let mut seeing = observer_of(true, false);
    let truth = push(&mut seeing, 1000, 0.0);
    let west = seeing.footprint().west;
    assert!((west - HALF).abs() < 2e-3, "{west} m");
    assert!((seeing.pose().position - truth.position).norm() < 2e-3);
    let unseen = off_after_turning(observer_of(true, false));
    assert_eq!(unseen, off_after_turning(observer(false)));
}

#[test]
fn the_direction_of_the_force_gives_theta() {
    let mut observer = observer(true);
    push(&mut observer, 300, 0.1);
    assert!(
        (observer.pose().angle - 0.1).abs() < 2e-3,
        "{}",
        observer.pose().angle
    );
}

#[test]
fn a_force_that_points_at_a_face_beyond_the_centre_does_not_move_the_box_there() {
    let mut observer = observer(true);
    push(&mut observer, 1000, 0.0);
    let (pose, footprint) = (observer.pose(), observer.footprint());
    // the tool is back in front of the west face, and noise is taken for a touch of the east face
    let tool = pose.position + Vec2::new(-HALF - 1e-3, 0.0);
    let now = Time::ZERO + TICK * 1001;
    observer.step(now, tool, Vec2::zeros(), false, &params());
    for n in 1002..=1020u32 {
        let noise = Vec2::new(-0.12, 0.02);
        observer.step(Time::ZERO + TICK * n, tool, noise, true, &params());
    }
    let (moved, east) = (
        observer.pose().position - pose.position,
        observer.footprint().east,
    );
    assert!(moved.norm() < 0.01, "{moved} m");
    assert!((east - footprint.east).abs() < 0.01, "{east} m");
}

#[test]
fn a_box_that_is_let_go_coasts_as_far_as_friction_allows() {
    let mut observer = observer(true);
    push(&mut observer, 1000, 0.0);
    let let_go = observer.pose().position.x;
    for n in 1001..=1200u32 {
        observer.step(
            Time::ZERO + TICK * n,
            Vec2::zeros(),
            Vec2::zeros(),
            false,
            &params(),
        );
    }
    // v²/(2 c/m) for v = 0.1, less for the damping
    let coasted = observer.pose().position.x - let_go;
    let most = 0.1 * 0.1 / (2.0 * 2.06 / 0.7);
    assert!(
        coasted > 0.7 * most && coasted < 1.2 * most,
        "{coasted} of {most}"
    );
    assert_eq!(observer.twist(), Twist::default());
    assert!(observer.contact().is_none());
}

#[test]
fn late_vision_is_held_against_the_pose_of_then() {
    let mut observer = observer(true);
    push(&mut observer, 1000, 0.0);
    let before = observer.pose();
    // an image of 50 ms ago, delivered now: the box has moved 5 mm since
    let taken = Time::ZERO + TICK * 950;
    let pose = Pose::new(0.095, 0.0, 0.0);
    observer.see(&VisionSample { taken, pose });
    assert!((observer.pose().position - before.position).norm() < 2e-4);
}

/// Pushes a box of twice the square's resistance to turning, or of as much, beside its centre at constant
/// speed; returns omega as found and as true.
fn turn(observer: &mut PoseObserver, resistance: f64, seconds: u32) -> (f64, f64) {
    let (params, speed, lever) = (params(), 0.15, 0.03);
    let (mut truth, mut omega) = (Pose::default(), 0.0);
    for n in 1..=seconds * 1000 {
        let inward = rotate(truth.angle, Vec2::new(1.0, 0.0));
        let along = Vec2::new(-inward.y, inward.x);
        let surface = truth.position - inward * HALF - along * lever;
        let force = inward * (params.c() + params.b() * speed);
        let drag = resistance * crate::square_friction::drag(&params, 2.0 * HALF, speed, omega);
        let moment = cross(surface - truth.position, force);
        omega = crate::square_friction::turned(params.inertia(), drag, omega, moment);
        let now = Time::ZERO + TICK * n;
        let tool = surface + force / COUPLING.stiffness_n_per_m;
        observer.step(now, tool, force, true, &params);
        if n % 33 == 0 {
            observer.see(&VisionSample {
                taken: now,
                pose: truth,
            });
        }
        truth.position += inward * (speed * 1e-3);
        truth.angle += omega * 1e-3;
    }
    (observer.twist().angular, omega)
}

#[test]
fn turning_is_known_by_its_moment_and_a_box_that_resists_more_is_found() {
    let mut square = observer(true);
    let (found, truth) = turn(&mut square, 1.0, 4);
    assert!((found / truth - 1.0).abs() < 0.05, "{found} {truth}");
    let of_square = square.friction_radius();
    assert!(
        of_square < 0.95 * 0.3826 * 2.0 * HALF,
        "less than (9): it slides as well: {of_square}"
    );
    let mut stubborn = observer(true);
    let (found, truth) = turn(&mut stubborn, 2.0, 4);
    assert!((found / truth - 1.0).abs() < 0.15, "{found} {truth}");
    assert!(stubborn.friction_radius() > 1.2 * of_square);
}

#[test]
fn the_paper_takes_e_by_9_whatever_it_feels() {
    let mut observer = observer(false);
    turn(&mut observer, 2.0, 2);
    let by_9 = friction_torque_of_square(1.0, observer.footprint().mean_side());
    assert!((observer.friction_radius() - by_9).abs() < 1e-15);
}

/// Pushes a disc of this radius that does not turn, with a normal that starts at `start` rad and turns at
/// `rate` rad/s; vision sees the angle 0. Returns the disc's true centre and the normal's last angle.
fn push_disc(observer: &mut PoseObserver, start: f64, rate: f64, ticks: u32) -> (Vec2, f64) {
    let (mut centre, mut normal) = (Vec2::zeros(), start);
    for n in 1..=ticks {
        normal = start + rate * f64::from(n) * TICK_S;
        let inward = rotate(normal, Vec2::new(1.0, 0.0));
        centre += inward * 1e-4;
        let force = inward * 2.36;
        let tool = centre - inward * HALF + force / COUPLING.stiffness_n_per_m;
        let now = Time::ZERO + TICK * n;
        observer.step(now, tool, force, true, &params());
        if n % 33 == 0 {
            observer.see(&VisionSample {
                taken: now,
                pose: Pose::new(centre.x, centre.y, 0.0),
            });
        }
    }
    (centre, normal)
}

#[test]
fn a_disc_is_known_by_its_tangent_and_its_centre_by_vision() {
    let mut observer = observer(true);
    let rate = -0.4;
    let (centre, normal) = push_disc(&mut observer, -0.15, rate, 1500);
    let pose = observer.pose();
    let inward = observer.contact().unwrap().inward;
    let west = observer.contact().unwrap().face;
    assert_eq!(west, Face::West);
    assert!(wrap_angle(pose.angle - normal).abs() < 5e-3, "{pose:?}");
    assert!((inward - rotate(normal, Vec2::new(1.0, 0.0))).norm() < 5e-3);
    assert!(
        (pose.position - centre).norm() < 1.5e-3,
        "{pose:?} {centre}"
    );
    assert!((observer.footprint().west - HALF).abs() < 1.5e-3);
    assert!((observer.twist().angular - rate).abs() < 0.03);
    assert!(
        observer.body_rate().abs() < 0.08,
        "{}",
        observer.body_rate()
    );
    // for a model that does not turn: ahead by what the tangent turns in a time constant
    let ahead = observer.pose_ahead(0.0, 0.3);
    assert!((ahead.angle - pose.angle - rate * 0.3).abs() < 0.01);
    let face = |pose: &Pose, point: Vec2| {
        observer
            .footprint()
            .distance(west, pose.point_to_object(point))
    };
    let surface = observer.contact().unwrap().surface;
    assert!((face(&ahead, surface) - face(&pose, surface)).abs() < 1e-9);
    assert_eq!(observer.pose_ahead(rate, 0.0), pose);
}

#[test]
fn a_box_stays_a_box_after_two_bad_images() {
    let mut observer = observer(true);
    let truth = push(&mut observer, 100, 0.0);
    for _ in 0..2 {
        observer.see(&VisionSample {
            taken: Time::ZERO + TICK * 100,
            pose: Pose::new(truth.position.x, truth.position.y, 0.5),
        });
    }
    push(&mut observer, 1000, 0.0);
    assert_eq!(observer.pose_ahead(1.0, 0.3), observer.pose());
    assert_eq!(observer.body_rate(), observer.twist().angular);
}

/// A tool in contact with nothing, `away` m before the face, under a bias of the force; images show a box that does not follow.
fn seen_with_tool_away(away: f64) -> PoseObserver {
    let mut observer = observer(true);
    let truth = push(&mut observer, 1000, 0.0);
    let tool = truth.position - Vec2::new(HALF + away, 0.0);
    for n in 1001..=1400_u32 {
        let now = Time::ZERO + TICK * n;
        observer.step(now, tool, Vec2::new(0.3, 0.0), true, &params());
        if n % 33 == 0 {
            observer.see(&VisionSample {
                taken: now,
                pose: truth,
            });
        }
    }
    observer
}

#[test]
fn images_that_show_the_tool_clear_of_the_box_are_no_images_of_a_contact() {
    let clear = seen_with_tool_away(0.02);
    assert!(clear.sees_clear());
    assert!(
        (clear.footprint().west - HALF).abs() < 1e-3,
        "nothing is learned from them"
    );
    let near = seen_with_tool_away(0.002);
    assert!(!near.sees_clear());
}

#[test]
fn a_box_that_is_guessed_to_be_further_away_is_where_the_next_image_shows_it() {
    let mut observer = observer(true);
    let truth = push(&mut observer, 1000, 0.0);
    let look = |observer: &mut PoseObserver, from: u32, ticks: u32| {
        for n in from..from + ticks {
            let now = Time::ZERO + TICK * n;
            observer.step(now, Vec2::new(-1.0, 0.0), Vec2::zeros(), false, &params());
            if n % 33 == 0 {
                observer.see(&VisionSample {
                    taken: now,
                    pose: truth,
                });
            }
        }
    };
    look(&mut observer, 1001, 1000);
    let inside = truth.position - Vec2::new(HALF - 0.01, 0.0);
    observer.retract_face(inside, Face::West);
    let off = |observer: &PoseObserver| (observer.pose().position - truth.position).norm();
    assert!(off(&observer) > 9e-3, "the effect exists");
    look(&mut observer, 2001, 40);
    assert!(off(&observer) < 1e-3, "{} m", off(&observer));
}
