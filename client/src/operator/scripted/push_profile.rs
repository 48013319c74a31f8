//! One push as it was drawn: where on the face, how fast, how unsteady.

use std::f64::consts::TAU;

use mmt_shared::rng::Substream;

use super::config::ScriptedConfig;

/// The drawn numbers of push `index` of a seed: a pure function of both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PushProfile {
    /// Where on the face, m.
    pub(super) lateral: f64,
    mean_speed: f64,
    slow: Wave,
    fast: Wave,
}

/// A relative modulation of the speed.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Wave {
    share: f64,
    hz: f64,
    phase: f64,
}

impl Wave {
    fn draw(stream: &mut Substream, share: f64, (low, high): (f64, f64)) -> Self {
        Self {
            share,
            hz: stream.uniform_in(low, high),
            phase: stream.uniform_in(0.0, TAU),
        }
    }

    fn at(&self, seconds: f64) -> f64 {
        self.share * libm::sin(TAU * self.hz * seconds + self.phase)
    }
}

impl PushProfile {
    pub(super) fn draw(config: &ScriptedConfig, index: u64) -> Self {
        let mut stream = Substream::new(config.seed, "operator/push", index);
        let (slowest, fastest) = config.push_speed_m_per_s;
        Self {
            lateral: config.lateral_max_m * stream.uniform_in(-1.0, 1.0),
            mean_speed: stream.uniform_in(slowest, fastest),
            slow: Wave::draw(&mut stream, config.slow_share, config.slow_hz),
            fast: Wave::draw(&mut stream, config.fast_share, config.fast_hz),
        }
    }

    /// Wanted speed, m/s, so many seconds after contact.
    pub(super) fn speed(&self, seconds: f64) -> f64 {
        self.mean_speed * (1.0 + self.slow.at(seconds) + self.fast.at(seconds))
    }
}

#[cfg(test)]
mod tests {
    use mmt_shared::stats::values::mean;

    use super::*;

    #[test]
    fn every_drawn_number_stays_in_its_range_and_fills_it() {
        let config = ScriptedConfig::default();
        let profiles: Vec<PushProfile> = (0..400).map(|k| PushProfile::draw(&config, k)).collect();
        let spread = |of: fn(&PushProfile) -> f64| {
            let of = profiles.iter().map(of);
            of.fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(x), b.max(x)))
        };
        for (got, (low, high)) in [
            (spread(|s| s.lateral), (-0.05, 0.05)),
            (spread(|s| s.mean_speed), (0.10, 0.22)),
            (spread(|s| s.slow.hz), (0.4, 1.0)),
            (spread(|s| s.fast.hz), (1.5, 3.0)),
            (spread(|s| s.slow.phase), (0.0, TAU)),
        ] {
            let slack = 0.02 * (high - low);
            assert!(got.0 >= low && got.0 < low + slack, "{got:?}");
            assert!(got.1 <= high && got.1 > high - slack, "{got:?}");
        }
    }

    #[test]
    fn the_speed_is_modulated_about_its_mean_by_42_percent_at_most() {
        let profile = PushProfile::draw(&ScriptedConfig::default(), 3);
        let speeds: Vec<f64> = (0..60_000)
            .map(|k| profile.speed(f64::from(k) * 1e-3) / profile.mean_speed)
            .collect();
        let mean = mean(speeds.iter().copied()).unwrap();
        let largest = speeds.iter().fold(0.0_f64, |a, x| a.max((x - 1.0).abs()));
        assert!((mean - 1.0).abs() < 0.02, "{mean}");
        assert!(largest <= 0.42 && largest > 0.38, "{largest}");
    }
}
