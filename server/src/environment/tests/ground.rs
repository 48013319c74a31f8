//! Laws of what the body meets: uneven friction, static friction, a wall; and refusal of wrong numbers.

use super::bodies::{made, shapes, undamped};
use super::*;

const C: f64 = 0.3 * 0.7 * 9.81;

fn halves(mu: f64) -> Bounded<GroundPatch, PATCHES_MAX> {
    Bounded::try_new(&[GroundPatch {
        from_m: Vec2::new(-10.0, 0.0),
        to_m: Vec2::new(10.0, 10.0),
        friction_coefficient: mu,
    }])
    .unwrap()
}

#[test]
fn a_slide_along_a_border_is_braked_by_the_mean_and_turned_by_the_difference() {
    let mut environment = made(EnvironmentConfig {
        patches: halves(0.5),
        ..undamped(Shape::Square)
    });
    environment.set_twist(Twist::new(1.0, 0.0, 0.0));
    for _ in 0..20 {
        environment.step_with_wrench(Vec2::zeros(), 0.0);
    }
    let twist = environment.twist();
    let slowed = 1.0 - 0.4 * 9.81 * 0.02;
    assert!((twist.linear.x / slowed - 1.0).abs() < 1e-3, "{twist:?}");
    // each half's friction acts a quarter of the side from the middle; more above turns it left
    let inertia = environment.truth().inertia();
    let turned = (0.5 - 0.3) / 2.0 * 0.7 * 9.81 * 0.09 / inertia * 0.02;
    assert!(
        (twist.angular / turned - 1.0).abs() < 0.02,
        "{twist:?}, {turned}"
    );
}

#[test]
fn a_patch_brakes_only_what_is_on_it() {
    let gone = |y: f64| {
        let mut environment = made(EnvironmentConfig {
            patches: halves(0.6),
            pose: Pose::new(0.0, y, 0.0),
            ..undamped(Shape::Square)
        });
        environment.set_twist(Twist::new(0.5, 0.0, 0.0));
        for _ in 0..1_000 {
            environment.step_with_wrench(Vec2::zeros(), 0.0);
        }
        environment.pose().position.x
    };
    assert!((gone(-0.5) / gone(0.5) - 2.0).abs() < 0.02);
}

#[test]
fn a_ripple_holds_more_here_and_less_there() {
    // a disc much smaller than the period feels the coefficient of its place
    for (x, mu) in [(0.05, 0.3 * 1.3), (0.15, 0.3 * 0.7), (0.1, 0.3)] {
        let config = EnvironmentConfig {
            ripple: Some(Ripple::default()),
            pose: Pose::new(x, 0.05, 0.0),
            ..undamped(Shape::Disc { diameter_m: 0.02 })
        };
        for (share, held) in [(0.97, true), (1.03, false)] {
            let mut environment = made(config);
            environment.step_with_wrench(Vec2::new(0.0, share * mu * 0.7 * 9.81), 0.0);
            assert_eq!(environment.kinetic_energy() == 0.0, held, "{share} at {x}");
        }
    }
}

#[test]
fn a_resting_body_breaks_away_at_the_static_ratio_and_slides_with_less() {
    for shape in shapes() {
        let config = EnvironmentConfig {
            static_ratio: 1.5,
            ..undamped(shape)
        };
        let after = |share: f64, ticks: u32, moving: bool| {
            let mut environment = made(config);
            if moving {
                environment.set_twist(Twist::new(0.01, 0.0, 0.0));
            }
            for _ in 0..ticks {
                environment.step_with_wrench(Vec2::new(share * C, 0.0), 0.0);
            }
            environment.twist().linear.x
        };
        assert_eq!(after(1.4999, 200, false), 0.0, "{shape:?}");
        // beyond, only sliding friction is left: a = 0.5001 c/m
        let broken = after(1.5001, 200, false);
        let expected = 0.5001 * C / 0.7 * 0.2;
        assert!(
            (broken / expected - 1.0).abs() < 2e-3,
            "{shape:?}: {broken}"
        );
        // a body that slides already goes on sliding
        assert!(after(1.2, 200, true) > 0.1, "{shape:?}");
    }
}

