//! How samples are played, with the defaults and the checks on them.

use std::time::Duration;

use mmt_shared::model::architecture::Architecture;
use mmt_shared::model::params::WORKSPACE_M;
use mmt_shared::range::{OutOfRange, all_in_range};
use serde::{Deserialize, Serialize};

use crate::motion_limits::MotionLimits;

/// Accepted play-out delay, ms.
const DELAY_MS: (f64, f64) = (0.0, 250.0);
/// Accepted time of extrapolation, ms: three times the default, for studies.
const EXTRAPOLATION_MS: (f64, f64) = (0.0, 100.0);
/// Accepted speed limit, m/s.
const SPEED_M_PER_S: (f64, f64) = (0.01, 10.0);
/// Accepted reach, m: to where the model accepts a pose.
const REACH_M: (f64, f64) = (0.1, WORKSPACE_M);
/// Accepted greatest acceleration, m/s².
const ACCELERATION_M_PER_S2: (f64, f64) = (0.5, 1000.0);

/// How samples are played.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PlayoutConfig {
    /// From the earliest possible arrival of a sample to its play-out, ms. Default 16: ten samples to a
    /// packet and 5 ms of jitter. Never less than this.
    pub delay_ms: f64,
    /// The delay grows to what 99 of 100 samples need, but not beyond this, ms. Default 100: more would
    /// be a link that stands. At or below `delay_ms` the delay is fixed.
    pub delay_max_ms: f64,
    /// How long an underrun is bridged at constant velocity, ms. Default 30: the slave never moves on
    /// older samples.
    pub extrapolation_ms: f64,
    /// Greatest speed of the played HIP, m/s. Default 0.6: after an outage the HIP does not jump, and the
    /// scripted operator stays below 0.4.
    pub speed_max_m_per_s: f64,
    /// The tool's workspace: it stays within this distance from the origin, m. Default 2, an arm on a stand.
    pub reach_m: f64,
    /// Greatest acceleration of the tool in free space, m/s², and its deceleration where it has to stop. Default 20: from
    /// 0.4 m/s it stops within 4 mm, and no hand that pushes reaches it.
    pub acceleration_max_m_per_s2: f64,
}

impl Default for PlayoutConfig {
    fn default() -> Self {
        Self::for_packing_and_jitter(10, Duration::from_millis(5))
    }
}

impl PlayoutConfig {
    /// The defaults with the delay that packing and jitter need: the oldest sample of a packet waited
    /// `samples_per_command − 1` ms, jitter (peak to peak) comes on top, and 2 ms for the slave's ticks.
    #[must_use]
    pub fn for_packing_and_jitter(samples_per_command: u8, jitter: Duration) -> Self {
        let packing = f64::from(samples_per_command.saturating_sub(1));
        Self {
            delay_ms: (packing + jitter.as_secs_f64() * 1e3 + 2.0).min(DELAY_MS.1),
            delay_max_ms: 100.0,
            extrapolation_ms: 30.0,
            speed_max_m_per_s: 0.6,
            reach_m: 2.0,
            acceleration_max_m_per_s2: 20.0,
        }
    }

    /// This play-out for a master that packs so many samples: a delay that is the default becomes the one that its
    /// packing needs, with the room for jitter that the default has. Where the tool is felt it begins at none and
    /// grows as packing and jitter ask for: it is part of what the hand feels. A delay that was configured stays.
    #[must_use]
    pub fn for_session(self, samples_per_command: u8, architecture: Architecture) -> Self {
        let default = Self::default();
        if self.delay_ms != default.delay_ms {
            return self;
        }
        let delay = |samples| Self::for_packing_and_jitter(samples, Duration::ZERO).delay_ms;
        let delay_ms = if architecture.feels_tool() {
            0.0
        } else {
            // the default is made for ten samples
            default.delay_ms + delay(samples_per_command) - delay(10)
        };
        Self { delay_ms, ..self }
    }

    /// Greatest speed and acceleration of the tool.
    pub(crate) fn limits(&self) -> MotionLimits {
        MotionLimits {
            speed_m_per_s: self.speed_max_m_per_s,
            acceleration_m_per_s2: self.acceleration_max_m_per_s2,
        }
    }

    pub(super) fn check(&self) -> Result<(), OutOfRange> {
        let acceleration = self.acceleration_max_m_per_s2;
        #[rustfmt::skip]
        let checks = [
            ("play-out: delay", "ms", self.delay_ms, DELAY_MS),
            ("play-out: longest delay", "ms", self.delay_max_ms, DELAY_MS),
            ("play-out: extrapolation", "ms", self.extrapolation_ms, EXTRAPOLATION_MS),
            ("play-out: speed limit", "m/s", self.speed_max_m_per_s, SPEED_M_PER_S),
            ("play-out: reach", "m", self.reach_m, REACH_M),
            ("play-out: greatest acceleration", "m/s^2", acceleration, ACCELERATION_M_PER_S2),
        ];
        all_in_range(checks)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn play_out_waits_for_the_masters_packing_unless_its_delay_was_configured() {
        let default = PlayoutConfig::default();
        assert_eq!(default.for_session(10, Architecture::Mmt), default);
        let one = default.for_session(1, Architecture::Mmt);
        assert!((default.delay_ms - one.delay_ms - 9.0).abs() < 1e-9);
        let faster = PlayoutConfig {
            speed_max_m_per_s: 1.0,
            ..default
        };
        let faster = faster.for_session(1, Architecture::Mmt);
        assert_eq!(faster.speed_max_m_per_s, 1.0);
        let configured = PlayoutConfig {
            delay_ms: 33.0,
            ..default
        };
        for architecture in Architecture::ALL {
            assert_eq!(configured.for_session(1, architecture), configured);
        }
        let from_none = default.for_session(10, Architecture::Tdpa);
        assert_eq!(from_none.delay_ms, 0.0, "the hand feels it");
    }
}
