//! A triangular block on a limit surface, pushed by a finger with friction: what is foretold is held against what comes.

use super::*;
use mmt_shared::model::geometry::spin;
use mmt_shared::rng::Substream;

const FINGER_M_PER_S: f64 = 0.0025;
const TRUTH: Support = Support {
    friction_n: 4.2,
    arm_m: 0.06,
    centre_m: Vec2::new(0.004, -0.003),
};
/// Half of the finger's friction cone, rad.
const FRICTION_RAD: f64 = 0.25;
/// The finger is so far from the side where a push begins, m.
const AIR_M: f64 = 0.004;

/// The sides by a point, the normal into the block, and half of the length.
fn sides() -> [(Vec2, Vec2, f64); 3] {
    let slant = Vec2::new(1.0, 1.0).normalize();
    [
        (Vec2::new(-0.05, 0.025), Vec2::new(1.0, 0.0), 0.06),
        (Vec2::new(0.025, -0.05), Vec2::new(0.0, 1.0), 0.06),
        (Vec2::new(0.025, 0.025), -slant, 0.09),
    ]
}

/// The block, what learns of it, and how well it is seen.
struct Bench {
    pose: Pose,
    predictor: ContactPredictor,
    random: Substream,
    /// Noise of the seen pose, m and rad, and ripple of the force as a share of it.
    noise: (f64, f64, f64),
}

/// A push: what was expected of it and what came of it, world frame.
struct Outcome {
    expected: Option<Expected>,
    point: Vec2,
    force: Vec2,
    heading: Vec2,
}

impl Bench {
    fn new(seed: u64, noise: (f64, f64, f64)) -> Self {
        Self {
            pose: Pose::new(0.3, -0.2, 0.7),
            predictor: ContactPredictor::default(),
            random: Substream::new(seed, "test/contact-prediction", 0),
            noise,
        }
    }

    /// A push of 10 mm against a side, somewhere and from somewhere.
    fn push(&mut self, side: usize) -> Outcome {
        let (middle, inward, half) = sides()[side % 3];
        let along = self.random.uniform_in(-half, half) * 0.8;
        let point = middle + spin(1.0, inward) * along;
        let heading = rotate(self.random.uniform_in(-0.9, 0.9), inward);
        self.push_at(point, heading, inward)
    }

    /// The same at a point and in a direction of the block's frame.
    fn push_at(&mut self, point: Vec2, heading: Vec2, inward: Vec2) -> Outcome {
        let to_world = |pose: Pose, v: Vec2| rotate(pose.angle, v);
        let way = to_world(self.pose, heading) * (FINGER_M_PER_S * TICK_S);
        let (mut tool, seen) = (self.pose.point_to_world(point), self.seen());
        let touched = tool;
        tool -= way.normalize() * AIR_M;
        while (tool - touched).dot(&way) < 0.0 {
            self.predictor.step(tool, None, seen);
            tool += way;
        }
        let expected = self.predictor.expected();
        let force = TRUTH.force_at(point, heading);
        let angle = libm::atan2(cross(inward, force), inward.dot(&force));
        let force = if angle.abs() > FRICTION_RAD {
            TRUTH.force_along(point, rotate(FRICTION_RAD.copysign(angle), inward))
        } else {
            force
        };
        let outcome = Outcome {
            expected,
            point: touched,
            force: to_world(self.pose, force),
            heading: way.normalize(),
        };
        for _ in 0..4000 {
            self.slide(&mut tool, way, inward, force);
        }
        // the finger leaves, and images show where the block lies
        let seen = self.seen();
        for _ in 0..400 {
            tool -= way * 50.0;
            self.predictor.step(tool, None, seen);
        }
        outcome
    }

