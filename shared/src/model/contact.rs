//! The proxy–HIP contact with the box: which face is touched, how deep, and the force law.
//!
//! Holds (6) with contact damping. The master's local model, the slave's shadow and the slave's real
//! environment all touch through this file. It must never let the proxy change face while the HIP is
//! behind the face it entered by (a god object), and never pull.
//!
//! Force law: with n the inward normal of the touched face and pen = n·(HIP − proxy) ≥ 0,
//! `f = (k_p pen + k_d d(pen)/dt)⁺ n`; f acts on the object, the hand gets −f.

use serde::{Deserialize, Serialize};

use crate::model::geometry::{BoxFootprint, Face, Pose, Twist, Vec2, rotate};

/// Stiffness and damping of the virtual coupling between the HIP and the proxy.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Coupling {
    /// Virtual stiffness k_p, N/m (world metres).
    pub stiffness_n_per_m: f64,
    /// Contact damping k_d, N s/m. Zero is (6) to the letter, and rings.
    pub damping_ns_per_m: f64,
}

impl Coupling {
    /// The coupling of a given stiffness k_p with the damping that keeps the contact from ringing:
    /// 10 N s/m at 1000 N/m, 20 N s/m at 3000 N/m, linear between and beyond, never negative.
    pub fn for_stiffness(k_p: f64) -> Self {
        Self {
            stiffness_n_per_m: k_p,
            damping_ns_per_m: (5.0 + k_p * 0.005).max(0.0),
        }
    }

    /// Size of the contact force, N, never negative.
    ///
    /// `penetration` is pen in m, `penetration_rate` its rate d(pen)/dt in m/s.
    pub fn force(&self, penetration: f64, penetration_rate: f64) -> f64 {
        // (6), with the damping term; (·)⁺ because a smooth tool cannot pull
        (self.stiffness_n_per_m * penetration + self.damping_ns_per_m * penetration_rate).max(0.0)
    }

    /// The force law inverted: the penetration, m, after a period of `period_s`, s, under a force along the inward normal, N.
    /// `before` is the penetration at its beginning, m.
    pub fn penetration(&self, force: f64, before: f64, period_s: f64) -> f64 {
        // f = k_p pen_n + k_d (pen_n − pen_{n−1})/T
        let k_d_per_period = self.damping_ns_per_m / period_s;
        (force + k_d_per_period * before) / (self.stiffness_n_per_m + k_d_per_period)
    }

    /// Elastic energy stored in the coupling at a penetration (m), J.
    pub fn energy(&self, penetration: f64) -> f64 {
        0.5 * self.stiffness_n_per_m * penetration * penetration
    }
}

/// The touch of the HIP and one face of the box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// The face that the HIP entered by.
    pub face: Face,
    /// Unit normal of the face, pointing into the box, world frame.
    pub inward: Vec2,
    /// The proxy: the HIP's foot on the face, world frame, m.
    pub proxy: Vec2,
    /// pen = n·(HIP − proxy), m, never negative.
    pub penetration: f64,
}

/// No hand presses deeper than this, m: 50 N at 1000 N/m. What lies deeper after a jump was not pressed.
pub const DEEPEST_M: f64 = 0.05;

/// The god-object proxy: remembers the face that the HIP entered by.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GodObject {
    touched: Option<Face>,
    /// The last HIP that was outside, in the object's frame of then.
    outside: Option<Vec2>,
}

impl GodObject {
    /// The face that is touched now.
    pub fn touched(&self) -> Option<Face> {
        self.touched
    }

    /// This face is touched, however deep the HIP is behind it.
    pub fn enter_by(&mut self, face: Face) {
        self.touched = Some(face);
    }

    /// Follows the HIP and returns what it touches.
    ///
    /// The face entered by is kept until the HIP leaves its half-plane or passes its end.
    pub fn follow(&mut self, footprint: &BoxFootprint, pose: &Pose, hip: Vec2) -> Option<Touch> {
        let hip_in_object = pose.point_to_object(hip);
        if let Some(face) = self.touched {
            let left = footprint.distance(face, hip_in_object) > 0.0;
            if left || !footprint.within_ends(face, hip_in_object) {
                self.touched = None;
            }
        }
        if self.touched.is_none() {
            let (nearest, distance) = footprint.nearest(hip_in_object);
            if distance > 0.0 {
                self.outside = Some(hip_in_object);
                return None;
            }
            // Entered: by the face that the last point outside was in front of.
            let entered = self
                .outside
                .map_or(nearest, |outside| footprint.nearest(outside).0);
            let behind = footprint.distance(entered, hip_in_object) <= 0.0;
            self.touched = Some(if behind { entered } else { nearest });
        }
        self.touched
            .map(|face| touch(footprint, pose, face, hip_in_object))
    }

    /// The box was set to another pose. What was touched by the old one stays touched if the HIP is inside the new
    /// one and at most [`DEEPEST_M`] behind that face; else the memory begins anew, with a HIP that is outside.
    pub fn after_jump(&mut self, footprint: &BoxFootprint, pose: &Pose, hip: Vec2) {
        let hip_in_object = pose.point_to_object(hip);
        let is_inside = footprint.nearest(hip_in_object).1 <= 0.0;
        let touch = self.touch_at(footprint, pose, hip);
        if !is_inside {
            *self = Self {
                touched: None,
                outside: Some(hip_in_object),
            };
        } else if touch.is_none_or(|touch| touch.penetration > DEEPEST_M) {
            *self = Self::default();
        }
    }

    /// What the HIP touches, if it keeps its face, with the box at another pose. Changes nothing.
    pub fn touch_at(&self, footprint: &BoxFootprint, pose: &Pose, hip: Vec2) -> Option<Touch> {
        let mut copy = *self;
        copy.follow(footprint, pose, hip)
    }
}

