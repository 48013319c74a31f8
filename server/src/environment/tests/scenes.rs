//! Laws of several bodies and walls, each with its closed form.

use super::bodies::undamped;
use super::*;
use nalgebra::Vector3;

const C: f64 = 0.3 * 0.7 * 9.81;

fn cube(x: f64, y: f64) -> BodyConfig {
    BodyConfig {
        damping_ns_per_m: 0.0,
        pose: Pose::new(x, y, 0.0),
        ..BodyConfig::default()
    }
}

fn scene(bodies: &[BodyConfig], walls: &[Wall], contact_friction: f64) -> Environment {
    let scene = SceneConfig {
        contact_friction,
        bodies: bodies.to_vec(),
        walls: walls.to_vec(),
    };
    Environment::of_scene(EnvironmentConfig::default(), &scene).unwrap()
}

fn push(environment: &mut Environment, force: Vec2, ticks: u32) {
    for _ in 0..ticks {
        environment.step_with_wrench(force, 0.0);
    }
}

fn x(environment: &Environment, number: usize) -> f64 {
    environment.pose_of(number).unwrap().position.x
}

/// Velocity of a body.
fn twist(environment: &mut Environment, number: usize) -> Twist {
    environment.select(number);
    environment.twist()
}

#[test]
fn two_boxes_in_a_row_are_held_at_nine_tenths_of_their_joint_friction() {
    for gap in [0.0, 1e-7] {
        let mut environment = scene(&[cube(0.0, 0.0), cube(0.36 + gap, 0.0)], &[], 0.0);
        push(&mut environment, Vec2::new(0.9 * 2.0 * C, 0.0), 10_000);
        for (number, start) in [(0, 0.0), (1, 0.36 + gap)] {
            let moved = x(&environment, number) - start;
            assert!(moved.abs() < 1e-6, "{gap}: {number} moved by {moved} m");
        }
    }
}

#[test]
fn two_boxes_in_a_row_slide_beyond_their_joint_friction_as_one() {
    let mut environment = scene(&[cube(0.0, 0.0), cube(0.36, 0.0)], &[], 0.0);
    let (force, t) = (1.5 * 2.0 * C, 0.5);
    push(&mut environment, Vec2::new(force, 0.0), 500);
    // a = (F − 2 c)/(2 m); semi-implicit Euler goes ½ a t (t + T)
    let expected = 0.5 * (force - 2.0 * C) / 1.4 * t * (t + TICK_S);
    for (number, start) in [(0, 0.0), (1, 0.36)] {
        let gone = x(&environment, number) - start;
        assert!((gone / expected - 1.0).abs() < 1e-4, "{gone}, {expected}");
    }
}

#[test]
fn a_row_of_five_hands_the_push_on_and_keeps_its_gaps_closed() {
    let row: Vec<_> = (0..5).map(|k| cube(0.36 * f64::from(k), 0.0)).collect();
    let mut environment = scene(&row, &[], 0.3);
    push(&mut environment, Vec2::new(0.9 * 5.0 * C, 0.0), 1_000);
    assert!(x(&environment, 0).abs() < 1e-6, "{}", x(&environment, 0));
    push(&mut environment, Vec2::new(1.5 * 5.0 * C, 0.0), 200);
    let expected = 0.5 * (0.5 * C / 0.7) * 0.2 * (0.2 + TICK_S);
    for number in 0..5 {
        let gone = x(&environment, number) - 0.36 * number as f64;
        assert!((gone / expected - 1.0).abs() < 2e-3, "{number}: {gone}");
    }
}

#[test]
fn momentum_is_kept_in_a_collision_and_energy_is_not_gained() {
    // smooth ground; inelastic: both go on with (m1 v1)/(m1 + m2)
    let smooth = |x: f64, mass_kg: f64| BodyConfig {
        mass_kg,
        friction_coefficient: 0.0,
        ..cube(x, 0.0)
    };
    let mut environment = scene(&[smooth(0.0, 0.7), smooth(0.5, 2.1)], &[], 0.0);
    environment.set_twist(Twist::new(1.0, 0.0, 0.0));
    let mut energy = environment.kinetic_energy();
    for _ in 0..300 {
        environment.step_with_wrench(Vec2::zeros(), 0.0);
        let next = environment.kinetic_energy();
        assert!(next <= energy * (1.0 + 1e-9), "{next} after {energy}");
        energy = next;
    }
    for number in 0..2 {
        let v = twist(&mut environment, number).linear.x;
        assert!((v - 0.25).abs() < 1e-6, "{number}: {v}");
    }
}