    /// A tick of the push: the twist is normal to the limit surface, and the touched point goes with the finger across the side.
    fn slide(&mut self, tool: &mut Vec2, way: Vec2, inward: Vec2, force: Vec2) {
        *tool += way;
        let lever = self.pose.point_to_object(*tool) - TRUTH.centre_m;
        let turn = cross(lever, force) / (TRUTH.arm_m * TRUTH.arm_m);
        let velocity = force + spin(turn, lever);
        let scale = rotate(-self.pose.angle, way).dot(&inward) / velocity.dot(&inward);
        let centre = self.pose.point_to_world(TRUTH.centre_m);
        let centre = centre + rotate(self.pose.angle, force * scale);
        self.pose.angle += turn * scale;
        self.pose.position = centre - rotate(self.pose.angle, TRUTH.centre_m);
        let ripple = 1.0 + self.noise.2 * self.random.normal();
        let felt = rotate(self.pose.angle, force) * ripple;
        self.predictor.step(*tool, Some(felt), self.pose);
    }

    fn seen(&mut self) -> Pose {
        let (place, angle, _) = self.noise;
        let mut draw = |size: f64| self.random.normal() * size;
        Pose {
            position: self.pose.position + Vec2::new(draw(place), draw(place)),
            angle: self.pose.angle + draw(angle),
        }
    }
}

/// Of the last ten of `pushes` how far the touch was off along the finger's way (m) and the force as a share of it; the worst.
fn worst(seed: u64, pushes: usize, noise: (f64, f64, f64)) -> (f64, f64) {
    let mut bench = Bench::new(seed, noise);
    let mut worst = (0.0_f64, 0.0_f64);
    for n in 0..pushes {
        let outcome = bench.push(n);
        if n + 10 < pushes {
            continue;
        }
        let expected = outcome.expected.unwrap();
        let off = (expected.point - outcome.point).dot(&outcome.heading);
        let error = (expected.force - outcome.force).norm() / outcome.force.norm();
        worst = (worst.0.max(off.abs()), worst.1.max(error));
    }
    worst
}

#[test]
fn the_next_touch_and_its_force_are_foretold_from_the_pushes_before() {
    for seed in [3, 61, 702] {
        let (off_m, error) = worst(seed, 40, (0.0, 0.0, 0.0));
        assert!(off_m < 1e-4, "{seed}: {off_m} m");
        assert!(error < 0.1, "{seed}: {error}");
    }
}

#[test]
fn noisy_images_and_a_rippling_force_make_it_worse_but_not_wrong() {
    for seed in [3, 61, 702] {
        let (off_m, error) = worst(seed, 50, (3e-4, 3e-3, 0.1));
        assert!(off_m < 2e-3, "{seed}: {off_m} m");
        assert!(error < 0.3, "{seed}: {error}");
    }
}

#[test]
fn the_support_is_learned_whatever_it_is() {
    let mut bench = Bench::new(9, (0.0, 0.0, 0.0));
    for n in 0..50 {
        bench.push(n);
    }
    let support = &bench.predictor.support;
    assert!((support.friction_n / 4.2 - 1.0).abs() < 0.05, "{support:?}");
    assert!((support.arm_m / 0.06 - 1.0).abs() < 0.15, "{support:?}");
    assert!((support.centre_m - TRUTH.centre_m).norm() < 3e-3);
    assert!((bench.predictor.cone - FRICTION_RAD).abs() < 0.08);
}

/// A bench that has learned.
fn learned() -> Bench {
    let mut bench = Bench::new(5, (0.0, 0.0, 0.0));
    for n in 0..30 {
        bench.push(n);
    }
    bench
}

/// What is expected of a finger at so many m/s that ends so far before (m, negative: behind) the middle of a side.
fn expected_of(bench: &mut Bench, m_per_s: f64, before_m: f64) -> Option<Expected> {
    let (middle, inward, _) = sides()[0];
    let end = bench.pose.point_to_world(middle - inward * before_m);
    let way = rotate(bench.pose.angle, inward) * (m_per_s * TICK_S);
    let pose = bench.pose;
    for n in (0..800).rev() {
        let tool = end - way * f64::from(n);
        bench.predictor.step(tool, None, pose);
    }
    bench.predictor.expected()
}

