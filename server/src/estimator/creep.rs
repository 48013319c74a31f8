//! Whether an object creeps: slides too slowly for its speed to be seen above the noise of a short filter.
//!
//! Two averages of the speed, of 50 and 200 ms. It creeps while the short one is clearly above its noise and
//! the long one agrees: an object that comes to rest is told from one that creeps within the delay of the
//! filter that force and motion share. It must never take an object for creeping that sticks.

use super::filter::stage_weight;

/// Corners of the two averages, rad/s.
const CORNERS: [f64; 2] = [20.0, 5.0];
/// Least speed, m/s; five standard deviations of its noise if that is more.
const SPEED_MIN: f64 = 0.001;
/// Share of the long average by which the short one may differ.
const STEADY: f64 = 0.3;

/// Follows a slow speed.
#[derive(Clone, Copy, Debug)]
pub struct Creep {
    weights: [f64; 2],
    averages: [f64; 2],
    least: f64,
}

impl Creep {
    /// At rest. `speed_noise` is the standard deviation of the noise in a raw speed, m/s, which comes from
    /// differences of a white position noise.
    #[must_use]
    pub fn new(speed_noise: f64) -> Self {
        let weights = CORNERS.map(stage_weight);
        let [short, _] = weights;
        // differences of white noise through one first-order stage
        let noise = short * speed_noise / (2.0 - short).sqrt();
        Self {
            weights,
            averages: [0.0; 2],
            least: SPEED_MIN.max(5.0 * noise),
        }
    }

    /// Takes the raw speed of one tick along the normal, m/s, and says whether the object creeps forwards.
    pub fn step(&mut self, speed: f64) -> bool {
        for (average, weight) in self.averages.iter_mut().zip(self.weights) {
            *average += (speed - *average) * weight;
        }
        let [short, long] = self.averages;
        short > self.least && (short - long).abs() < STEADY * long
    }

    /// Contact was lost: at rest.
    pub fn reset(&mut self) {
        self.averages = [0.0; 2];
    }
}