#[test]
fn an_eccentric_collision_keeps_momentum_and_angular_momentum() {
    let smooth = |x: f64, y: f64, angle: f64| BodyConfig {
        friction_coefficient: 0.0,
        pose: Pose::new(x, y, angle),
        ..cube(0.0, 0.0)
    };
    for friction in [0.0, 0.5] {
        let bodies = [smooth(0.0, 0.0, 0.2), smooth(0.6, 0.11, -0.5)];
        let mut environment = scene(&bodies, &[], friction);
        environment.set_twist(Twist::new(1.5, 0.1, 2.0));
        let total = |environment: &mut Environment| {
            (0..2).fold(Vector3::zeros(), |sum: Vector3<f64>, number| {
                environment.select(number);
                let (pose, twist) = (environment.pose(), environment.twist());
                let p = twist.linear * 0.7;
                let spin = environment.truth().inertia() * twist.angular;
                sum + Vector3::new(p.x, p.y, spin + cross(pose.position, p))
            })
        };
        let before = total(&mut environment);
        for _ in 0..1_000 {
            environment.step_with_wrench(Vec2::zeros(), 0.0);
        }
        let after = total(&mut environment);
        assert!(twist(&mut environment, 1).linear.x > 0.1, "never met");
        // rapier takes levers at the beginning of the period
        assert!((after - before).norm() < 1e-3, "{before} {after}");
    }
}

#[test]
fn a_box_pushed_along_a_wall_slides_as_its_friction_on_ground_and_wall_allow() {
    let wall = Wall {
        distance_m: 0.18,
        angle_rad: 0.0,
    };
    for mu in [0.0, 0.2] {
        let mut environment = scene(&[cube(0.0, 0.0)], &[wall], mu);
        let (into, along) = (3.0, 4.0);
        push(&mut environment, Vec2::new(into, along), 500);
        let pose = environment.pose();
        // m a = F_y − c − mu F_x, and the push acts at the centre, the wall's friction at the face
        let expected = 0.5 * (along - C - mu * into) / 0.7 * 0.5 * (0.5 + TICK_S);
        let gone = pose.position.y;
        assert!((gone / expected - 1.0).abs() < 2e-3, "{gone}, {expected}");
        assert!(
            pose.position.x.abs() < 1e-7 && pose.angle.abs() < 1e-6,
            "{pose:?}"
        );
    }
}

#[test]
fn a_fixed_body_stays_and_stops_another_one() {
    let fixed = BodyConfig {
        fixed: true,
        ..cube(0.5, 0.0)
    };
    let mut environment = scene(&[cube(0.0, 0.0), fixed], &[], 0.0);
    environment.set_twist(Twist::new(2.0, 0.0, 0.0));
    push(&mut environment, Vec2::new(8.0, 0.0), 1_000);
    assert!((x(&environment, 0) - 0.14).abs() < 1e-6);
    assert_eq!(environment.pose_of(1).unwrap(), Pose::new(0.5, 0.0, 0.0));
    environment.select(1);
    environment.set_twist(Twist::new(2.0, 0.0, 0.0));
    push(&mut environment, Vec2::new(1e5, 0.0), 10);
    assert_eq!(environment.pose(), Pose::new(0.5, 0.0, 0.0));
}

#[test]
fn the_tool_touches_one_body_after_another_and_the_last_one_is_described() {
    let mut environment = scene(&[cube(0.0, 0.0), cube(0.0, 1.0)], &[], 0.0);
    assert_eq!(
        environment.step(Vec2::new(-0.3, 0.0), Vec2::zeros()).body,
        0
    );
    environment.step(Vec2::new(-0.3, 1.0), Vec2::zeros());
    let contact = environment.step(Vec2::new(-0.179, 1.0), Vec2::zeros());
    assert!(contact.body == 1 && (contact.force.x - 1.0).abs() < 1e-9);
    assert_eq!(contact.pose.position.y, 1.0);
    let free = environment.step(Vec2::new(-0.3, 0.0), Vec2::zeros());
    assert!(free.body == 1 && free.touch.is_none());
    assert_eq!(environment.pose().position.y, 1.0);
}

