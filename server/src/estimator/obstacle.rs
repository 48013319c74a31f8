//! An object that stands although the push exceeds its friction by far: something else holds it.
//!
//! A wall that nobody told of can be told to the local model only as friction. It must never take ordinary
//! static friction, which gives way at once, for an obstacle, and never outlast the contact.

/// Force that friction alone may hold: this share of c, and this much more, N.
const FRICTION_HOLDS: (f64, f64) = (1.25, 0.3);
/// How long a force beyond that must be held, ticks: a press rises through static friction sooner.
const TICKS: u32 = 20;
/// Friction told, as a multiple of the held force, and the share of it that the force may come to.
const MARGIN: (f64, f64) = (2.0, 0.8);
/// Friction beyond which more makes no difference to a model, N.
const MOST_N: f64 = 150.0;

/// Watches for an obstacle.
#[derive(Clone, Copy, Debug, Default)]
pub struct Obstacle {
    ticks: u32,
    holding: Option<f64>,
}

impl Obstacle {
    /// Takes force (N), whether the object sticks, whether it slides for certain, and c (N) as estimated.
    /// True in the tick in which an obstacle is found.
    pub fn step(&mut self, force: f64, sticks: bool, slides: bool, c: f64) -> bool {
        let (share, more) = FRICTION_HOLDS;
        if slides {
            self.clear();
            return false;
        }
        if let Some(holding) = &mut self.holding {
            let (most, enough) = MARGIN;
            if force > enough * *holding {
                *holding = (most * force).min(MOST_N);
            }
            return false;
        }
        let beyond = sticks && force > share * c + more;
        self.ticks = if beyond { self.ticks + 1 } else { 0 };
        let found = self.ticks >= TICKS;
        if found {
            self.holding = Some((MARGIN.0 * force).min(MOST_N));
        }
        found
    }

    /// The friction (N) that holds a model as the obstacle holds the object; none without an obstacle.
    #[must_use]
    pub fn holding(&self) -> Option<f64> {
        self.holding
    }

    /// The object slides, or contact was lost.
    pub fn clear(&mut self) {
        *self = Self::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const C: f64 = 2.0;

    /// Presses from 0 to `most` N at a rate in N/ms, then holds it for 100 ticks.
    fn press(rate: f64, most: f64) -> Obstacle {
        let mut obstacle = Obstacle::default();
        let rise = (most / rate) as u32;
        for n in 0..rise + 100 {
            obstacle.step((rate * f64::from(n)).min(most), true, false, C);
        }
        obstacle
    }

    #[test]
    fn what_friction_holds_is_no_obstacle_and_more_is() {
        assert_eq!(press(0.02, 1.25 * C).holding(), None);
        let held = press(0.02, 5.0).holding().unwrap();
        assert!(held > 5.0 / 0.8 && held <= 10.0, "{held}");
        assert_eq!(press(10.0, 1000.0).holding(), Some(150.0));
    }

    #[test]
    fn static_friction_that_gives_way_within_20_ms_is_no_obstacle() {
        let mut obstacle = Obstacle::default();
        for _ in 0..19 {
            assert!(!obstacle.step(1.5 * C, true, false, C));
        }
        obstacle.step(1.5 * C, false, true, C);
        assert!(!obstacle.step(1.5 * C, true, false, C));
        assert_eq!(obstacle.holding(), None);
    }

    #[test]
    fn a_noisy_speed_does_not_end_it_and_sliding_does() {
        let mut obstacle = press(0.02, 5.0);
        obstacle.step(5.0, false, false, C);
        assert!(obstacle.holding().is_some());
        obstacle.step(5.0, false, true, C);
        assert_eq!(obstacle.holding(), None);
    }
}
