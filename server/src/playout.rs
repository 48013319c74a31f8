//! Play-out: HIP samples in, as the network brings them; a steady HIP out, one per slave tick.
//!
//! Three stages. The jitter buffer holds samples until they are due, a delay after the earliest time at which the
//! network could have brought them. The interpolator finds the HIP at the stamp that is due. The motion limiter keeps the
//! tool from jumping there. Play-out must never move the tool faster or with more acceleration than the limits, never move it
//! on old samples for longer than it may extrapolate, and never be blocked for good by stamps, whatever they are.

mod clock;
mod config;
mod delay;
mod interpolator;
mod jitter_buffer;
mod lateness;
mod motion_limiter;
mod played;

pub use config::PlayoutConfig;
pub use played::{Played, PlayoutCounts, Status};

use std::time::Duration;

use mmt_shared::model::geometry::Vec2;
use mmt_shared::model::sample::HipSample;
use mmt_shared::range::OutOfRange;
use mmt_shared::stats::histogram::Histogram;
use mmt_shared::time::Time;

use crate::tool::energy::HandSample;
use interpolator::{Aim, Interpolator, around};
use jitter_buffer::{JitterBuffer, WAIT};
use motion_limiter::MotionLimiter;

/// Once it is no longer held, the tool follows again when the HIP comes this near, m: a hand that went elsewhere meanwhile has
/// to come for it.
const ENGAGE_M: f64 = 0.02;

/// A tool that has to become slower stands below this, m/s: rounding.
const STILL_M_PER_S: f64 = 1e-9;

/// The three stages. Allocates when made, never afterwards.
#[derive(Clone, Debug)]
pub struct PlayoutBuffer {
    buffer: JitterBuffer,
    interpolator: Interpolator,
    limiter: MotionLimiter,
    counts: PlayoutCounts,
    delays: Histogram,
    /// The newest stamp of all samples, and for how long there has been no newer one.
    newest: Option<Time>,
    silent: Duration,
    /// The tool is to stand.
    held: bool,
    /// It stands.
    stands: bool,
}

impl PlayoutBuffer {
    /// An empty buffer.
    ///
    /// # Errors
    /// Names the first number of the configuration that is outside its range.
    pub fn try_new(config: PlayoutConfig) -> Result<Self, OutOfRange> {
        config.check()?;
        Ok(Self {
            buffer: JitterBuffer::new(&config),
            interpolator: Interpolator::new(&config),
            limiter: MotionLimiter::new(&config),
            counts: PlayoutCounts::default(),
            delays: Histogram::default(),
            newest: None,
            silent: Duration::ZERO,
            held: false,
            stands: false,
        })
    }

    /// Sets where the tool is before the first sample, m: the speed limit holds from there on.
    pub fn start_at(&mut self, hip: Vec2) {
        self.limiter.start_at(hip);
    }

    /// The tool is there (m), wherever it was: it stands until the HIP comes for it.
    pub fn move_to(&mut self, place: Vec2) {
        self.limiter.move_to(place);
        self.stands = true;
    }

    /// The place within the tool's reach that is nearest to `place`, m.
    #[must_use]
    pub fn within_reach(&self, place: Vec2) -> Vec2 {
        self.limiter.within_reach(place)
    }

    /// Holds the tool where it is, from the next tick on; or no longer: then it follows again once the HIP comes within
    /// 2 cm of it.
    pub fn hold(&mut self, held: bool) {
        self.held = held;
    }

    /// Takes in a sample that arrived at `arrived` by the slave's clock, in any order.
    pub fn push(&mut self, arrived: Time, sample: &HipSample) {
        self.buffer.push(arrived, sample, &mut self.counts);
        let newest = self.buffer.samples().back().map(|newest| newest.stamp);
        if newest > self.newest {
            (self.newest, self.silent) = (newest, Duration::ZERO);
        } else if self.goes_back(newest) {
            // the next one ends the silence
            self.newest = newest;
        }
    }

