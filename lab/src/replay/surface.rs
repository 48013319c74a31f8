//! Quasi-static friction laws: from how a block moved to the force that pushed it.
//!
//! The block slides so slowly that the push equals the ground friction, so a law needs the direction of a
//! motion only, never its speed; mass and damping cannot be seen. Held here: Coulomb friction as in (1)
//! and (5), decoupled from turning; the ellipsoidal limit surface (Goyal), from the whole twist or for a
//! push at one point; friction under three equal supports. A law must never see the force it predicts.
//!
//! A push at a point is the block's motion of least resistance: with v_p the displacement of the touched
//! point, the force is the gradient of min over omega of D(v_p, omega), D the power lost to friction
//! (equivalently: of all forces at that point that the surface bears, the one that does most work on v_p).
//! The measured turning then enters by v_p alone, which is what makes this prediction the more robust one.

use mmt_server::contact_prediction::Support;
use mmt_shared::model::geometry::{Vec2, cross, rotate, spin};
use mmt_shared::recording::Push;
use serde::Serialize;

/// Displacement below which friction at a support is taken as not fully developed, m: the noise of the
/// recorded poses. It smooths the corner of |v| at v = 0.
const SLIP_FLOOR_M: f64 = 3e-4;
/// Supports of the three-point law in multiples of one length s: a right triangle around its centroid.
const SUPPORTS: [(f64, f64); 3] = [(-1.0, -1.0), (2.0, -1.0), (-1.0, 2.0)];
/// e/(c s) of the three-point law: the mean distance of [`SUPPORTS`] from their centroid, (√2 + 2√5)/3.
const SUPPORT_ARM: f64 = 1.962_116_4;
/// Doublings of the bracket, and halvings, in the search for the turning of least resistance.
const BRACKET_STEPS: u32 = 40;

/// How ground friction answers a motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Law {
    /// (i): force c along the displacement of the reference point; turning takes no part.
    Decoupled,
    /// (ii): ellipsoidal limit surface; force from the displacement and turning of the centre of friction.
    LimitSurfaceTwist,
    /// (ii) for a push at one point: the same surface; force from the displacement of the touched point.
    LimitSurface,
    /// (iii): three equal supports at the corners of a right triangle; push at one point.
    ThreePoint,
}

impl Law {
    /// All laws, in the order of reports.
    pub const ALL: [Self; 4] = [
        Self::Decoupled,
        Self::LimitSurfaceTwist,
        Self::LimitSurface,
        Self::ThreePoint,
    ];

    /// The name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Decoupled => "(i) decoupled",
            Self::LimitSurfaceTwist => "(ii) surface, twist",
            Self::LimitSurface => "(ii) surface, point",
            Self::ThreePoint => "(iii) three points",
        }
    }

    /// Force on the block in its own frame (N) that this law expects for a motion on the support
    /// `surface`; zero for no motion.
    #[must_use]
    pub fn force(self, surface: &Support, motion: &PushMotion) -> Vec2 {
        match self {
            Self::Decoupled => unit(motion.displacement) * surface.friction_n,
            Self::LimitSurfaceTwist => from_twist(surface, motion),
            Self::LimitSurface => surface.force_at(motion.touched, motion.at_touch()),
            Self::ThreePoint => on_three_points(surface, motion),
        }
    }
}

/// What is known of a push's motion, without any of its forces. Block's frame, halfway through the turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PushMotion {
    /// Displacement of the reference point, m (of the screw motion: constant in the block's frame).
    pub displacement: Vec2,
    /// Turning, rad, counter-clockwise.
    pub turn: f64,
    /// Where the finger touched at the end: its tip, from the reference point, m.
    pub touched: Vec2,
    /// Orientation of the block halfway, rad: carries forces to the world.
    pub halfway: f64,
}

