//! The noise of the measured force.

use mmt_shared::model::geometry::Vec2;

/// Samples that the first bias and the first noise are measured by.
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
/// Median of the length of a second difference of white noise on two axes, over the noise per axis: sqrt(6) sqrt(2 ln 2).
const MEDIAN: f64 = 2.884_055;

/// The noise per axis: the median of second differences of the force, which neither bias nor drift is in.
#[derive(Clone, Copy, Debug)]
pub(super) struct Noise {
    before: [Vec2; 2],
    samples: u32,
    sum2: f64,
    noise_n: f64,
}

impl Default for Noise {
    fn default() -> Self {
        Self {
            before: [Vec2::zeros(); 2],
            samples: 0,
            sum2: 0.0,
            noise_n: NOISE_AT_START_N,
        }
    }
}

impl Noise {
    pub(super) fn step(&mut self, force: Vec2, free: bool) {
        let [older, newer] = self.before;
        let size = (force - newer * 2.0 + older).norm();
        self.before = [newer, force];
        self.samples = self.samples.saturating_add(1);
        if self.samples <= 2 || !size.is_finite() {
            return;
        }
        if self.samples <= FIRST_SAMPLES {
            // two axes with six times the variance each
            self.sum2 += size * size / 12.0;
            if self.samples == FIRST_SAMPLES {
                self.noise_n = (self.sum2 / f64::from(FIRST_SAMPLES - 2)).sqrt();
            }
        } else if free {
            let larger = size > MEDIAN * self.noise_n;
            self.noise_n *= if larger {
                1.0 + NOISE_STEP
            } else {
                1.0 - NOISE_STEP
            };
        }
        self.noise_n = self.noise_n.clamp(1e-3, 10.0);
    }

    /// How many samples contact and (12) are averaged over: one for what the thresholds are made for.
    pub(super) fn averaged(&self) -> (usize, usize) {
        let share = self.noise_n / NOISE_N;
        let wanted = (share * share).ceil().max(1.0) as usize;
        (wanted.min(CONTACT_MAX), wanted.min(JUDGED_MAX))
    }

    /// The noise per axis as measured, N.
    pub(super) fn per_axis(&self) -> f64 {
        self.noise_n
    }

    /// The noise where it is more than thresholds are made for, N; else 0.
    pub(super) fn beyond(&self) -> f64 {
        if self.noise_n > NOISE_N {
            self.noise_n
        } else {
            0.0
        }
    }

    /// Standard deviation of an average of `n` samples, N per axis; none to reckon with where one sample is enough.
    pub(super) fn of_average(&self, n: usize) -> f64 {
        self.beyond() / (n as f64).sqrt()
    }
}