#[test]
fn a_wall_stops_a_push_of_8_n_within_a_millimetre() {
    for shape in shapes() {
        for wall_angle in [0.0, 0.4] {
            let wall = Wall {
                distance_m: 0.6,
                angle_rad: wall_angle,
            };
            let config = EnvironmentConfig {
                wall: Some(wall),
                ..undamped(shape)
            };
            let mut environment = made(config);
            let into = rotate(wall_angle, Vec2::x());
            let mut deepest = 0.0_f64;
            for _ in 0..3_000 {
                environment.step_with_wrench(into * 8.0, 0.05);
                let clearance = wall.clearance(&environment.touched.outline, &environment.pose());
                deepest = deepest.max(-clearance);
            }
            assert!(deepest < 1e-5, "{shape:?}: {deepest} m deep");
            let clearance = wall.clearance(&environment.touched.outline, &environment.pose());
            assert!(
                clearance < 1e-3,
                "{shape:?}: never came to the wall, {clearance} m"
            );
        }
    }
}

#[test]
fn a_body_pressed_against_a_wall_stays_bitwise() {
    let wall = Some(Wall {
        distance_m: 0.18,
        angle_rad: 0.0,
    });
    let mut environment = made(EnvironmentConfig {
        wall,
        ..undamped(Shape::Square)
    });
    let before = bits(&environment);
    for _ in 0..2_000 {
        environment.step_with_wrench(Vec2::new(8.0, 0.9 * C), 0.2);
    }
    assert_eq!(
        bits(&environment),
        before,
        "the wall is smooth, the ground is not"
    );
    for _ in 0..100 {
        environment.step_with_wrench(Vec2::new(8.0, 1.1 * C), 0.0);
    }
    let pose = environment.pose();
    assert!(
        pose.position.y > 1e-4 && pose.position.x.abs() < 1e-9,
        "{pose:?}"
    );
    // and comes off as if there were no wall
    for _ in 0..100 {
        environment.step_with_wrench(Vec2::new(-4.0, 0.0), 0.0);
    }
    assert!(environment.pose().position.x < -5e-3);
}

#[test]
fn a_flying_body_ends_flush_or_stopped_at_the_wall() {
    // nearly without friction, at an angle: one corner strikes, the body swings round
    let wall = Wall {
        distance_m: 0.5,
        angle_rad: 0.0,
    };
    let mut environment = made(EnvironmentConfig {
        friction_coefficient: 0.0,
        wall: Some(wall),
        pose: Pose::new(0.0, 0.0, 0.3),
        ..undamped(Shape::Square)
    });
    environment.set_twist(Twist::new(2.0, 0.0, 0.0));
    let mut energy = environment.kinetic_energy();
    for _ in 0..2_000 {
        environment.step_with_wrench(Vec2::zeros(), 0.0);
        let next = environment.kinetic_energy();
        assert!(next <= energy * (1.0 + 1e-12), "{next} after {energy}");
        energy = next;
        assert!(wall.clearance(&environment.touched.outline, &environment.pose()) > -1e-6);
    }
    assert!(environment.pose().angle.abs() > 0.31 || environment.pose().angle.abs() < 0.29);
}

#[test]
fn a_tool_pushes_a_body_against_a_wall_and_no_further() {
    let wall = Wall {
        distance_m: 0.3,
        angle_rad: 0.0,
    };
    for shape in shapes() {
        let mut environment = made(EnvironmentConfig {
            wall: Some(wall),
            shape,
            ..EnvironmentConfig::default()
        });
        let west = environment.footprint().west;
        let mut force = 0.0;
        for tick in 0..1_500_u32 {
            let gone = (0.15e-3 * f64::from(tick)).min(0.3 - environment.footprint().east + 0.008);
            let tool = Vec2::new(-west + gone, 0.02);
            force = environment.step(tool, Vec2::zeros()).force.norm();
        }
        let clearance = wall.clearance(&environment.touched.outline, &environment.pose());
        assert!(clearance > -1e-5, "{shape:?}: {clearance}");
        assert!(force < 9.0, "{shape:?}: {force}");
    }
}

