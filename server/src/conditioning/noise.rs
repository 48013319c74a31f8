//! The noise of the measured force.
//!
//! A sensor, or a robot that reports it, may be slower than a tick: then a sample is there for several ticks. Whoever takes each tick
//! for a sample of its own has to reckon with more noise, by the square root of how many.

use mmt_shared::model::geometry::Vec2;

/// Ticks that the first bias and the first noise are measured by.
pub(super) const FIRST_SAMPLES: u32 = 100;
/// Noise per axis that thresholds are made for, N: twice the default sensor's. Contact begins at 0.10 N: five of it.
const NOISE_N: f64 = 0.02;
/// The same of the default sensor: what is taken for true before it has been measured, N.
const NOISE_AT_START_N: f64 = 0.01;
/// Most samples that contact is judged by.
pub(super) const CONTACT_MAX: usize = 8;
/// Most samples that (12) is judged by.
pub const JUDGED_MAX: usize = 16;
/// By how much a sample may change the measured noise, as a share.
const NOISE_STEP: f64 = 0.005;
/// A force that stays the same for so many ticks is steady; before, it is a sample that has not been taken anew.
const STEADY_TICKS: u32 = 20;
/// Weight of the newest sample in the mean of how many ticks each is there, at least.
const PERIOD_WEIGHT: f64 = 0.01;
/// Median of the length of a second difference of white noise on two axes, over the noise per axis: sqrt(6) sqrt(2 ln 2).
const MEDIAN: f64 = 2.884_055;

/// The noise per axis: the median of second differences of the force, which neither bias nor drift is in.
#[derive(Clone, Copy, Debug)]
pub(super) struct Noise {
    before: [Vec2; 2],
    ticks: u32,
    samples: u32,
    /// Ticks since the newest sample, and how many a sample is there in the mean.
    held: u32,
    ticks_per_sample: f64,
    sum2: f64,
    /// Of a sample.
    noise_n: f64,
}

impl Default for Noise {
    fn default() -> Self {
        Self {
            before: [Vec2::zeros(); 2],
            ticks: 0,
            samples: 0,
            held: 0,
            ticks_per_sample: 1.0,
            sum2: 0.0,
            noise_n: NOISE_AT_START_N,
        }
    }
}

impl Noise {
    /// Takes the force of a tick, N; `free`: whether the tool touches nothing.
    pub(super) fn step(&mut self, force: Vec2, free: bool) {
        self.ticks = self.ticks.saturating_add(1);
        self.held += 1;
        let [_, newer] = self.before;
        if force != newer || self.held >= STEADY_TICKS {
            self.sample(force, free);
        }
        if self.ticks == FIRST_SAMPLES {
            let differences = self.samples.saturating_sub(2).max(1);
            self.noise_n = (self.sum2 / f64::from(differences)).sqrt();
        }
        self.noise_n = self.noise_n.clamp(1e-3, 10.0);
    }

    fn sample(&mut self, force: Vec2, free: bool) {
        let [older, newer] = self.before;
        let size = (force - newer * 2.0 + older).norm();
        self.before = [newer, force];
        self.samples = self.samples.saturating_add(1);
        let held = std::mem::take(&mut self.held);
        if held < STEADY_TICKS {
            let weight = f64::from(self.samples).recip().max(PERIOD_WEIGHT);
            self.ticks_per_sample += (f64::from(held) - self.ticks_per_sample) * weight;
        }
        if self.samples <= 2 || !size.is_finite() {
            return;
        }
        if self.ticks <= FIRST_SAMPLES {
            // two axes with six times the variance each
            self.sum2 += size * size / 12.0;
        } else if free {
            let larger = size > MEDIAN * self.noise_n;
            self.noise_n *= if larger {
                1.0 + NOISE_STEP
            } else {
                1.0 - NOISE_STEP
            };
        }
    }

    /// How many samples contact and (12) are averaged over: one for what the thresholds are made for.
    pub(super) fn averaged(&self) -> (usize, usize) {
        let share = self.per_axis() / NOISE_N;
        let wanted = (share * share).ceil().max(1.0) as usize;
        (wanted.min(CONTACT_MAX), wanted.min(JUDGED_MAX))
    }

    /// The noise per axis as measured, N: white noise of the ticks that has the same power as that of the samples.
    pub(super) fn per_axis(&self) -> f64 {
        self.noise_n * self.ticks_per_sample.sqrt()
    }

    /// The noise where it is more than thresholds are made for, N; else 0.
    pub(super) fn beyond(&self) -> f64 {
        let noise_n = self.per_axis();
        if noise_n > NOISE_N { noise_n } else { 0.0 }
    }

    /// Standard deviation of an average of `n` samples, N per axis; none to reckon with where one sample is enough.
    pub(super) fn of_average(&self, n: usize) -> f64 {
        self.beyond() / (n as f64).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use mmt_shared::rng::Substream;

    use super::*;

    #[test]
    fn a_sample_that_is_there_for_several_ticks_counts_once_and_its_noise_has_the_same_power() {
        for ticks in [1, 2, 4, 8] {
            let (mut noise, mut random) = (Noise::default(), Substream::new(3, "slow", ticks));
            let mut force = Vec2::zeros();
            for k in 0..8000 {
                if k % ticks == 0 {
                    let (x, y) = random.normal_pair();
                    force = Vec2::new(x, y) * 0.05;
                }
                noise.step(force, true);
                if k >= 400 {
                    let share = noise.per_axis() / (0.05 * (ticks as f64).sqrt());
                    assert!((0.7..1.4).contains(&share), "{ticks} ticks, {k}: {share}");
                }
            }
        }
    }
}
