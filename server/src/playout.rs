//! The play-out buffer: HIP samples in, as the network brings them; a steady HIP out, one per slave tick.
//!
//! A sample is played a delay after the earliest time at which the network could have brought it, so that
//! jitter, packing, loss and reordering turn into nothing as long as they stay below the delay. The delay
//! follows what 99 of 100 samples need.
//! Between samples it interpolates linearly; when they run out it goes on at constant velocity for a
//! short while and then ramps to a stop. It must never move the tool faster than the limit, never move
//! it on old news for longer than that, and never be blocked for good by stamps, whatever they say.

mod clock;
mod config;
mod lateness;

pub use config::PlayoutConfig;

use std::collections::VecDeque;
use std::time::Duration;

use mmt_shared::channel::peer::Histogram;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::model::sample::HipSample;
use mmt_shared::range::OutOfRange;
use mmt_shared::time::{TICK, Time};
use serde::{Deserialize, Serialize};

use clock::SenderClock;
use lateness::Lateness;

/// Most samples kept: half a second, twice the longest delay.
const SAMPLES_MAX: usize = 512;
/// Played samples are kept for this long, so that a copy is known as a copy. At least [`AVERAGE`].
const HISTORY: Duration = Duration::from_millis(64);
/// The velocity of extrapolation is an average over this long (a model study's choice).
const AVERAGE: Duration = Duration::from_millis(5);
/// Interpolation bridges gaps up to this: the command gap at which the slave holds anyway.
const BRIDGE: Duration = Duration::from_millis(100);
/// A sample from further in the future than this is no sample: no path becomes quicker by as much.
const FUTURE: Duration = Duration::from_secs(1);
/// After this long with only useless samples the sender's clock is learned anew.
const RELEARN_AFTER: Duration = Duration::from_millis(200);
/// After the clock was learned anew, play-out waits for stamps that it has played, but not longer.
const WAIT: Duration = Duration::from_secs(1);
/// The stamp that is told goes ahead of all samples by at most this: where the slave's clock has jumped, no part of the
/// slave may take the jump for motion. So long an outage has released the hand.
const AHEAD: Duration = Duration::from_secs(1);
/// Room above the lateness of 99 of 100 samples, ns: the slave's ticks.
const ROOM_NS: i64 = 2_000_000;
/// How often the delay that is wanted is looked up, ticks: the histogram changes slowly.
const LOOK_EVERY: u32 = 100;
/// The delay grows by at most 1/20 of the time that passes, and shrinks by 1/100: played motion is 5 % too
/// slow while samples come late, which a hand does not notice, and 1 % too quick afterwards.
const GROW_DIVISOR: i64 = 20;
const SHRINK_DIVISOR: i64 = 100;
/// A delay stays while what is wanted is less than this below it, ns: no hunting.
const SHRINK_BAND_NS: i64 = 2_000_000;
/// A tick is at most this long to the speed limit: a slave that was stopped for a second must not jump.
const TICK_MAX: Duration = Duration::from_millis(10);

/// Where a played HIP comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// From samples: one, or two neighbours.
    Interpolated,
    /// Ahead of all samples, at constant velocity.
    Extrapolated,
    /// Samples ran out longer ago than is extrapolated: ramping to a stop, or stopped.
    Stopped,
}

/// What the slave's tool follows in one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Played {
    /// The point of the master's clock that is played, at most a second after the newest sample. Never decreases, unless
    /// the master's clock had to be learned anew and went back by more than a second.
    pub stamp: Time,
    /// HIP, world frame, m.
    pub hip: Vec2,
    /// Its velocity over the last tick, world frame, m/s.
    pub velocity: Vec2,
    /// `f_m` that the master rendered for this HIP, N; none where the HIP is not the master's: extrapolated,
    /// stopped or held back by the speed limit.
    pub force: Option<Vec2>,
    /// Where it comes from.
    pub status: Status,
    /// Whether the speed limit holds the HIP back.
    pub limited: bool,
}

/// What happened to samples that were not played, and how often play-out was not nominal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PlayoutCounts {
    /// Samples pushed.
    pub pushed: u64,
    /// Came after their time; the newest of them still guides the extrapolation.
    pub late: u64,
    /// Copies of a sample that was there.
    pub duplicate: u64,
    /// Oldest samples that made room, because the slave did not tick.
    pub overflow: u64,
    /// Stamps from more than a second in the future.
    pub implausible: u64,
    /// Times the sender's clock was learned anew.
    pub relearned: u64,
    /// Ticks played from samples.
    pub interpolated: u64,
    /// Ticks extrapolated.
    pub extrapolated: u64,
    /// Ticks stopping or stopped.
    pub stopped: u64,
    /// Ticks in which the speed limit held the HIP back.
    pub limited: u64,
}

