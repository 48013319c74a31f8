//! A rigid, smooth wall that stops the body: limits on the velocity of the points that are about to touch.
//!
//! With gap_j the distance of a point to the wall and a_j its velocity away from the wall per u, a step
//! keeps `a_j·u ≥ −gap_j⁺/T`: exactly inelastic, without penetration to first order in the step. Rest is
//! always within the limits, so a wall never adds energy. It must never pull, and never push out.

use mmt_shared::model::geometry::{Pose, Vec2, cross, rotate};
use mmt_shared::model::params::SPEED_M_PER_S;
use mmt_shared::time::TICK_S;
use nalgebra::{Cholesky, Const, Vector3};
use serde::{Deserialize, Serialize};

use super::outline::Outline;

/// Farthest that any point of the body goes in one period, with room, m.
const WITHIN_REACH_M: f64 = 10.0 * SPEED_M_PER_S * TICK_S;

/// A wall: all places p with n·p ≥ distance are solid, n = (cos angle, sin angle). The tool passes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Wall {
    /// Distance of the wall's face from the world's origin, m; negative if the origin is inside.
    pub distance_m: f64,
    /// Which way the wall stands, rad from the world's x, counter-clockwise. Default 0: towards +x.
    #[serde(default)]
    pub angle_rad: f64,
}

/// One point that is near the wall.
#[derive(Clone, Copy, Debug, Default)]
struct Limit {
    /// The point's velocity away from the wall per u = (v, omega), body frame.
    away: Vector3<f64>,
    /// Its least accepted value, m/s, never positive.
    least: f64,
    /// How far from the wall the point would be at the end of the step at the velocity of before, m.
    gap: f64,
}

/// The limits that the wall sets in one step: none, one, or two where a face may come to lie flush.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Limits {
    limits: [Option<Limit>; 2],
}

impl Wall {
    /// Unit vector into the wall.
    fn normal(&self) -> Vec2 {
        rotate(self.angle_rad, Vec2::x())
    }

    /// Least distance of an outline to the wall, m; negative if it is inside.
    pub(super) fn clearance(&self, outline: &Outline, pose: &Pose) -> f64 {
        let into = rotate(-pose.angle, self.normal());
        let reach = match outline {
            Outline::Circle(radius) => *radius,
            Outline::Corners(corners) => {
                let depths = corners.as_slice().iter().map(|corner| into.dot(corner));
                depths.fold(f64::MIN, f64::max)
            }
        };
        self.distance_m - self.normal().dot(&pose.position) - reach
    }

    /// The limits on a body at `pose` (its centroid), its centre of mass as far from there, that has the
    /// velocity `before` (of its centre of mass, body frame).
    ///
    /// A point's lever is taken as it will be half a period later: taken as it is now, a turning body
    /// would creep into the wall or off it by the curvature of its points' paths.
    pub(super) fn limits(
        &self,
        outline: &Outline,
        pose: &Pose,
        centre_of_mass: Vec2,
        before: &Vector3<f64>,
    ) -> Limits {
        let into = rotate(-pose.angle, self.normal());
        let left = self.distance_m - self.normal().dot(&pose.position);
        let (sin, cos) = libm::sincos(0.5 * before.z * TICK_S);
        let later = |r: Vec2| Vec2::new(cos * r.x - sin * r.y, sin * r.x + cos * r.y);
        let mut limits = Limits::default();
        let mut offer = |point: Vec2, lever: Vec2| {
            let gap = left - into.dot(&point);
            let away = -Vector3::new(into.x, into.y, cross(lever, into));
            limits.offer(Limit {
                away,
                least: -gap.max(0.0) / TICK_S,
                gap: gap + away.dot(before) * TICK_S,
            });
        };
        match outline {
            Outline::Circle(radius) => {
                let point = into * *radius;
                offer(point, point - later(centre_of_mass));
            }
            Outline::Corners(corners) => {
                for corner in corners.as_slice() {
                    offer(*corner, later(corner - centre_of_mass));
                }
            }
        }
        limits
    }
}

