//! Laws of bodies other than the cube, each against a closed form or a direction that must not matter.

use super::*;
use mmt_shared::model::geometry::Face;

const G: f64 = 9.81;

fn polygon(vertices: &[(f64, f64)]) -> Shape {
    let vertices: Vec<_> = vertices.iter().map(|(x, y)| Vec2::new(*x, *y)).collect();
    Shape::Polygon {
        vertices_m: Bounded::try_new(&vertices).unwrap(),
    }
}

fn triangle() -> Shape {
    polygon(&[(0.0, 0.0), (0.4, 0.0), (0.1, 0.3)])
}

fn hexagon() -> Shape {
    let corner = |k: i32| libm::sincos(f64::from(k) * std::f64::consts::FRAC_PI_3);
    let corners: Vec<_> = (0..6)
        .map(corner)
        .map(|(y, x)| (0.2 * x, 0.2 * y))
        .collect();
    polygon(&corners)
}

const BRICK: Shape = Shape::Brick {
    length_m: 0.5,
    width_m: 0.2,
};
const DISC: Shape = Shape::Disc { diameter_m: 0.4 };

pub(super) fn shapes() -> [Shape; 5] {
    [Shape::Square, BRICK, DISC, triangle(), hexagon()]
}

/// Without damping, so that closed forms hold.
pub(super) fn undamped(shape: Shape) -> EnvironmentConfig {
    EnvironmentConfig {
        shape,
        damping_ns_per_m: 0.0,
        ..EnvironmentConfig::default()
    }
}

pub(super) fn made(config: EnvironmentConfig) -> Environment {
    Environment::try_new(config).unwrap()
}

/// Seconds until a body comes to rest.
fn coast(environment: &mut Environment) -> f64 {
    let mut ticks = 0_u32;
    while environment.kinetic_energy() > 0.0 {
        environment.step_with_wrench(Vec2::zeros(), 0.0);
        ticks += 1;
        assert!(ticks < 20_000);
    }
    f64::from(ticks) * TICK_S
}

#[test]
fn every_shape_brakes_a_spin_by_its_own_e() {
    for shape in shapes() {
        let mut environment = made(undamped(shape));
        let truth = environment.truth();
        environment.set_twist(Twist::new(0.0, 0.0, 5.0));
        let expected = truth.inertia() * 5.0 / truth.e();
        let seconds = coast(&mut environment);
        assert!(
            (seconds / expected - 1.0).abs() < 0.015,
            "{shape:?}: {seconds}, {expected}"
        );
        // and stays where it is
        let drift = environment.pose().position.norm();
        assert!(drift < 1e-3, "{shape:?}: {drift}");
    }
}

#[test]
fn e_and_inertia_are_those_of_the_shape() {
    let disc = made(undamped(DISC)).truth();
    assert!((disc.e() / (2.0 / 3.0 * disc.c() * 0.2) - 1.0).abs() < 1e-14);
    assert!((disc.inertia() / (0.5 * 0.7 * 0.04) - 1.0).abs() < 1e-14);
    let brick = made(undamped(BRICK)).truth();
    assert!((brick.inertia() / (0.7 * (0.25 + 0.04) / 12.0) - 1.0).abs() < 1e-14);
    // the local model is told of the bounding box
    let bounds = made(undamped(BRICK)).footprint();
    assert_eq!((bounds.east, bounds.north), (0.25, 0.1));
    let bounds = made(undamped(DISC)).footprint();
    assert_eq!(bounds, BoxFootprint::square(0.4));
}

#[test]
fn a_brick_of_equal_sides_is_the_square() {
    let run = |shape| {
        let mut environment = made(EnvironmentConfig {
            shape,
            ..EnvironmentConfig::default()
        });
        pushed(&mut environment, 1_000);
        environment.pose()
    };
    let square = run(Shape::Square);
    let brick = run(Shape::Brick {
        length_m: 0.36,
        width_m: 0.36,
    });
    let diamond = run(polygon(&[
        (0.36, 0.0),
        (0.36, 0.36),
        (0.0, 0.36),
        (0.0, 0.0),
    ]));
    assert!(square.angle.abs() > 0.01);
    for (other, near) in [(brick, 1e-9), (diamond, 1e-6)] {
        assert!(
            (square.position - other.position).norm() < near,
            "{other:?}"
        );
        assert!(
            (square.angle - other.angle).abs() < 10.0 * near,
            "{other:?}"
        );
    }
}