/// The buffer. Allocates when made, never afterwards.
#[derive(Clone, Debug)]
pub struct PlayoutBuffer {
    config: PlayoutConfig,
    delay_ns: i64,
    /// Least and greatest delay, ns.
    delay_range_ns: (i64, i64),
    /// Where the delay slews to, ns.
    wanted_ns: i64,
    looked: u32,
    lateness: Lateness,
    extrapolation: Duration,
    clock: SenderClock,
    /// In the order of their stamps, no stamp twice.
    samples: VecDeque<HipSample>,
    last: Option<Last>,
    /// Where the tool was before the first sample.
    start: Option<Vec2>,
    /// Since when only useless samples have come.
    useless_since: Option<Time>,
    counts: PlayoutCounts,
    delays: Histogram,
}

#[derive(Clone, Copy, Debug)]
struct Last {
    now: Time,
    stamp: Time,
    /// The stamp that was told.
    told: Time,
    hip: Vec2,
}

/// Where the HIP should be, before the speed limit.
struct Aim {
    hip: Vec2,
    force: Option<Vec2>,
    status: Status,
}

impl PlayoutBuffer {
    /// An empty buffer.
    ///
    /// # Errors
    /// Names the first number of the configuration that is outside its range.
    pub fn try_new(config: PlayoutConfig) -> Result<Self, OutOfRange> {
        config.check()?;
        let least = (config.delay_ms * 1e6) as i64;
        Ok(Self {
            delay_ns: least,
            delay_range_ns: (least, least.max((config.delay_max_ms * 1e6) as i64)),
            wanted_ns: least,
            looked: 0,
            lateness: Lateness::new(),
            extrapolation: Duration::from_nanos((config.extrapolation_ms * 1e6) as u64),
            config,
            clock: SenderClock::default(),
            samples: VecDeque::with_capacity(SAMPLES_MAX),
            last: None,
            start: None,
            useless_since: None,
            counts: PlayoutCounts::default(),
            delays: Histogram::new(),
        })
    }

    /// Says where the tool is before the first sample, m: the speed limit then holds from there on.
    pub fn start_at(&mut self, hip: Vec2) {
        self.start = Some(hip);
    }

    /// Takes in a sample that arrived at `arrived` by the slave's clock, in any order.
    pub fn push(&mut self, arrived: Time, sample: &HipSample) {
        self.counts.pushed += 1;
        if self.clock.ahead(arrived, sample.stamp) > FUTURE {
            self.counts.implausible += 1;
            self.refuse(arrived, sample);
            return;
        }
        self.clock.observe(arrived, sample.stamp);
        let Err(place) = self.find(sample.stamp) else {
            // what was there in time asks for no longer delay
            self.counts.duplicate += 1;
            return;
        };
        if let Some(quickest) = self.clock.stamp_at(arrived) {
            self.lateness
                .observe(arrived, quickest.saturating_since(sample.stamp));
        }
        self.admit(arrived, sample, place);
    }

    /// The HIP to follow at `now` by the slave's clock; to be called every tick.
    ///
    /// None until the first sample is due.
    pub fn advance(&mut self, now: Time) -> Option<Played> {
        let elapsed = self
            .last
            .map_or(TICK, |last| now.saturating_since(last.now).min(TICK_MAX));
        self.clock.advance(now, elapsed, self.last.is_some());
        self.adapt(elapsed);
        let due = self.clock.stamp_at(now)?.offset_by(-self.delay_ns);
        let stamp = self.no_earlier_than_played(due);
        let aim = self.aim(stamp)?;
        let told = self.told(stamp);
        let played = self.limit(now, elapsed, told, &aim);
        self.last = Some(Last {
            now,
            stamp,
            told,
            hip: played.hip,
        });
        self.count(&played);
        self.delays.note(self.delay());
        self.forget(stamp);
        Some(played)
    }

    /// Where the HIP was at a stamp, m: the sample of that stamp, or what stands in for it when it is lost
    /// or not there yet. Without the speed limit: the master's hand knows none.
    #[must_use]
    pub fn hip_at(&self, stamp: Time) -> Option<Vec2> {
        self.aim(stamp).map(|aim| aim.hip)
    }

    /// The HIP that was played last, m; none before the first.
    #[must_use]
    pub fn played_hip(&self) -> Option<Vec2> {
        self.last.map(|last| last.hip)
    }