fn touch(footprint: &BoxFootprint, pose: &Pose, face: Face, hip_in_object: Vec2) -> Touch {
    let penetration = (-footprint.distance(face, hip_in_object)).max(0.0);
    let proxy_in_object = hip_in_object + face.outward() * penetration;
    Touch {
        face,
        inward: -rotate(pose.angle, face.outward()),
        proxy: pose.point_to_world(proxy_in_object),
        penetration,
    }
}

/// Contact force on the object, N, world frame: (6) with damping along the face's inward normal.
///
/// `hip_velocity` is the HIP's velocity in the world, m/s; `twist` and `centre` are the box's.
pub fn contact_force(
    coupling: &Coupling,
    touch: &Touch,
    hip_velocity: Vec2,
    twist: &Twist,
    centre: Vec2,
) -> Vec2 {
    let contact_velocity = twist.velocity_at(touch.proxy - centre);
    let rate = touch.inward.dot(&(hip_velocity - contact_velocity));
    touch.inward * coupling.force(touch.penetration, rate)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::COUPLING;

    fn follow(path: &[(f64, f64)]) -> Option<Touch> {
        let (footprint, pose) = (BoxFootprint::square(0.4), Pose::default());
        let mut god = GodObject::default();
        let mut last = None;
        for &(x, y) in path {
            last = god.follow(&footprint, &pose, Vec2::new(x, y));
        }
        last
    }

    #[test]
    fn force_6_is_stiffness_times_penetration_along_the_inward_normal() {
        let touch = follow(&[(-0.3, 0.05), (-0.197, 0.05)]).unwrap();
        assert_eq!(touch.face, Face::West);
        assert!((touch.penetration - 0.003).abs() < 1e-15);
        let f = contact_force(
            &COUPLING,
            &touch,
            Vec2::zeros(),
            &Twist::default(),
            Vec2::zeros(),
        );
        assert!((f - Vec2::new(3.0, 0.0)).norm() < 1e-12);
    }

    #[test]
    fn damping_opposes_the_rate_of_penetration_and_never_pulls() {
        let touch = follow(&[(-0.3, 0.0), (-0.199, 0.0)]).unwrap();
        let force = |v| {
            contact_force(
                &COUPLING,
                &touch,
                Vec2::new(v, 0.0),
                &Twist::default(),
                Vec2::zeros(),
            )
            .x
        };
        assert!((force(0.1) - 2.0).abs() < 1e-12);
        assert!(force(-0.05) < 1.0);
        assert_eq!(force(-1.0), 0.0);
    }

    #[test]
    fn the_face_entered_by_is_kept_although_another_is_nearer() {
        // in by the west face, then deep and close to the north face
        let touch = follow(&[(-0.3, 0.15), (-0.19, 0.15), (-0.10, 0.19)]).unwrap();
        assert_eq!(touch.face, Face::West);
        assert!((touch.penetration - 0.10).abs() < 1e-12);
    }

    #[test]
    fn a_box_that_jumped_is_touched_by_its_old_face_only_where_that_is_pressed() {
        let footprint = BoxFootprint::square(0.4);
        let touched = |pose: Pose| {
            let mut god = GodObject::default();
            for x in [-0.3, -0.197] {
                god.follow(&footprint, &Pose::default(), Vec2::new(x, 0.0));
            }
            let hip = Vec2::new(-0.197, 0.0);
            god.after_jump(&footprint, &pose, hip);
            god.follow(&footprint, &pose, hip).map(|touch| touch.face)
        };
        assert_eq!(touched(Pose::new(-0.01, 0.0, 0.1)), Some(Face::West));
        // in front of the opposite face, and just inside of it
        assert_eq!(touched(Pose::new(-0.4, 0.0, 0.0)), None);
        assert_eq!(touched(Pose::new(-0.396, 0.0, 0.0)), Some(Face::East));
    }

    #[test]
    fn a_box_that_was_set_clear_of_the_hip_is_entered_anew_when_its_faces_grow() {
        let pose = Pose::default();
        let mut god = GodObject::default();
        for x in [-0.3, -0.19] {
            god.follow(&BoxFootprint::square(0.4), &pose, Vec2::new(x, 0.0));
        }
        // the HIP has come to lie in front of the next face, which then grows over it
        let hip = Vec2::new(0.1, 0.21);
        god.after_jump(&BoxFootprint::square(0.4), &pose, hip);
        let touch = god.follow(&BoxFootprint::square(0.44), &pose, hip).unwrap();
        assert_eq!(touch.face, Face::North);
        assert!((touch.penetration - 0.01).abs() < 1e-12);
    }

    #[test]
    fn leaving_the_half_plane_or_passing_the_end_lets_go() {
        assert!(follow(&[(-0.3, 0.0), (-0.19, 0.0), (-0.21, 0.0)]).is_none());
        assert!(follow(&[(-0.3, 0.0), (-0.19, 0.0), (-0.19, 0.21)]).is_none());
    }

    #[test]
    fn a_jump_past_a_corner_enters_by_the_face_it_came_from() {
        // nearer to the north face when first seen inside, but it came through the west face
        let touch = follow(&[(-0.21, 0.17), (-0.15, 0.18)]).unwrap();
        assert_eq!(touch.face, Face::West);
    }

    #[test]
    fn default_damping_follows_the_stiffness() {
        assert_eq!(Coupling::for_stiffness(1000.0).damping_ns_per_m, 10.0);
        assert_eq!(Coupling::for_stiffness(3000.0).damping_ns_per_m, 20.0);
    }
}