impl PushMotion {
    /// The motion of a recorded push, from the poses before and after and the finger's last position.
    #[must_use]
    pub fn of(push: &Push) -> Self {
        let turn = push.after.angle - push.before.angle;
        let halfway = push.before.angle + turn / 2.0;
        let chord = rotate(-halfway, push.after.position - push.before.position);
        // The path of a point under a screw motion is longer than its chord by (turn/2)/sin(turn/2).
        let half = turn / 2.0;
        let stretch = if half.abs() < 1e-6 {
            1.0
        } else {
            half / libm::sin(half)
        };
        let finger = push.finger.last().map(|sample| sample.pose.position);
        let tip = finger.unwrap_or(push.after.position);
        Self {
            displacement: chord * stretch,
            turn,
            touched: push.after.point_to_object(tip),
            halfway,
        }
    }

    /// Displacement of the touched point, m.
    fn at_touch(&self) -> Vec2 {
        self.displacement + spin(self.turn, self.touched)
    }
}

/// `v` made one long, or zero if it is too short to have a direction.
fn unit(v: Vec2) -> Vec2 {
    v.try_normalize(1e-12).unwrap_or_else(Vec2::zeros)
}

/// f = c v / sqrt(|v|² + (e/c)² w²), v at the centre of friction.
fn from_twist(surface: &Support, motion: &PushMotion) -> Vec2 {
    let v = motion.displacement + spin(motion.turn, surface.centre_m);
    let w = surface.arm_m * motion.turn;
    let length = (v.norm_squared() + w * w).sqrt();
    if length < 1e-12 {
        return Vec2::zeros();
    }
    v * (surface.friction_n / length)
}

/// Coulomb friction c/3 at three supports; the block turns about the touched point with least resistance.
fn on_three_points(surface: &Support, motion: &PushMotion) -> Vec2 {
    let v = motion.at_touch();
    if v.norm() < 1e-12 {
        return Vec2::zeros();
    }
    let s = surface.arm_m / SUPPORT_ARM;
    let arms = SUPPORTS.map(|(x, y)| surface.centre_m + Vec2::new(x, y) * s - motion.touched);
    let share = surface.friction_n / 3.0;
    let pull = |omega: f64, arm: Vec2| {
        let slip = v + spin(omega, arm);
        slip * (share / (slip.norm_squared() + SLIP_FLOOR_M * SLIP_FLOOR_M).sqrt())
    };
    // dD/domega, which increases with omega: D is convex.
    let slope = |omega: f64| -> f64 { arms.iter().map(|arm| cross(*arm, pull(omega, *arm))).sum() };
    let omega = root_of_increasing(slope, v.norm() / surface.arm_m);
    arms.iter().map(|arm| pull(omega, *arm)).sum()
}