    /// The stamp of the newest sample that is not later than `stamp`.
    #[must_use]
    pub fn sample_before(&self, stamp: Time) -> Option<Time> {
        let next = self.samples.partition_point(|held| held.stamp <= stamp);
        let before = next.checked_sub(1).and_then(|i| self.samples.get(i));
        before.map(|sample| sample.stamp)
    }

    /// What happened so far.
    #[must_use]
    pub fn counts(&self) -> PlayoutCounts {
        self.counts
    }

    /// From the earliest possible arrival of a sample to its play-out, as it is now.
    #[must_use]
    pub fn delay(&self) -> Duration {
        Duration::from_nanos(self.delay_ns.unsigned_abs())
    }

    /// How often each delay was played with, a count a tick.
    #[must_use]
    pub fn delays(&self) -> &Histogram {
        &self.delays
    }

    /// Brings the delay towards what samples need, slowly.
    fn adapt(&mut self, elapsed: Duration) {
        let (least, most) = self.delay_range_ns;
        if least == most {
            return;
        }
        self.looked += 1;
        if self.looked >= LOOK_EVERY {
            self.looked = 0;
            let needed = self.lateness.p99().map_or(least, |late| {
                i64::try_from(late.as_nanos()).map_or(most, |late| late.saturating_add(ROOM_NS))
            });
            self.wanted_ns = needed.clamp(least, most);
        }
        let passed = i64::try_from(elapsed.as_nanos()).unwrap_or(i64::MAX);
        let off = self.wanted_ns - self.delay_ns;
        if off > 0 {
            self.delay_ns += off.min(passed / GROW_DIVISOR);
        } else if off < -SHRINK_BAND_NS || self.wanted_ns == least {
            self.delay_ns += off.max(-passed / SHRINK_DIVISOR);
        }
    }

    fn admit(&mut self, arrived: Time, sample: &HipSample, place: usize) {
        if self.last.is_some_and(|last| sample.stamp <= last.stamp) {
            self.counts.late += 1;
            // while play-out waits for stamps that it has played, samples are in time all the same
            if self.is_overdue(arrived, sample.stamp) && self.refuse(arrived, sample) {
                return;
            }
        } else {
            self.useless_since = None;
        }
        if self.samples.len() < SAMPLES_MAX {
            self.samples.insert(place, *sample);
        } else if place > 0 {
            self.counts.overflow += 1;
            self.samples.pop_front();
            self.samples.insert(place - 1, *sample);
        } else {
            self.counts.overflow += 1;
        }
    }

    /// Notes a useless sample; starts afresh from it when nothing else has come for too long.
    fn refuse(&mut self, arrived: Time, sample: &HipSample) -> bool {
        let since = *self.useless_since.get_or_insert(arrived);
        if arrived.saturating_since(since) < RELEARN_AFTER {
            return false;
        }
        self.counts.relearned += 1;
        self.useless_since = None;
        self.samples.clear();
        self.samples.push_back(*sample);
        self.clock = SenderClock::default();
        self.clock.observe(arrived, sample.stamp);
        if let Some(last) = &mut self.last {
            last.stamp = last.told;
        }
        self.lateness = Lateness::new();
        self.wanted_ns = self.delay_range_ns.0;
        true
    }

    fn is_overdue(&self, arrived: Time, stamp: Time) -> bool {
        let newest = self.clock.stamp_at(arrived);
        newest.is_some_and(|newest| stamp <= newest.offset_by(-self.delay_ns))
    }

    fn find(&self, stamp: Time) -> Result<usize, usize> {
        self.samples.binary_search_by(|held| held.stamp.cmp(&stamp))
    }

    fn no_earlier_than_played(&self, due: Time) -> Time {
        match self.last {
            Some(last) if last.stamp.saturating_since(due) <= WAIT => due.max(last.stamp),
            _ => due,
        }
    }

    fn told(&self, stamp: Time) -> Time {
        let newest = self.samples.back();
        newest.map_or(stamp, |newest| stamp.min(newest.stamp + AHEAD))
    }

    fn aim(&self, stamp: Time) -> Option<Aim> {
        let next = self.samples.partition_point(|held| held.stamp <= stamp);
        let Some(before) = next.checked_sub(1).and_then(|i| self.samples.get(i)) else {
            // nothing to play yet, or after learning the clock anew: stay
            let last = self.last?;
            return Some(Aim {
                hip: last.hip,
                force: None,
                status: Status::Stopped,
            });
        };
        let since = stamp.saturating_since(before.stamp);
        if since.is_zero() {
            return Some(between(before, before, 0.0));
        }
        let after = self.samples.get(next);
        let gap = |after: &HipSample| after.stamp.saturating_since(before.stamp);
        if let Some(after) = after.filter(|&after| gap(after) <= BRIDGE) {
            let share = since.as_secs_f64() / gap(after).as_secs_f64();
            return Some(between(before, after, share));
        }
        Some(self.beyond(before, since))
    }

