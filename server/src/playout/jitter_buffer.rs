//! The jitter buffer: samples in any order in, the stamp that is due out.
//!
//! Jitter, packing, loss and reordering leave no trace as long as they stay below the delay. It must never be blocked
//! for good by stamps: when only useless samples come, the sender's clock is learned anew.

use std::collections::VecDeque;
use std::time::Duration;

use mmt_shared::model::sample::HipSample;
use mmt_shared::time::Time;

use super::clock::SenderClock;
use super::config::PlayoutConfig;
use super::delay::AdaptiveDelay;
use super::interpolator::{AVERAGE, around};
use super::played::PlayoutCounts;

/// Most samples kept: half a second, twice the longest delay.
pub(super) const SAMPLES_MAX: usize = 512;
/// Played samples are kept for this long, so that a copy is known as a copy. At least [`AVERAGE`].
const HISTORY: Duration = Duration::from_millis(64);
/// A sample from further in the future than this is no sample: no path becomes quicker by as much.
const FUTURE: Duration = Duration::from_secs(1);
/// After this long with only useless samples the sender's clock is learned anew.
const RELEARN_AFTER: Duration = Duration::from_millis(200);
/// After the clock was learned anew, play-out waits for stamps that it has played, but not longer.
pub(super) const WAIT: Duration = Duration::from_secs(1);
/// The stamp that is reported goes ahead of all samples by at most this: where the slave's clock has jumped, no part of
/// the slave may take the jump for motion. So long an outage has released the hand.
const AHEAD: Duration = Duration::from_secs(1);

/// Samples and when they are due.
#[derive(Clone, Debug)]
pub(super) struct JitterBuffer {
    pub(super) delay: AdaptiveDelay,
    clock: SenderClock,
    /// In the order of their stamps, no stamp twice.
    samples: VecDeque<HipSample>,
    last: Option<Last>,
    /// Since when only useless samples have come.
    useless_since: Option<Time>,
}

/// What was played last.
#[derive(Clone, Copy, Debug)]
struct Last {
    stamp: Time,
    /// The stamp that was reported for it.
    reported: Time,
}

impl JitterBuffer {
    /// Allocates here and never again.
    pub(super) fn new(config: &PlayoutConfig) -> Self {
        Self {
            delay: AdaptiveDelay::new(config),
            clock: SenderClock::new(),
            samples: VecDeque::with_capacity(SAMPLES_MAX),
            last: None,
            useless_since: None,
        }
    }

    /// In the order of their stamps, no stamp twice.
    pub(super) fn samples(&self) -> &VecDeque<HipSample> {
        &self.samples
    }

    /// Takes in a sample that arrived at `arrived`.
    pub(super) fn push(&mut self, arrived: Time, sample: &HipSample, counts: &mut PlayoutCounts) {
        counts.pushed += 1;
        if self.clock.ahead(arrived, sample.stamp) > FUTURE {
            counts.implausible += 1;
            self.refuse(arrived, sample, counts);
            return;
        }
        self.clock.observe(arrived, sample.stamp);
        let place = self
            .samples
            .binary_search_by(|held| held.stamp.cmp(&sample.stamp));
        let Err(place) = place else {
            // the first copy was in time: this one asks for no longer delay
            counts.duplicate += 1;
            return;
        };
        if let Some(quickest) = self.clock.stamp_at(arrived) {
            let late = quickest.saturating_since(sample.stamp);
            self.delay.observe(arrived, late);
        }
        self.admit(arrived, sample, place, counts);
    }

    /// Lets `elapsed` pass until `now`. Returns the stamp that is due, never before the one that was played last; none
    /// before the first sample.
    pub(super) fn due(&mut self, now: Time, elapsed: Duration) -> Option<Time> {
        self.clock.advance(now, elapsed, self.last.is_some());
        self.delay.advance(elapsed);
        let due = self.delay.before(self.clock.stamp_at(now)?);
        Some(match self.last {
            Some(last) if last.stamp.saturating_since(due) <= WAIT => due.max(last.stamp),
            _ => due,
        })
    }

    /// Notes that `stamp` is played, drops what is no longer needed, and returns the stamp to report.
    pub(super) fn play(&mut self, stamp: Time) -> Time {
        let newest = self.samples.back();
        let ahead = newest.map_or(stamp, |newest| stamp.min(newest.stamp + AHEAD));
        // the clock may have been learned anew from an older sample
        let reported = match self.last {
            Some(last) if stamp >= last.stamp => ahead.max(last.reported),
            _ => ahead,
        };
        self.last = Some(Last { stamp, reported });
        self.forget(stamp);
        reported
    }

    fn admit(
        &mut self,
        arrived: Time,
        sample: &HipSample,
        place: usize,
        counts: &mut PlayoutCounts,
    ) {
        if self.last.is_some_and(|last| sample.stamp <= last.stamp) {
            counts.late += 1;
            // while play-out waits for stamps that it has played, samples are in time all the same
            let overdue = self.is_overdue(arrived, sample.stamp);
            if overdue && self.refuse(arrived, sample, counts) {
                return;
            }
        } else {
            self.useless_since = None;
        }
        if self.samples.len() < SAMPLES_MAX {
            self.samples.insert(place, *sample);
            return;
        }
        counts.overflow += 1;
        if place > 0 {
            self.samples.pop_front();
            self.samples.insert(place - 1, *sample);
        }
    }

    /// Notes a useless sample. Starts afresh from it, and returns true, when nothing else has come for too long.
    fn refuse(&mut self, arrived: Time, sample: &HipSample, counts: &mut PlayoutCounts) -> bool {
        let since = *self.useless_since.get_or_insert(arrived);
        if arrived.saturating_since(since) < RELEARN_AFTER {
            return false;
        }
        counts.relearned += 1;
        self.useless_since = None;
        self.samples.clear();
        self.samples.push_back(*sample);
        self.clock = SenderClock::new();
        self.clock.observe(arrived, sample.stamp);
        if let Some(last) = &mut self.last {
            last.stamp = last.reported;
        }
        self.delay.relearn();
        true
    }

    fn is_overdue(&self, arrived: Time, stamp: Time) -> bool {
        let newest = self.clock.stamp_at(arrived);
        newest.is_some_and(|newest| stamp <= self.delay.before(newest))
    }

    /// Drops what has been played, but for the history before the newest played sample.
    fn forget(&mut self, stamp: Time) {
        let (Some(newest), _) = around(&self.samples, stamp) else {
            return;
        };
        let keep_from = newest.stamp - HISTORY;
        while self.samples.front().is_some_and(|s| s.stamp < keep_from) {
            self.samples.pop_front();
        }
    }
}

const _: () = assert!(HISTORY.as_nanos() >= AVERAGE.as_nanos());