#[test]
fn a_body_in_a_scene_that_meets_nothing_moves_as_it_would_alone() {
    let mut alone = Environment::try_new(undamped(Shape::Square)).unwrap();
    let mut one = scene(&[cube(0.0, 0.0), cube(0.0, 1.0)], &[], 0.0);
    pushed(&mut alone, 1_500);
    pushed(&mut one, 1_500);
    assert!(alone.pose().position.x > 0.02);
    assert_eq!(bits(&one), bits(&alone));
}

#[test]
fn a_scene_runs_to_the_same_bits_again() {
    let run = || {
        let bodies = [cube(0.0, 0.0), cube(0.4, 0.1), cube(0.8, -0.1)];
        let wall = Wall {
            distance_m: 1.2,
            angle_rad: 0.2,
        };
        let mut environment = scene(&bodies, &[wall], 0.2);
        push(&mut environment, Vec2::new(9.0, 0.3), 800);
        [0, 1, 2].map(|number| {
            environment.select(number);
            bits(&environment)
        })
    };
    assert_eq!(run(), run());
}

#[test]
fn bodies_of_all_shapes_stay_out_of_each_other_and_of_the_walls_and_gain_no_energy() {
    let mut stream = mmt_shared::rng::Substream::new(5, "test/scenes", 0);
    let mut shapes = super::bodies::shapes().to_vec();
    shapes.push(notched());
    let walls = [0.0, 1.0, 2.0, 3.0].map(|k| Wall {
        distance_m: 0.9,
        angle_rad: k * std::f64::consts::FRAC_PI_2,
    });
    let mut met = 0;
    for round in 0..24 {
        let body = |k: usize, x: f64, y: f64| BodyConfig {
            shape: shapes[(round + k) % shapes.len()],
            friction_coefficient: [0.0, 0.2][round % 2],
            ..cube(x, y)
        };
        let bodies = [body(0, 0.0, 0.0), body(1, 0.55, 0.1), body(2, -0.1, 0.55)];
        let mut environment = scene(&bodies, &walls, [0.0, 0.4][round / 2 % 2]);
        for number in 0..3 {
            environment.select(number);
            environment.set_twist(Twist::new(
                stream.uniform_in(-2.0, 2.0),
                stream.uniform_in(-2.0, 2.0),
                stream.uniform_in(-5.0, 5.0),
            ));
        }
        let mut energy = environment.kinetic_energy();
        for _ in 0..400 {
            environment.step_with_wrench(Vec2::zeros(), 0.0);
            let next = environment.kinetic_energy();
            assert!(
                next <= energy * (1.0 + 1e-6) + 1e-9,
                "{round}: {energy} {next}"
            );
            energy = next;
        }
        let depth = deepest(&environment, &walls);
        assert!(depth < 1e-3, "{round}: {depth} m");
        met += u32::from(depth > -1e-3);
    }
    assert!(met > 12, "{met}");
}

/// How deep bodies are in the walls and, in steps of 0.1 mm, in each other.
fn deepest(environment: &Environment, walls: &[Wall]) -> f64 {
    let objects = || std::iter::once(&environment.touched).chain(&environment.others);
    let mut deepest = f64::MIN;
    for one in objects() {
        for wall in walls {
            deepest = deepest.max(-wall.clearance(&one.outline, &one.pose()));
        }
        for other in objects().filter(|other| other.number > one.number) {
            let apart = other.pose().position - one.pose().position;
            let away = |mm: f64| Pose {
                position: other.pose().position + apart.normalize() * mm * 1e-3,
                ..other.pose()
            };
            let steps = (0..100).map(|k| f64::from(k) * 0.1);
            let overlapping =
                steps.take_while(|mm| one.solid.overlaps(&one.pose(), &other.solid, &away(*mm)));
            deepest = deepest.max(overlapping.count() as f64 * 1e-4 - 1e-4);
        }
    }
    deepest
}

/// An L of three squares of 0.15 m.
fn notched() -> Shape {
    let corners = [
        (0.0, 0.0),
        (0.3, 0.0),
        (0.3, 0.15),
        (0.15, 0.15),
        (0.15, 0.3),
        (0.0, 0.3),
    ];
    Shape::Compound {
        vertices_m: Bounded::try_new(&corners.map(|(x, y)| Vec2::new(x, y))).unwrap(),
    }
}