#[test]
fn a_slide_is_braked_alike_in_every_direction() {
    for shape in shapes() {
        for degrees in [0.0, 17.0, 45.0, 90.0, 200.0] {
            let way = rotate(f64::to_radians(degrees), Vec2::x());
            let mut environment = made(undamped(shape));
            environment.set_twist(Twist {
                linear: way * 0.5,
                angular: 0.0,
            });
            coast(&mut environment);
            let pose = environment.pose();
            // semi-implicit steps stop half a period early
            let expected = 0.25 / (2.0 * 0.3 * G) - 0.5 * 0.5 * TICK_S;
            assert!((pose.position.dot(&way) / expected - 1.0).abs() < 3e-3);
            assert!(
                cross(way, pose.position).abs() < 1e-9,
                "{shape:?} at {degrees}"
            );
            assert!(
                pose.angle.abs() < 1e-9,
                "{shape:?} at {degrees}: {}",
                pose.angle
            );
        }
    }
}

#[test]
fn a_turning_disc_coasts_alike_in_every_direction() {
    let reach = |degrees: f64| {
        let way = rotate(f64::to_radians(degrees), Vec2::x());
        let mut environment = made(undamped(DISC));
        environment.set_twist(Twist {
            linear: way * 0.3,
            angular: 3.0,
        });
        coast(&mut environment);
        let pose = environment.pose();
        [pose.position.dot(&way), pose.angle]
    };
    let straight = reach(0.0);
    for degrees in [11.0, 30.0, 45.0, 77.0] {
        let [along, angle] = reach(degrees);
        assert!((along / straight[0] - 1.0).abs() < 2e-3, "{degrees}");
        assert!((angle / straight[1] - 1.0).abs() < 2e-3, "{degrees}");
    }
}

#[test]
fn energy_of_no_body_grows_without_a_tool() {
    let ripple = Some(Ripple::default());
    for shape in shapes() {
        for (ripple, static_ratio, offset) in
            [(None, 1.0, 0.0), (None, 1.5, 0.05), (ripple, 1.5, 0.05)]
        {
            let mut environment = made(EnvironmentConfig {
                ripple,
                static_ratio,
                centre_of_mass_m: Vec2::new(offset, 0.0),
                wall: Some(Wall {
                    distance_m: 0.33,
                    angle_rad: 0.2,
                }),
                ..undamped(shape)
            });
            environment.set_twist(Twist::new(1.2, -0.2, 4.0));
            let mut energy = environment.kinetic_energy();
            let mut ticks = 0;
            while energy > 0.0 {
                environment.step_with_wrench(Vec2::zeros(), 0.0);
                let next = environment.kinetic_energy();
                assert!(next < energy, "{shape:?}: {next} after {energy}");
                energy = next;
                ticks += 1;
            }
            assert!(ticks > 100, "{shape:?}: {ticks}");
        }
    }
}

#[test]
fn a_centre_of_mass_off_the_centroid_turns_the_body_by_newtons_law() {
    let offset = 0.06;
    for shape in shapes() {
        let mut environment = made(EnvironmentConfig {
            friction_coefficient: 0.0,
            centre_of_mass_m: Vec2::new(0.0, offset),
            ..undamped(shape)
        });
        let inertia = environment.truth().inertia();
        for _ in 0..200 {
            environment.step_with_wrench(Vec2::new(0.5, 0.0), 0.0);
        }
        // the force passes below the centre of mass: alpha = F d / I, counter-clockwise
        let angle = 0.5 * (0.5 * offset / inertia) * 0.2 * 0.201;
        let pose = environment.pose();
        assert!(
            (pose.angle / angle - 1.0).abs() < 0.01,
            "{shape:?}: {} {angle}",
            pose.angle
        );
        // the centre of mass goes straight on
        let mass = pose.point_to_world(Vec2::new(0.0, offset));
        let x = 0.5 * (0.5 / 0.7) * 0.2 * 0.201;
        assert!((mass.x / x - 1.0).abs() < 1e-6 && (mass.y - offset).abs() < 1e-9);
    }
}

#[test]
fn friction_acts_at_the_centroid_wherever_the_mass_is() {
    // a body that slides straight is braked behind or beside its mass: alpha = c d / I
    let offset = 0.05;
    for (shape, c_share) in [(Shape::Square, 1.0), (DISC, 1.0), (triangle(), 1.0)] {
        let mut environment = made(EnvironmentConfig {
            centre_of_mass_m: Vec2::new(0.0, offset),
            ..undamped(shape)
        });
        let truth = environment.truth();
        environment.set_twist(Twist::new(2.0, 0.0, 0.0));
        environment.step_with_wrench(Vec2::zeros(), 0.0);
        // F = (−c, 0) at (0, −d) from the mass: M = −d c
        let expected = -c_share * truth.c() * offset / truth.inertia() * TICK_S;
        let turned = environment.twist().angular;
        assert!(
            (turned / expected - 1.0).abs() < 1e-2,
            "{shape:?}: {turned} {expected}"
        );
    }
}

