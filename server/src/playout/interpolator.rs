//! The HIP at a stamp: between samples linear, after them at constant velocity for a short while, then a ramp to a stop.
//!
//! It must never extrapolate for longer than it may, or faster than the speed limit.

use std::collections::VecDeque;
use std::time::Duration;

use mmt_shared::model::geometry::Vec2;
use mmt_shared::model::sample::HipSample;
use mmt_shared::time::Time;

use super::config::PlayoutConfig;
use super::played::Status;

/// The velocity of extrapolation is an average over this long: 5 ms smooth the hand's 1 kHz readings.
pub(super) const AVERAGE: Duration = Duration::from_millis(5);
/// Interpolation bridges gaps up to this: the command gap at which the slave holds anyway.
const BRIDGE: Duration = Duration::from_millis(100);

/// Where the HIP should be, before the speed limit.
pub(super) struct Aim {
    /// m.
    pub(super) hip: Vec2,
    /// f_m that the master rendered there, N; none where it rendered nothing.
    pub(super) force: Option<Vec2>,
    pub(super) status: Status,
    /// Once samples have run out: for how long the tool has had to become slower.
    pub(super) slowing: Duration,
}

impl Aim {
    /// Stays at `hip`, m.
    pub(super) fn standing(hip: Vec2) -> Self {
        Self {
            hip,
            force: None,
            status: Status::Stopped,
            slowing: Duration::ZERO,
        }
    }

    fn between(a: &HipSample, b: &HipSample, share: f64) -> Self {
        let mix = |a: Vec2, b: Vec2| if share > 0.0 { a + (b - a) * share } else { a };
        Self {
            hip: mix(a.hip.metres(), b.hip.metres()),
            force: Some(mix(a.force.newtons(), b.force.newtons())),
            status: Status::Interpolated,
            slowing: Duration::ZERO,
        }
    }
}

/// Finds the HIP at any stamp.
#[derive(Clone, Copy, Debug)]
pub(super) struct Interpolator {
    extrapolation: Duration,
    deceleration_m_per_s2: f64,
    speed_max_m_per_s: f64,
}

impl Interpolator {
    pub(super) fn new(config: &PlayoutConfig) -> Self {
        Self {
            extrapolation: Duration::from_nanos((config.extrapolation_ms * 1e6) as u64),
            deceleration_m_per_s2: config.acceleration_max_m_per_s2,
            speed_max_m_per_s: config.speed_max_m_per_s,
        }
    }

    /// The HIP at `stamp`; none where all `samples`, which are in the order of their stamps, are later.
    pub(super) fn aim(&self, samples: &VecDeque<HipSample>, stamp: Time) -> Option<Aim> {
        let (before, after) = around(samples, stamp);
        let before = before?;
        let since = stamp.saturating_since(before.stamp);
        if since.is_zero() {
            return Some(Aim::between(before, before, 0.0));
        }
        let gap = |after: &HipSample| after.stamp.saturating_since(before.stamp);
        if let Some(after) = after.filter(|&after| gap(after) <= BRIDGE) {
            let share = since.as_secs_f64() / gap(after).as_secs_f64();
            return Some(Aim::between(before, after, share));
        }
        let velocity = self.average_velocity(samples, before);
        Some(self.beyond(before.hip.metres(), velocity, since))
    }

    /// `since` after the last sample, at `hip` (m), with a velocity (m/s): constant velocity, then a ramp to a stop.
    fn beyond(&self, hip: Vec2, velocity: Vec2, since: Duration) -> Aim {
        let moving = since.min(self.extrapolation).as_secs_f64();
        let ramp = since.saturating_sub(self.extrapolation).as_secs_f64();
        let speed = velocity.norm();
        let deceleration = self.deceleration_m_per_s2;
        let ramp = ramp.min(speed / deceleration);
        // ∫ (1 − a t/|v|) dt over the ramp, in units of v
        let slowing = if speed > 0.0 {
            ramp - 0.5 * deceleration * ramp * ramp / speed
        } else {
            0.0
        };
        Aim {
            hip: hip + velocity * (moving + slowing),
            force: None,
            status: if since <= self.extrapolation {
                Status::Extrapolated
            } else {
                Status::Stopped
            },
            slowing: self.slowing(since),
        }
    }

    /// For how long the tool has had to become slower, `since` after the last sample.
    pub(super) fn slowing(&self, since: Duration) -> Duration {
        since.saturating_sub(self.extrapolation)
    }

    /// Mean velocity over the last [`AVERAGE`] before a sample, m/s, within the speed limit.
    fn average_velocity(&self, samples: &VecDeque<HipSample>, newest: &HipSample) -> Vec2 {
        let from = newest.stamp - AVERAGE;
        let first = samples.partition_point(|held| held.stamp < from);
        let Some(oldest) = samples.get(first) else {
            return Vec2::zeros();
        };
        let span = newest.stamp.saturating_since(oldest.stamp).as_secs_f64();
        if span <= 0.0 {
            return Vec2::zeros();
        }
        let velocity = (newest.hip.metres() - oldest.hip.metres()) / span;
        let speed = velocity.norm();
        if speed > self.speed_max_m_per_s {
            velocity * (self.speed_max_m_per_s / speed)
        } else {
            velocity
        }
    }
}

/// The newest sample that is not later than `stamp`, and the one after it.
pub(super) fn around(
    samples: &VecDeque<HipSample>,
    stamp: Time,
) -> (Option<&HipSample>, Option<&HipSample>) {
    let next = samples.partition_point(|held| held.stamp <= stamp);
    let before = next.checked_sub(1).and_then(|i| samples.get(i));
    (before, samples.get(next))
}
