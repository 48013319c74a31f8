//! The support of an object that is pushed slowly: which force at a point moves that point which way.
//!
//! The ground bears forces and torques up to an ellipsoid, the limit surface (Goyal, Ruina and Papadopoulos 1991): whatever
//! the object stands on, three points or a flat side, is three numbers of it, and where its middle is. A push at a point is
//! the object's motion of least resistance. Frame: the object's, from its reference point.

use mmt_shared::model::geometry::{Vec2, cross, spin};
use serde::Serialize;

/// What the ground does to an object: how much friction, how hard it is to turn, and about which point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Support {
    /// Friction c when the object slides without turning, N.
    pub friction_n: f64,
    /// e/c: friction torque over friction, m; positive.
    pub arm_m: f64,
    /// Centre of friction from the object's reference point, m.
    pub centre_m: Vec2,
}

impl Support {
    /// Friction torque e when the object turns about its centre of friction, N m.
    #[must_use]
    pub fn torque_nm(&self) -> f64 {
        self.friction_n * self.arm_m
    }

    /// The force (N) that moves the point `touched` (m) along `motion`, of any length; zero for none.
    ///
    /// The ellipsoid cut by "moment = lever arm × force": |f|² + (p·f)²/(e/c)² = c² with p = (−r_y, r_x); the
    /// force on that ellipse that does most work on the motion.
    #[must_use]
    pub fn force_at(&self, touched: Vec2, motion: Vec2) -> Vec2 {
        let p = spin(1.0, touched - self.centre_m);
        let arm2 = self.arm_m * self.arm_m;
        let u = motion - p * (p.dot(&motion) / (arm2 + p.norm_squared()));
        let moment = p.dot(&u);
        let length = (u.norm_squared() + moment * moment / arm2).sqrt();
        if length.is_nan() || length < 1e-12 {
            return Vec2::zeros();
        }
        u * (self.friction_n / length)
    }

    /// The force (N) of the unit vector `direction` at the point `touched` (m) under which the object slides.
    #[must_use]
    pub fn force_along(&self, touched: Vec2, direction: Vec2) -> Vec2 {
        let moment = cross(touched - self.centre_m, direction) / self.arm_m;
        direction * (self.friction_n / (1.0 + moment * moment).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mmt_shared::model::geometry::rotate;

    #[test]
    fn a_force_along_its_own_direction_is_the_one_that_moves_the_point() {
        let support = Support {
            friction_n: 4.2,
            arm_m: 0.05,
            centre_m: Vec2::new(0.004, -0.002),
        };
        for k in 0..12 {
            let motion = rotate(0.5 * f64::from(k), Vec2::new(0.01, 0.0));
            let touched = Vec2::new(-0.05, 0.01 * f64::from(k));
            let force = support.force_at(touched, motion);
            let along = support.force_along(touched, force.normalize());
            assert!((force - along).norm() < 1e-9, "{force} {along}");
            assert!(force.norm() <= 4.2 && force.dot(&motion) > 0.0);
        }
        let at_centre = support.force_along(support.centre_m, Vec2::new(1.0, 0.0));
        assert_eq!(at_centre, Vec2::new(4.2, 0.0));
        assert_eq!(
            support.force_at(Vec2::zeros(), Vec2::zeros()),
            Vec2::zeros()
        );
    }
}