#[test]
fn only_a_finger_that_goes_slowly_towards_a_side_is_expected_to_touch_it() {
    let mut bench = learned();
    for (m_per_s, before_m, touches) in [
        (0.0025, 0.001, true),
        (0.0025, -0.001, true),
        // it should have touched it long ago
        (0.0025, -0.003, false),
        // the side is too far away to be known to lie on the way
        (0.0025, 0.03, false),
        (-0.0025, 0.001, false),
        (0.0, 0.001, false),
        (0.05, 0.001, false),
    ] {
        let expected = expected_of(&mut bench, m_per_s, before_m);
        assert_eq!(expected.is_some(), touches, "{m_per_s} m/s, {before_m} m");
    }
}

#[test]
fn nothing_is_expected_before_pushes_nor_without_images() {
    let mut bench = Bench::new(5, (0.0, 0.0, 0.0));
    assert_eq!(bench.push(0).expected, None);
    assert_eq!(bench.push(1).expected, None);
    // nobody sees the block: it is where it was at first, and seems not to have been moved
    let mut blind = ContactPredictor::default();
    let seen = Pose::new(0.3, -0.2, 0.7);
    for n in 0..20_000_u32 {
        let phase = n % 2000;
        let tool = seen.position - Vec2::new(0.06 - 1e-5 * f64::from(phase), 0.0);
        let force = (500..1500).contains(&phase).then_some(Vec2::new(4.0, 0.0));
        blind.step(tool, force, seen);
        assert_eq!(blind.expected().filter(|_| phase < 500), None);
    }
}

#[test]
fn a_push_takes_no_part_in_its_own_prediction_and_a_number_that_is_none_in_no_one() {
    let run = |bench: &mut Bench, force: Vec2| {
        let before = expected_of(bench, 0.0025, 0.0);
        let (middle, _, _) = sides()[0];
        let tool = bench.pose.point_to_world(middle);
        for _ in 0..500 {
            bench.predictor.step(tool, Some(force), bench.pose);
        }
        assert_eq!(bench.predictor.expected(), before);
        before
    };
    let none = Vec2::new(f64::NAN, 0.0);
    let expected = run(&mut learned(), Vec2::new(50.0, 0.0));
    let mut bench = learned();
    run(&mut bench, none);
    bench.predictor.step(none, None, bench.pose);
    bench
        .predictor
        .step(none, Some(none), Pose::new(f64::INFINITY, 0.0, 0.0));
    let (after, expected) = (expected_of(&mut bench, 0.0025, 0.0), expected.unwrap());
    assert!((after.unwrap().force - expected.force).norm() < 1e-9);
}

#[test]
fn a_line_across_a_corner_is_no_side_and_an_outline_needs_no_corners() {
    let touch = |x: f64, y: f64, force: Vec2| Touch {
        point: Vec2::new(x, y),
        force: force.normalize(),
    };
    let (east, north) = (Vec2::new(1.0, 0.0), Vec2::new(0.0, 1.0));
    // two touches, one on each of two sides
    let corner = [touch(-0.05, 0.0, east), touch(0.0, -0.05, north)];
    assert_eq!(outline::sides(&corner), []);
    // two rows of touches: what has touches beyond it is no side
    let rows = [-0.05, -0.02].map(|x| [-0.02, 0.0, 0.02].map(|y| touch(x, y, east)));
    let sides = outline::sides(rows.as_flattened());
    assert_eq!(sides.len(), 1, "{sides:?}");
    let enters = |y: f64| outline::ahead(&sides, Vec2::new(-0.06, y), east);
    assert!((enters(0.06).unwrap().0 - 0.01).abs() < 1e-9);
    assert!(
        enters(0.08).is_none(),
        "nobody knows how far the side goes on"
    );
    // a round body: short lines all round it, none of which cuts off more than a touch is known to
    let round: Vec<Touch> = (0..40)
        .map(|k| rotate(0.157 * f64::from(k), east))
        .map(|inward| touch(-0.05 * inward.x, -0.05 * inward.y, inward))
        .collect();
    let sides = outline::sides(&round);
    assert!(sides.len() > 8, "{}", sides.len());
    for side in &sides {
        let (distance, _) =
            outline::ahead(&[*side], Vec2::zeros() - side.inward * 0.06, side.inward).unwrap();
        assert!((distance - 0.01).abs() < 2e-3, "{distance}");
    }
}
