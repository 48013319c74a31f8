//! Whether an object creeps: slides too slowly for its speed to be seen above the noise of a short filter.
//!
//! Two averages of the speed, of 50 and 200 ms. It creeps while the short one is clearly above its noise and
//! the long one agrees. An object that comes to rest is found within 40 ms, and the filter that force and
//! motion share delays by 25. It must never take an object for creeping that sticks.

use super::filter::stage_weight;

/// Corners of the two averages, rad/s.
const CORNERS: [f64; 2] = [20.0, 5.0];
/// Least speed, m/s; five standard deviations of its noise if that is more.
const SPEED_MIN: f64 = 0.001;
/// Share of the long average by which the short one may differ.
const STEADY: f64 = 0.3;

/// Follows a slow speed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Creep {
    weights: [f64; 2],
    averages: [f64; 2],
    least: f64,
}

impl Creep {
    /// At rest. `speed_noise` is the standard deviation of the noise in a raw speed, m/s, which comes from
    /// differences of a white position noise.
    #[must_use]
    pub(super) fn new(speed_noise: f64) -> Self {
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

    /// Takes the raw speed of one tick along the normal, m/s, and returns whether the object creeps forwards.
    pub(super) fn step(&mut self, speed: f64) -> bool {
        for (average, weight) in self.averages.iter_mut().zip(self.weights) {
            *average += (speed - *average) * weight;
        }
        let [short, long] = self.averages;
        short > self.least && (short - long).abs() < STEADY * long
    }

    /// Contact was lost: at rest.
    pub(super) fn reset(&mut self) {
        self.averages = [0.0; 2];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mmt_shared::rng::Substream;
    use mmt_shared::time::TICK_S;

    /// Ticks on which it creeps while the speed is `speed(k)` for 3000 ticks, under 10 µm of position noise.
    fn ticks(seed: u64, speed: impl Fn(u32) -> f64) -> Vec<u32> {
        let noise = 10e-6;
        let mut creep = Creep::new(noise * std::f64::consts::SQRT_2 / TICK_S);
        let mut random = Substream::new(seed, "creep", 0);
        let (mut position, mut last) = (0.0, 0.0);
        let mut creeps = vec![];
        for k in 0..3000 {
            position += speed(k) * TICK_S;
            let seen = position + noise * random.normal_pair().0;
            if k > 0 && creep.step((seen - last) / TICK_S) {
                creeps.push(k);
            }
            last = seen;
        }
        creeps
    }

    #[test]
    fn an_object_that_sticks_never_creeps_and_3_mm_per_s_do() {
        for seed in 0..5 {
            assert_eq!(ticks(seed, |_| 0.0), [0_u32; 0]);
            let creeps = ticks(seed, |_| 0.003);
            assert!(creeps.len() > 2500 && creeps[0] < 500, "{}", creeps.len());
        }
    }

    #[test]
    fn coming_to_rest_is_seen_within_40_ms() {
        for seed in 0..5 {
            let creeps = ticks(seed, |k| if k < 1500 { 0.003 } else { 0.0 });
            let last = creeps.last().unwrap();
            assert!((1500..1540).contains(last), "{last}");
        }
    }

    #[test]
    fn a_touch_at_speed_is_no_creeping() {
        let creeps = ticks(1, |k| (f64::from(k) * 1e-3 * 0.5).min(0.15));
        assert!(creeps.iter().all(|k| *k > 300), "{creeps:?}");
    }
}