impl Limits {
    /// Keeps the two points that come nearest to the wall.
    fn offer(&mut self, limit: Limit) {
        if limit.gap > WITHIN_REACH_M {
            return;
        }
        let nearer = |slot: &Option<Limit>| slot.is_none_or(|other| limit.gap < other.gap);
        let [first, second] = &mut self.limits;
        if nearer(first) {
            (*second, *first) = (*first, Some(limit));
        } else if nearer(second) {
            *second = Some(limit);
        }
    }

    /// As much of a velocity as the limits allow in its direction.
    pub(super) fn shortened(&self, u: Vector3<f64>) -> Vector3<f64> {
        let share = |limit: &Limit| {
            let speed = limit.away.dot(&u);
            if speed < limit.least {
                limit.least / speed
            } else {
                1.0
            }
        };
        let shares = self.limits.iter().flatten().map(share);
        let least = shares.fold(1.0, f64::min);
        if least < 1.0 { u * least } else { u }
    }

    /// The step p that minimises ½ pᵀHp + gᵀp with u + p within the limits, H given by its factor, and
    /// the impulse of the points that touch the wall already.
    ///
    /// With two limits the minimiser has none of them active, one, or both: each case is tried.
    pub(super) fn descend(
        &self,
        factor: &Cholesky<f64, Const<3>>,
        gradient: &Vector3<f64>,
        u: &Vector3<f64>,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let newton = -factor.solve(gradient);
        let [Some(one), other] = self.limits else {
            return (newton, Vector3::zeros());
        };
        let held = |limit: &Limit, p: &Vector3<f64>| limit.lack(u, p) <= 0.0;
        let both_hold =
            |p: &Vector3<f64>| held(&one, p) && other.is_none_or(|other| held(&other, p));
        if both_hold(&newton) {
            return (newton, Vector3::zeros());
        }
        for limit in [Some(one), other].into_iter().flatten() {
            let answer = factor.solve(&limit.away);
            let force = limit.lack(u, &newton) / limit.away.dot(&answer);
            let p = newton + answer * force;
            let rest = |other: &Limit| other.away == limit.away || held(other, &p);
            if force >= 0.0 && rest(&one) && other.is_none_or(|other| rest(&other)) {
                return (p, limit.impulse(force));
            }
        }
        other.map_or_else(
            || (newton, Vector3::zeros()),
            |other| corner(factor, newton, u, &one, &other),
        )
    }
}

impl Limit {
    /// By how much u + p goes beyond the limit, m/s.
    fn lack(&self, u: &Vector3<f64>, p: &Vector3<f64>) -> f64 {
        self.least - self.away.dot(u) - self.away.dot(p)
    }

    /// The wall's impulse on a point that touches; none on a point that has still some way to go.
    fn impulse(&self, force: f64) -> Vector3<f64> {
        if self.least < 0.0 {
            Vector3::zeros()
        } else {
            self.away * force
        }
    }
}

/// The step with both limits active.
fn corner(
    factor: &Cholesky<f64, Const<3>>,
    newton: Vector3<f64>,
    u: &Vector3<f64>,
    one: &Limit,
    other: &Limit,
) -> (Vector3<f64>, Vector3<f64>) {
    let answers = [factor.solve(&one.away), factor.solve(&other.away)];
    let lacks = [one.lack(u, &newton), other.lack(u, &newton)];
    let [a, b] = answers;
    let (aa, ab, bb) = (one.away.dot(&a), one.away.dot(&b), other.away.dot(&b));
    let determinant = aa * bb - ab * ab;
    let forces = [
        (bb * lacks[0] - ab * lacks[1]) / determinant,
        (aa * lacks[1] - ab * lacks[0]) / determinant,
    ]
    .map(|force: f64| force.max(0.0));
    let p = newton + a * forces[0] + b * forces[1];
    (p, one.impulse(forces[0]) + other.impulse(forces[1]))
}