#[test]
fn a_held_body_with_its_mass_off_centre_stays_bitwise() {
    for shape in shapes() {
        let mut environment = made(EnvironmentConfig {
            centre_of_mass_m: Vec2::new(0.03, -0.02),
            pose: Pose::new(0.2, 0.1, 0.7),
            ..undamped(shape)
        });
        let before = bits(&environment);
        for _ in 0..1_000 {
            environment.step_with_wrench(Vec2::new(1.2, -1.4), 0.0);
        }
        assert_eq!(
            bits(&environment),
            before,
            "0.9 c at the centroid, {shape:?}"
        );
        environment.step_with_wrench(Vec2::new(1.2, -1.7), 0.0);
        assert_ne!(environment.kinetic_energy(), 0.0, "1.01 c, {shape:?}");
    }
}

#[test]
fn a_disc_is_met_along_its_radius_wherever_the_tool_is() {
    let mut environment = made(undamped(DISC));
    for degrees in [0.0, 33.0, 135.0, 260.0] {
        let outward = rotate(f64::to_radians(degrees), Vec2::x());
        let contact = environment.step(outward * 0.199, Vec2::zeros());
        assert!(
            (contact.force + outward).norm() < 1e-9,
            "1 N inwards at {degrees}"
        );
        assert!((contact.touch.unwrap().proxy - outward * 0.2).norm() < 1e-12);
    }
    let contact = environment.step(Vec2::new(0.0, -0.201), Vec2::zeros());
    assert_eq!(contact, Contact::default());
    assert_eq!(environment.pose(), Pose::default(), "1 N is held by 2.06 N");
}

#[test]
fn a_polygon_keeps_its_edge_until_the_tool_leaves_it() {
    let mut environment = made(undamped(hexagon()));
    let apothem = 0.2 * libm::cos(std::f64::consts::FRAC_PI_6);
    let touch = |environment: &mut Environment, x: f64, y: f64| {
        environment.set_twist(Twist::default());
        environment.step(Vec2::new(x, y), Vec2::zeros()).touch
    };
    // in through the north edge, 1 mm deep
    assert_eq!(touch(&mut environment, 0.0, apothem + 0.01), None);
    let entered = touch(&mut environment, 0.0, apothem - 1e-3).unwrap();
    assert_eq!(entered.face, Face::North);
    assert!((entered.inward + Vec2::y()).norm() < 1e-12);
    assert!((entered.penetration - 1e-3).abs() < 1e-12);
    // along it, nearer to the neighbour's line than to its own, it is kept
    let kept = touch(&mut environment, 0.0999, apothem - 1.2e-3).unwrap();
    assert_eq!(kept.face, Face::North);
    // past its end the proxy goes round the corner
    let next = touch(&mut environment, 0.1005, apothem - 2e-3).unwrap();
    let normal = rotate(f64::to_radians(30.0), Vec2::x());
    assert!((next.inward + normal).norm() < 1e-9, "{next:?}");
    // and out
    assert_eq!(touch(&mut environment, 0.3, apothem), None);
}

#[test]
fn a_tool_pushes_every_shape_with_coulomb_and_damping() {
    for shape in shapes() {
        let mut environment = made(EnvironmentConfig {
            shape,
            ..EnvironmentConfig::default()
        });
        let west = environment.footprint().west;
        let mut work = 0.0;
        for tick in 0..3_000 {
            let x = -west - 0.002 + 0.1e-3 * f64::from(tick);
            let contact = environment.step(Vec2::new(x, 0.01), Vec2::new(0.1, 0.0));
            assert!(contact.force.norm() < 8.0, "{shape:?}: {contact:?}");
            work += contact.force.x * 0.1 * TICK_S;
        }
        let gone = environment.pose().position.x;
        let least = environment.truth().c() * 0.5 * gone;
        assert!(
            gone > 0.05 && work > least,
            "{shape:?}: {gone} m by {work} J"
        );
        assert!(environment.pose().is_finite());
    }
}

#[test]
fn mass_and_friction_change_every_shape_in_mid_run() {
    for shape in shapes() {
        let mut environment = made(EnvironmentConfig {
            centre_of_mass_m: Vec2::new(0.02, 0.0),
            ripple: Some(Ripple::default()),
            ..undamped(shape)
        });
        let before = environment.truth();
        environment.set_mass(1.4).unwrap();
        environment.set_friction(0.6).unwrap();
        let truth = environment.truth();
        assert!((truth.c() / before.c() - 4.0).abs() < 1e-12);
        assert!((truth.e() / before.e() - 4.0).abs() < 1e-12);
        assert!((truth.inertia() / before.inertia() - 2.0).abs() < 1e-12);
        // 4 c of before holds what broke loose at 1.3 c of before at most
        let held = 2.6 * before.c();
        environment.step_with_wrench(Vec2::new(0.0, held), 0.0);
        assert_eq!(environment.kinetic_energy(), 0.0, "{shape:?}");
        environment.set_friction(0.3).unwrap();
        environment.step_with_wrench(Vec2::new(0.0, 1.01 * held), 0.0);
        assert!(environment.kinetic_energy() > 0.0, "{shape:?}");
    }
}
