//! Friction that differs from place to place: a smooth ripple, and rectangles with their own coefficient.
//!
//! Pure functions of a place. It must never give a coefficient below zero.

use mmt_shared::model::geometry::Vec2;
use serde::{Deserialize, Serialize};

/// Most rectangles on the ground.
pub const PATCHES_MAX: usize = 8;

/// A smooth ripple over the ground: mu(x, y) = mu (1 + share sin(2πx/λ) sin(2πy/λ)).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Ripple {
    /// How far the coefficient goes above and below its mean. Default 0.30: a scenario's choice.
    pub share: f64,
    /// Period λ along x and along y, m. Default 0.2: a scenario's choice.
    pub period_m: f64,
}

impl Default for Ripple {
    fn default() -> Self {
        Self {
            share: 0.30,
            period_m: 0.2,
        }
    }
}

/// A rectangle of the ground, along the world's axes, with a friction coefficient of its own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GroundPatch {
    /// The corner with the least x and y, m.
    pub from_m: Vec2,
    /// The corner with the greatest x and y, m.
    pub to_m: Vec2,
    /// Friction coefficient mu inside.
    pub friction_coefficient: f64,
}

/// The friction coefficient over the ground.
#[derive(Clone, Copy, Debug)]
pub(super) struct Terrain<'a> {
    /// mu where no rectangle lies.
    pub(super) mu: f64,
    /// Multiplies whatever lies below.
    pub(super) ripple: Option<Ripple>,
    /// Where rectangles overlap, the last one counts.
    pub(super) patches: &'a [GroundPatch],
}

impl Terrain<'_> {
    /// Whether mu is the same everywhere.
    pub(super) fn is_plain(&self) -> bool {
        self.ripple.is_none() && self.patches.is_empty()
    }

    /// mu at a place of the world.
    pub(super) fn mu(&self, place: Vec2) -> f64 {
        let inside = |patch: &&GroundPatch| {
            (patch.from_m.x..patch.to_m.x).contains(&place.x)
                && (patch.from_m.y..patch.to_m.y).contains(&place.y)
        };
        let patch = self.patches.iter().rev().find(inside);
        let mu = patch.map_or(self.mu, |patch| patch.friction_coefficient);
        let Some(ripple) = self.ripple else {
            return mu;
        };
        let wave = |x: f64| sine_of_turns(x / ripple.period_m);
        mu * (1.0 + ripple.share * wave(place.x) * wave(place.y))
    }
}

/// sin(2π t), to 1e-7: 64 points a step leave no time for more digits than friction has.
fn sine_of_turns(t: f64) -> f64 {
    let t = t - libm::round(t);
    // into the quarter turns next to zero
    let folded = if t.abs() > 0.25 {
        (0.5 - t.abs()).copysign(t)
    } else {
        t
    };
    let z = std::f64::consts::TAU * folded;
    let z2 = z * z;
    let tail = 1.0 - z2 / 72.0 * (1.0 - z2 / 110.0);
    z * (1.0 - z2 / 6.0 * (1.0 - z2 / 20.0 * (1.0 - z2 / 42.0 * tail)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ripple_is_a_sine_in_x_and_y() {
        let plain = Terrain {
            mu: 0.3,
            ripple: None,
            patches: &[],
        };
        let ripple = Ripple::default();
        let rippled = Terrain {
            ripple: Some(ripple),
            ..plain
        };
        assert!(plain.is_plain() && !rippled.is_plain());
        let (mut least, mut most) = (f64::MAX, 0.0_f64);
        for k in 0..2_000 {
            let place = Vec2::new(-1.3 + 0.001_7 * f64::from(k), 0.9 - 0.002_3 * f64::from(k));
            let sine = |x: f64| libm::sin(std::f64::consts::TAU * x / ripple.period_m);
            let expected = 0.3 * (1.0 + 0.3 * sine(place.x) * sine(place.y));
            let mu = rippled.mu(place);
            assert!((mu - expected).abs() < 3e-8, "{place}: {mu}, {expected}");
            (least, most) = (least.min(mu), most.max(mu));
            assert_eq!(plain.mu(place), 0.3);
        }
        assert!(least < 0.22 && most > 0.38, "{least} to {most}");
    }

    #[test]
    fn the_last_rectangle_counts() {
        let patch = |from: f64, to: f64, mu: f64| GroundPatch {
            from_m: Vec2::new(from, 0.0),
            to_m: Vec2::new(to, 1.0),
            friction_coefficient: mu,
        };
        let terrain = Terrain {
            mu: 0.3,
            ripple: None,
            patches: &[patch(0.0, 2.0, 0.5), patch(1.0, 3.0, 0.1)],
        };
        let mu = |x: f64, y: f64| terrain.mu(Vec2::new(x, y));
        assert_eq!([mu(-0.1, 0.5), mu(0.5, 0.5), mu(1.5, 0.5)], [0.3, 0.5, 0.1]);
        assert_eq!([mu(2.5, 0.5), mu(3.5, 0.5), mu(0.5, 1.5)], [0.1, 0.3, 0.3]);
    }
}