/// Where an increasing function crosses zero; `scale` is a first guess of how far that is from zero.
fn root_of_increasing(f: impl Fn(f64) -> f64, scale: f64) -> f64 {
    let (mut low, mut high) = (-scale, scale);
    for _ in 0..BRACKET_STEPS {
        if f(low) > 0.0 {
            low *= 2.0;
        } else if f(high) < 0.0 {
            high *= 2.0;
        } else {
            break;
        }
    }
    for _ in 0..BRACKET_STEPS {
        let middle = 0.5 * (low + high);
        if f(middle) > 0.0 {
            high = middle;
        } else {
            low = middle;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SURFACE: Support = Support {
        friction_n: 4.2,
        arm_m: 0.05,
        centre_m: Vec2::new(0.004, -0.002),
    };

    fn motion(x: f64, y: f64, turn: f64, touched: Vec2) -> PushMotion {
        PushMotion {
            displacement: Vec2::new(x, y),
            turn,
            touched,
            halfway: 0.0,
        }
    }

    #[test]
    fn without_turning_and_with_no_moment_every_law_is_coulomb_friction() {
        let push = motion(0.010, 0.0, 0.0, Vec2::new(-0.05, SURFACE.centre_m.y));
        for law in Law::ALL {
            let force = law.force(&SURFACE, &push);
            assert!(
                (force - Vec2::new(4.2, 0.0)).norm() < 0.01,
                "{law:?} {force}"
            );
        }
    }

    #[test]
    fn turning_takes_force_from_sliding_but_not_where_the_two_are_decoupled() {
        let straight = motion(0.010, 0.0, 0.0, Vec2::new(-0.05, 0.0));
        let turning = motion(0.010, 0.0, 0.2, Vec2::new(-0.05, -0.06));
        let sizes = |law: Law| {
            let size = |motion| law.force(&SURFACE, motion).norm();
            (size(&straight), size(&turning))
        };
        let (before, after) = sizes(Law::Decoupled);
        assert_eq!(before, after);
        for law in [Law::LimitSurfaceTwist, Law::LimitSurface, Law::ThreePoint] {
            let (before, after) = sizes(law);
            assert!(after < 0.9 * before, "{law:?}");
        }
    }

    #[test]
    fn the_twist_of_least_resistance_gives_both_forms_of_the_ellipsoid_the_same_force() {
        // A wrench through the touched point, the twist that it causes by normality, and back.
        let touched = Vec2::new(-0.05, 0.06);
        for k in 0..12 {
            let direction = rotate(0.5 * f64::from(k), Vec2::new(1.0, 0.0));
            let moment = cross(touched - SURFACE.centre_m, direction);
            let turn = 0.01 * moment / (SURFACE.arm_m * SURFACE.arm_m);
            let at_centre = direction * 0.01;
            let at_reference = at_centre - spin(turn, SURFACE.centre_m);
            let push = motion(at_reference.x, at_reference.y, turn, touched);
            let twist = Law::LimitSurfaceTwist.force(&SURFACE, &push);
            let point = Law::LimitSurface.force(&SURFACE, &push);
            assert!((twist - point).norm() < 1e-9);
            assert!(cross(twist, direction).abs() < 1e-9);
        }
    }

    #[test]
    fn no_law_depends_on_how_far_the_block_went_beyond_the_slip_floor() {
        let touched = Vec2::new(-0.05, 0.03);
        let short = motion(0.01, 0.004, -0.1, touched);
        let long = motion(0.04, 0.016, -0.4, touched);
        for law in Law::ALL {
            let change = law.force(&SURFACE, &short) - law.force(&SURFACE, &long);
            assert!(change.norm() < 0.02, "{law:?} {change}");
        }
    }

    #[test]
    fn three_supports_bear_at_most_the_whole_friction_and_the_block_turns_to_the_least_resistance()
    {
        let push = motion(0.01, 0.0, 0.0, Vec2::new(-0.05, 0.1));
        let force = Law::ThreePoint.force(&SURFACE, &push);
        assert!(force.norm() < 4.2);
        // The force is the gradient of a function that is homogeneous in v_p: work = resistance, which no
        // other turning makes smaller.
        let s = SURFACE.arm_m / SUPPORT_ARM;
        let v = push.at_touch();
        let resistance = |omega: f64| -> f64 {
            SUPPORTS
                .iter()
                .map(|(x, y)| {
                    let arm = SURFACE.centre_m + Vec2::new(*x, *y) * s - push.touched;
                    1.4 * (v + spin(omega, arm)).norm()
                })
                .sum()
        };
        let least = (-400..=400)
            .map(|k| resistance(f64::from(k) * 1e-3))
            .fold(f64::INFINITY, f64::min);
        assert!((force.dot(&v) / least - 1.0).abs() < 0.01);
    }

    #[test]
    fn the_arm_of_the_three_supports_is_their_mean_distance() {
        let mean: f64 = SUPPORTS
            .iter()
            .map(|(x, y)| Vec2::new(*x, *y).norm())
            .sum::<f64>()
            / 3.0;
        assert!((mean - SUPPORT_ARM).abs() < 1e-6, "{mean}");
    }

    #[test]
    fn no_motion_gives_no_force_and_no_nan() {
        for law in Law::ALL {
            for touched in [Vec2::zeros(), SURFACE.centre_m, Vec2::new(-0.05, 0.0)] {
                assert_eq!(
                    law.force(&SURFACE, &motion(0.0, 0.0, 0.0, touched)),
                    Vec2::zeros()
                );
            }
        }
    }
}