#[test]
fn a_wrong_body_ground_or_wall_is_named() {
    let wrong = |change: fn(&mut EnvironmentConfig)| {
        let mut config = EnvironmentConfig::default();
        change(&mut config);
        Environment::try_new(config).err().unwrap().to_string()
    };
    let disc = |diameter_m: f64| Shape::Disc { diameter_m };
    assert_eq!(
        Environment::try_new(undamped(disc(f64::NAN)))
            .err()
            .unwrap()
            .to_string(),
        "environment: disc diameter NaN is outside the accepted range 0.02 to 2 m"
    );
    for (name, change) in [
        (
            "brick width inf",
            (|c| {
                c.shape = Shape::Brick {
                    length_m: 0.3,
                    width_m: f64::INFINITY,
                }
            }) as fn(&mut EnvironmentConfig),
        ),
        ("polygon has 0 vertices", |c| {
            c.shape = Shape::Polygon {
                vertices_m: Bounded::default(),
            }
        }),
        ("centre of mass (NaN, 0)", |c| {
            c.centre_of_mass_m.x = f64::NAN
        }),
        ("centre of mass (0.2, 0)", |c| c.centre_of_mass_m.x = 0.2),
        ("static ratio 0.9", |c| c.static_ratio = 0.9),
        ("static ratio NaN", |c| c.static_ratio = f64::NAN),
        ("ripple share 1.5", |c| {
            c.ripple = Some(Ripple {
                share: 1.5,
                period_m: 0.2,
            })
        }),
        ("ripple period NaN", |c| {
            c.ripple = Some(Ripple {
                share: 0.3,
                period_m: f64::NAN,
            })
        }),
        ("patch friction coefficient NaN", |c| {
            c.patches = halves(f64::NAN)
        }),
        ("patch to x -20", |c| {
            c.patches = halves(0.3);
            c.patches.as_mut_slice()[0].to_m.x = -20.0;
        }),
        ("wall angle inf", |c| {
            c.wall = Some(Wall {
                distance_m: 1.0,
                angle_rad: f64::INFINITY,
            })
        }),
        ("wall distance NaN", |c| {
            c.wall = Some(Wall {
                distance_m: f64::NAN,
                angle_rad: 0.0,
            })
        }),
        ("wall distance 0.1", |c| {
            c.wall = Some(Wall {
                distance_m: 0.1,
                angle_rad: 0.0,
            })
        }),
    ] {
        let error = wrong(change);
        assert!(error.contains(name), "{error} does not name {name}");
    }
}

#[test]
fn tools_that_are_not_finite_touch_nothing_of_any_shape() {
    for shape in shapes() {
        let mut environment = made(undamped(shape));
        for bad in [f64::NAN, f64::INFINITY, -f64::MAX] {
            environment.step(Vec2::new(bad, 0.0), Vec2::zeros());
            environment.step_with_wrench(Vec2::new(0.0, bad), 0.0);
        }
        assert_eq!(environment.refused(), 6);
        assert_eq!(environment.pose(), Pose::default());
    }
}

#[test]
fn no_body_goes_through_a_wall_or_gains_energy_from_it_however_it_comes() {
    let mut stream = mmt_shared::rng::Substream::new(11, "test/wall", 0);
    let (mut touched, mut deepest) = (0, 0.0_f64);
    for round in 0..120 {
        let shape = shapes()[round % 5];
        let wall = Wall {
            distance_m: 0.45,
            angle_rad: stream.uniform_in(-3.0, 3.0),
        };
        let mut environment = made(EnvironmentConfig {
            wall: Some(wall),
            friction_coefficient: [0.0, 0.1, 0.6][round % 3],
            static_ratio: [1.0, 1.6][round % 2],
            centre_of_mass_m: Vec2::new(stream.uniform_in(-0.05, 0.05), 0.03),
            ripple: (round % 4 == 0).then(Ripple::default),
            pose: Pose::new(0.0, 0.0, stream.uniform_in(-3.0, 3.0)),
            ..undamped(shape)
        });
        let into = rotate(wall.angle_rad, Vec2::x());
        let along = Vec2::new(-into.y, into.x);
        environment.set_twist(Twist {
            linear: into * stream.uniform_in(0.2, 3.0) + along * stream.uniform_in(-1.0, 1.0),
            angular: stream.uniform_in(-8.0, 8.0),
        });
        let mut energy = environment.kinetic_energy();
        let mut nearest = f64::MAX;
        for tick in 0..600 {
            let pushed = tick >= 300;
            if pushed {
                let push = into * 8.0 + along * stream.uniform_in(-3.0, 3.0);
                environment.step_with_wrench(push, stream.uniform_in(-0.5, 0.5));
            } else {
                environment.step_with_wrench(Vec2::zeros(), 0.0);
            }
            let next = environment.kinetic_energy();
            assert!(
                pushed || next <= energy * (1.0 + 1e-12),
                "{round}: {energy} {next}"
            );
            energy = next;
            nearest =
                nearest.min(wall.clearance(&environment.touched.outline, &environment.pose()));
        }
        deepest = deepest.max(-nearest);
        assert!(nearest > -1e-5, "{round}, {shape:?}: {nearest} m");
        touched += u32::from(nearest < 1e-6);
    }
    println!("{touched} of 120 touched, deepest {deepest:.1e} m");
    assert!(touched > 80, "{touched}");
}