    /// `since` after the last sample: constant velocity, then a ramp to a stop.
    fn beyond(&self, newest: &HipSample, since: Duration) -> Aim {
        let velocity = self.average_velocity(newest);
        let moving = since.min(self.extrapolation).as_secs_f64();
        let ramp = since.saturating_sub(self.extrapolation).as_secs_f64();
        let speed = velocity.norm();
        let deceleration = self.config.deceleration_m_per_s2;
        let ramp = ramp.min(speed / deceleration);
        // ∫ (1 − a t/|v|) dt over the ramp, in units of v
        let slowing = if speed > 0.0 {
            ramp - 0.5 * deceleration * ramp * ramp / speed
        } else {
            0.0
        };
        Aim {
            hip: newest.hip.metres() + velocity * (moving + slowing),
            force: None,
            status: if since <= self.extrapolation {
                Status::Extrapolated
            } else {
                Status::Stopped
            },
        }
    }

    /// Mean velocity over the last [`AVERAGE`] before a sample, m/s, within the speed limit.
    fn average_velocity(&self, newest: &HipSample) -> Vec2 {
        let from = newest.stamp - AVERAGE;
        let first = self.samples.partition_point(|held| held.stamp < from);
        let Some(oldest) = self.samples.get(first) else {
            return Vec2::zeros();
        };
        let span = newest.stamp.saturating_since(oldest.stamp).as_secs_f64();
        if span <= 0.0 {
            return Vec2::zeros();
        }
        let velocity = (newest.hip.metres() - oldest.hip.metres()) / span;
        let speed = velocity.norm();
        let speed_max = self.config.speed_max_m_per_s;
        if speed > speed_max {
            velocity * (speed_max / speed)
        } else {
            velocity
        }
    }

    fn limit(&self, now: Time, elapsed: Duration, stamp: Time, aim: &Aim) -> Played {
        let from = self.last.map(|last| last.hip).or(self.start);
        let period = elapsed.as_secs_f64();
        let move_max = self.config.speed_max_m_per_s * period;
        let wanted = from.map_or_else(Vec2::zeros, |from| aim.hip - from);
        let distance = wanted.norm();
        // a hair of room, so that a motion at the limit is not held back by rounding
        let limited = distance > move_max * (1.0 + 1e-9);
        let (hip, moved) = match from {
            Some(from) if limited => {
                let moved = wanted * (move_max / distance);
                (from + moved, moved)
            }
            _ => (aim.hip, wanted),
        };
        let still = period <= 0.0 || self.last.is_some_and(|last| last.now >= now);
        Played {
            stamp,
            hip,
            velocity: if still { Vec2::zeros() } else { moved / period },
            force: aim.force.filter(|_| !limited),
            status: aim.status,
            limited,
        }
    }

    fn count(&mut self, played: &Played) {
        let counter = match played.status {
            Status::Interpolated => &mut self.counts.interpolated,
            Status::Extrapolated => &mut self.counts.extrapolated,
            Status::Stopped => &mut self.counts.stopped,
        };
        *counter += 1;
        self.counts.limited += u64::from(played.limited);
    }

    /// Drops what has been played, but for the history before the newest played sample.
    fn forget(&mut self, stamp: Time) {
        let next = self.samples.partition_point(|held| held.stamp <= stamp);
        let Some(newest) = next.checked_sub(1).and_then(|i| self.samples.get(i)) else {
            return;
        };
        let keep_from = newest.stamp - HISTORY;
        while self.samples.front().is_some_and(|s| s.stamp < keep_from) {
            self.samples.pop_front();
        }
    }
}

fn between(a: &HipSample, b: &HipSample, share: f64) -> Aim {
    let mix = |a: Vec2, b: Vec2| if share > 0.0 { a + (b - a) * share } else { a };
    Aim {
        hip: mix(a.hip.metres(), b.hip.metres()),
        force: Some(mix(a.force.newtons(), b.force.newtons())),
        status: Status::Interpolated,
    }
}

const _: () = assert!(HISTORY.as_nanos() >= AVERAGE.as_nanos());

#[cfg(test)]
mod tests;