#[test]
fn a_compound_has_the_inertia_and_the_friction_of_its_parts() {
    let mut environment = Environment::try_new(undamped(notched())).unwrap();
    // three squares of side a, mass m/3: a²/6 each, and their centres' distances from the centroid
    let (a, at) = (0.15_f64, 0.125);
    let centres = [(0.075, 0.075), (0.225, 0.075), (0.075, 0.225)];
    let arms = centres.map(|(x, y): (f64, f64)| (x - at).powi(2) + (y - at).powi(2));
    let inertia = 0.7 * (a * a / 6.0 + arms.iter().sum::<f64>() / 3.0);
    assert!((environment.truth().inertia() / inertia - 1.0).abs() < 1e-12);
    // a spin is braked by e
    environment.set_twist(Twist::new(0.0, 0.0, 5.0));
    push(&mut environment, Vec2::zeros(), 50);
    let braked = 5.0 - environment.truth().e() / inertia * 0.05;
    let omega = environment.twist().angular;
    assert!((omega / braked - 1.0).abs() < 0.02, "{omega}, {braked}");
}

#[test]
fn the_tool_meets_a_notch_where_it_is() {
    let mut environment = Environment::try_new(undamped(notched())).unwrap();
    let centroid = Vec2::new(0.125, 0.125);
    // in the notch, and 1 mm under its floor
    let tool = Vec2::new(0.225, 0.16) - centroid;
    assert_eq!(environment.step(tool, Vec2::zeros()).touch, None);
    let tool = Vec2::new(0.225, 0.149) - centroid;
    let contact = environment.step(tool, Vec2::zeros());
    assert!(
        (contact.force - Vec2::new(0.0, -1.0)).norm() < 1e-9,
        "{contact:?}"
    );
}

#[test]
fn a_peg_rests_in_a_notch() {
    let peg = BodyConfig {
        shape: Shape::Disc { diameter_m: 0.1 },
        mass_kg: 0.2,
        ..cube(0.225 - 0.125, 0.25 - 0.125)
    };
    let block = BodyConfig {
        shape: notched(),
        fixed: true,
        ..cube(0.0, 0.0)
    };
    let mut environment = scene(&[peg, block], &[], 0.0);
    push(&mut environment, Vec2::new(-2.0, -2.0), 1_000);
    let expected = Vec2::new(0.2 - 0.125, 0.2 - 0.125);
    let off = environment.pose().position - expected;
    assert!(off.norm() < 1e-5, "{off}");
}

#[test]
fn a_wrong_scene_is_named() {
    let wrong = |bodies: &[BodyConfig], walls: &[Wall], friction: f64| {
        let scene = SceneConfig {
            contact_friction: friction,
            bodies: bodies.to_vec(),
            walls: walls.to_vec(),
        };
        let made = Environment::of_scene(EnvironmentConfig::default(), &scene);
        made.err().unwrap().to_string()
    };
    assert_eq!(
        wrong(&[cube(0.0, 0.0), cube(0.2, 0.0)], &[], 0.0),
        "scene: bodies 1 and 2 overlap"
    );
    let light = BodyConfig {
        mass_kg: -1.0,
        ..cube(1.0, 0.0)
    };
    let error = wrong(&[cube(0.0, 0.0), light], &[], 0.0);
    assert!(
        error.starts_with("scene: body 2: environment: mass"),
        "{error}"
    );
    let wall = Wall {
        distance_m: 0.1,
        angle_rad: 0.0,
    };
    let error = wrong(&[cube(0.0, 0.0)], &[wall], 0.0);
    assert!(
        error.starts_with("scene: body 1: wall 1 of the scene: wall distance 0.1"),
        "{error}"
    );
    let far = Wall {
        distance_m: 2.0,
        ..wall
    };
    let error = wrong(&[], &[far, wall], 0.0);
    assert_eq!(
        error,
        "wall 2 of the scene: wall distance 0.1 is outside the accepted range 0.18 to 10 m"
    );
    assert!(wrong(&[], &[], -1.0).contains("contact friction -1"));
    let crossing = [(0.0, 0.0), (0.3, 0.3), (0.3, 0.0), (0.0, 0.4)];
    let shape = Shape::Compound {
        vertices_m: Bounded::try_new(&crossing.map(|(x, y)| Vec2::new(x, y))).unwrap(),
    };
    let crossed = BodyConfig {
        shape,
        ..cube(0.0, 0.0)
    };
    let error = wrong(&[crossed], &[], 0.0);
    assert!(error.contains("polygon crosses itself"), "{error}");
}
