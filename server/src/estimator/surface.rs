//! Where the object's surface is, and how it moves, from the tool and the force: the force law inverted.
//!
//! The paper takes the tool's motion for the object's (section II-A), but the virtual coupling between
//! them gives: at 1.5–3 Hz the rate of the penetration is some 10 % of the velocity. With
//! f = k_p pen + k_d d(pen)/dt known, pen follows from f and the surface from the tool. The normal is here the direction
//! of the force, which is known sooner than the pose; the pose observer inverts the same law along a face. It must never
//! smooth: that is the work of the one filter that force and motion share.

use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::time::TICK_S;
use nalgebra::Vector3;

use super::filter::Row;

/// Raw motion of the surface point under the tool and the force that caused it, in one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SurfaceMotion {
    /// The surface point, world frame, m.
    pub point: Vec2,
    /// Its velocity, world frame, m/s.
    pub velocity: Vec2,
    /// a·n, v·n and the sign s still 0; and the force f·n of the step that led to this motion.
    pub row: Row,
}

/// Follows the surface point while the tool touches.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surface {
    coupling: Coupling,
    penetration: f64,
    force: Vec2,
    point: Option<Vec2>,
    velocity: Option<Vec2>,
}

impl Surface {
    /// Of an object touched through `coupling`.
    #[must_use]
    pub(super) fn new(coupling: Coupling) -> Self {
        Self {
            coupling,
            penetration: 0.0,
            force: Vec2::zeros(),
            point: None,
            velocity: None,
        }
    }

    /// Contact was lost: the surface is out of sight.
    pub(super) fn reset(&mut self) {
        *self = Self::new(self.coupling);
    }

    /// Depth of the tool behind the surface along the normal, m.
    #[must_use]
    pub(super) fn depth(&self) -> f64 {
        self.penetration
    }

    /// Takes one tick in contact and returns the surface point under the tool, m: tool (m), force on the object (N), inward
    /// unit normal n.
    #[must_use]
    pub(super) fn locate(&mut self, tool: Vec2, force: Vec2, normal: Vec2) -> Vec2 {
        let force = force.dot(&normal);
        self.penetration = (self.coupling).penetration(force, self.penetration, TICK_S);
        tool - normal * self.penetration
    }

    /// Takes one tick in contact and returns the motion, as [`Surface::locate`] takes it.
    ///
    /// The motion is known from the third tick on. The force of the row is that of the tick before: tool
    /// and force of one tick give the surface *before* the step in which that force acts, so
    /// `m (v_n − v_{n−1})/T + b v_n + c sign(v_n) = f_n` pairs each motion with the force one tick older.
    pub(super) fn step(&mut self, tool: Vec2, force: Vec2, normal: Vec2) -> Option<SurfaceMotion> {
        let point = self.locate(tool, force, normal);
        let velocity = self.point.map(|before| (point - before) / TICK_S);
        let acceleration = velocity
            .zip(self.velocity)
            .map(|(now, before)| (now - before) / TICK_S);
        let acted = self.force;
        (self.point, self.velocity, self.force) = (Some(point), velocity, force);
        let (v, a) = velocity.zip(acceleration)?;
        Some(SurfaceMotion {
            point,
            velocity: v,
            row: Row {
                regressor: Vector3::new(a.dot(&normal), v.dot(&normal), 0.0),
                force: acted.dot(&normal),
                scale: 1.0,
            },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_surface_is_found_through_the_coupling() {
        let coupling = Coupling::for_stiffness(1000.0);
        let mut surface = Surface::new(coupling);
        let normal = Vec2::new(0.6, 0.8);
        let (mut pen_before, mut worst) = (0.0, 0.0_f64);
        for k in 0..2000 {
            let t = f64::from(k) * TICK_S;
            let pen = 0.002 * (1.0 - libm::exp(-t / 0.1)) + 0.0005 * libm::sin(12.0 * t);
            let truth = Vec2::new(0.1 * t, -0.03 * t);
            let force = normal * coupling.force(pen, (pen - pen_before) / TICK_S);
            pen_before = pen;
            if let Some(motion) = surface.step(truth + normal * pen, force, normal) {
                worst = worst.max((motion.point - truth).norm());
            }
        }
        assert!(worst < 1e-12, "{worst}");
    }
}