    /// Whether the master's clock was set back so far that play-out waits for nothing: what is less far back may be a sample of
    /// before that comes again.
    fn goes_back(&self, newest: Option<Time>) -> bool {
        let back = |newest| self.newest.map(|then| then.saturating_since(newest));
        newest.and_then(back).is_some_and(|back| back > WAIT)
    }

    /// The HIP to follow at `now` by the slave's clock; to be called every tick.
    ///
    /// None until the first sample is due.
    pub fn advance(&mut self, now: Time) -> Option<Played> {
        let elapsed = self.limiter.elapsed(now);
        self.silent += elapsed;
        let stamp = self.buffer.due(now, elapsed)?;
        let aim = self.aim(stamp)?;
        let has_to_stand = self.has_to_stand(aim.hip);
        let target = (!has_to_stand).then_some(aim.hip);
        let slowing = aim.slowing.min(self.interpolator.slowing(self.silent));
        let step = self.limiter.step(now, elapsed, target, slowing);
        let limited = step.limited || has_to_stand;
        let stopped = !slowing.is_zero() && step.velocity.norm() < STILL_M_PER_S;
        let played = Played {
            stamp: self.buffer.play(stamp),
            hip: step.hip,
            velocity: step.velocity,
            force: aim.force.filter(|_| !limited),
            hand: aim.force.map(|force| HandSample {
                hip: aim.hip,
                force,
            }),
            status: aim.status,
            period_s: elapsed.as_secs_f64(),
            speed_max_m_per_s: step.speed_max_m_per_s,
            limited,
            stands: has_to_stand || stopped,
        };
        self.counts.note(&played);
        self.delays.record(self.delay());
        Some(played)
    }

    /// Whether the tool has to stand: while it is held, and until the HIP at `aim` has come for it.
    fn has_to_stand(&mut self, aim: Vec2) -> bool {
        let Some(place) = self.limiter.place() else {
            return false;
        };
        self.stands = self.held || (self.stands && (aim - place).norm() > ENGAGE_M);
        self.stands
    }

    /// Where the HIP was at a stamp, m: the sample of that stamp, or what stands in for it when it is lost
    /// or not there yet. Without the speed limit: the master's hand has none.
    #[must_use]
    pub fn hip_at(&self, stamp: Time) -> Option<Vec2> {
        self.aim(stamp).map(|aim| aim.hip)
    }

    /// The HIP that was played last, m; none before the first.
    #[must_use]
    pub fn played_hip(&self) -> Option<Vec2> {
        self.limiter.hip()
    }

    /// The stamp of the newest sample that is not later than `stamp`.
    #[must_use]
    pub fn sample_before(&self, stamp: Time) -> Option<Time> {
        let (before, _) = around(self.buffer.samples(), stamp);
        before.map(|sample| sample.stamp)
    }

    /// For how long no new sample has come, as ticks count it: neither a step of the clock nor a host that stands still is
    /// silence, and a sample that is not believed is none. None before the first.
    #[must_use]
    pub fn silence(&self) -> Option<Duration> {
        self.newest.map(|_| self.silent)
    }

    /// What happened so far.
    #[must_use]
    pub fn counts(&self) -> PlayoutCounts {
        self.counts
    }

    /// From the earliest possible arrival of a sample to its play-out, as it is now.
    #[must_use]
    pub fn delay(&self) -> Duration {
        self.buffer.delay.get()
    }

    /// How often each delay was played with, a count a tick.
    #[must_use]
    pub fn delays(&self) -> &Histogram {
        &self.delays
    }

    /// The HIP at a stamp. Where no sample is old enough, because the clock was learned anew, the tool stays.
    fn aim(&self, stamp: Time) -> Option<Aim> {
        self.interpolator
            .aim(self.buffer.samples(), stamp)
            .or_else(|| self.limiter.hip().map(Aim::standing))
    }
}

#[cfg(test)]
mod tests;
