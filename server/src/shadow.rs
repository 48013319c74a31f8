//! What the slave knows of the master's local model: two copies of it, driven by the same HIP samples.
//!
//! One has every update applied when it is sent: it is ahead of the master by a round trip, and the
//! trigger judges it, because what has been sent need not be sent again. The other applies an update when
//! the master acknowledges it: it is what the master really is. When an update turns out to be lost,
//! the first is made anew from the second. It must never take for received what was not acknowledged.

use std::collections::VecDeque;
use std::time::Duration;

use mmt_shared::model::geometry::Vec2;
use mmt_shared::model::local_model::{LocalModel, Rendered};
use mmt_shared::model::params::ModelState;
use mmt_shared::model::sample::HipSample;
use mmt_shared::model::settings::ModelSettings;
use mmt_shared::model::update::{Cause, Update};
use mmt_shared::time::{TICK, Time, duration_nanos};
use serde::{Deserialize, Serialize};

/// Updates that may be on their way: a round trip of 4 s with one per sample.
const SENT_MAX: usize = 4096;
/// Acknowledgements that may wait for play-out.
const ACKNOWLEDGED_MAX: usize = 512;
/// The loop's delay is the longest of this many acknowledgements.
const LOOPS: usize = 8;
/// An update is lost when its acknowledgement is this much later than the loop's delay: several packets
/// and the jitter of a poor path. A verdict that was wrong is taken back by the acknowledgement.
const OVERDUE: Duration = Duration::from_millis(100);
/// The loop's delay before anything has been acknowledged: beyond any that the history can replay.
const LOOP_UNKNOWN: Duration = Duration::from_secs(4);
/// Time without updates after which both copies are the same but for rounding, and are made so.
const SETTLED: Duration = Duration::from_secs(1);
/// Most samples that the copies catch up with in a tick: after a longer gap they begin anew from there.
const CATCH_UP: u32 = 16;
/// The most ticks that the copies make at once, a second: the clocks of both hosts may have gone on for hours while neither
/// ticked, as those of a demo that was stopped and continued, and nobody felt anything meanwhile.
const AT_ONCE: u64 = 1000;

/// What the trigger compares the measured force with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TriggerReference {
    /// The master's model with everything that was sent: what the hand is about to feel.
    #[default]
    Shadow,
    /// The force that was really rendered, as the commands carry it: what the hand felt a round trip ago.
    Echo,
    /// The measured force of the last update: a deadband that knows no model, and no contact but its own.
    None,
}

/// The two copies.
#[derive(Clone, Debug)]
pub struct Shadow {
    ahead: LocalModel,
    confirmed: LocalModel,
    /// Sent and not acknowledged, in the order of their numbers.
    sent: VecDeque<Update>,
    /// Newest update acknowledged, and the stamp of the first sample that did; in the order of both.
    acknowledged: VecDeque<(u32, Time)>,
    /// Newest update that was applied to the confirmed copy, and when, by the samples' stamps.
    applied: (u32, Time),
    /// Updates up to this number that were not acknowledged have been given up.
    given_up: u32,
    lost: u64,
    loops: [Duration; LOOPS],
    next_loop: usize,
    /// Stamp of the newest sample that the copies took.
    newest: Option<Time>,
}

impl Shadow {
    /// Copies of a model that starts in `start`; the tool presses with `tool_force_max_n` (N) at the most.
    #[must_use]
    pub fn new(settings: ModelSettings, start: ModelState, tool_force_max_n: f64) -> Self {
        let model = LocalModel::new(settings, start, tool_force_max_n);
        Self {
            confirmed: model.clone(),
            ahead: model,
            sent: VecDeque::with_capacity(SENT_MAX),
            acknowledged: VecDeque::with_capacity(ACKNOWLEDGED_MAX),
            applied: (0, Time::ZERO),
            given_up: 0,
            lost: 0,
            loops: [Duration::ZERO; LOOPS],
            next_loop: 0,
            newest: None,
        }
    }

    /// The copy with every update applied when it was sent.
    #[must_use]
    pub fn ahead(&self) -> &LocalModel {
        &self.ahead
    }

    /// The copy with the updates that the master has acknowledged: equal to the master's model, but that an
    /// update is applied up to one command's samples too early.
    #[must_use]
    pub fn confirmed(&self) -> &LocalModel {
        &self.confirmed
    }

    /// Number of the newest update that the confirmed copy has.
    #[must_use]
    pub fn newest_confirmed(&self) -> u32 {
        self.applied.0
    }

    /// Updates that the master did not get, or got too late to take.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// The newest update that was given up as lost, after which something is sent in its place; 0: none was.
    #[must_use]
    pub fn newest_given_up(&self) -> u32 {
        self.given_up
    }

    /// Updates that the master has not acknowledged: those that are lost, and those that it may still acknowledge.
    #[must_use]
    pub fn unacknowledged(&self) -> u64 {
        self.lost + self.waiting()
    }

    /// Updates that the master may still acknowledge.
    fn waiting(&self) -> u64 {
        let waiting = self.sent.iter().filter(|u| u.sequence > self.given_up);
        waiting.count() as u64
    }

    /// Whether nothing that was sent is on its way.
    #[must_use]
    pub fn nothing_in_flight(&self) -> bool {
        self.sent.back().is_none_or(|u| u.sequence <= self.given_up)
    }

    /// Takes in the newest update that the master had by the end of the command of a sample.
    pub fn acknowledge(&mut self, sample: &HipSample, newest_update: u32) {
        if newest_update <= self.applied.0 {
            return;
        }
        let known = self
            .acknowledged
            .iter_mut()
            .find(|(number, _)| *number == newest_update);
        if let Some((_, stamp)) = known {
            *stamp = sample.stamp.min(*stamp);
            return;
        }
        if self.acknowledged.len() == ACKNOWLEDGED_MAX {
            self.acknowledged.pop_front();
        }
        let place = self
            .acknowledged
            .partition_point(|(number, _)| *number < newest_update);
        self.acknowledged
            .insert(place, (newest_update, sample.stamp));
    }

    /// Applies an update that is sent now.
    pub fn send(&mut self, update: &Update) {
        if self.sent.len() == SENT_MAX {
            let oldest = self.sent.pop_front();
            self.lost += u64::from(oldest.is_some_and(|u| u.sequence > self.given_up));
        }
        self.sent.push_back(*update);
        self.ahead.apply(update);
    }

    /// Takes the HIP samples up to `until`, the stamp that is played now; `hip_at` gives the HIP at a stamp.
    /// The grid is that of `on_grid`, the stamp of any sample. Returns the cause of the newest update if that
    /// was found to be lost.
    pub fn step(
        &mut self,
        on_grid: Time,
        until: Time,
        hip_at: impl Fn(Time) -> Option<Vec2>,
    ) -> Option<Cause> {
        let mut stamp = self.next_stamp(on_grid, until);
        while stamp <= until {
            if let Some(hip) = hip_at(stamp) {
                self.take_acknowledged(stamp);
                self.confirmed.step(stamp, hip);
                self.ahead.step(stamp, hip);
            }
            self.newest = Some(stamp);
            stamp += TICK;
        }
        self.settle();
        self.give_up_the_overdue()
    }

    /// What the copy that is ahead rendered for the newest sample.
    #[must_use]
    pub fn rendered(&self) -> &Rendered {
        self.ahead.rendered()
    }

    fn next_stamp(&self, on_grid: Time, until: Time) -> Time {
        match self.newest {
            Some(newest) if until.saturating_since(newest) <= TICK * CATCH_UP => newest + TICK,
            // the copies have not begun, or were left too far behind
            Some(newest) => no_further_back(newest.max(on_grid.min(until)), until),
            None => no_further_back(on_grid.min(until), until),
        }
    }

    fn take_acknowledged(&mut self, stamp: Time) {
        while let Some((number, _)) = self.acknowledged.front().filter(|(_, at)| *at <= stamp) {
            let number = *number;
            self.acknowledged.pop_front();
            self.confirm(number, stamp);
        }
    }

    /// The master has update `number`. Those before it that it never acknowledged were lost or overtaken;
    /// either way the newer one took their place.
    fn confirm(&mut self, number: u32, stamp: Time) {
        let mut found = None;
        while let Some(update) = self.sent.front().filter(|u| u.sequence <= number) {
            let update = *update;
            self.sent.pop_front();
            if update.sequence == number {
                found = Some(update);
            } else if update.sequence > self.given_up {
                self.lost += 1;
            }
        }
        let Some(update) = found else { return };
        self.confirmed.apply(&update);
        self.applied = (number, stamp);
        self.learn_loop(stamp.saturating_since(update.answers));
        if number <= self.given_up {
            // given up too early
            self.lost = self.lost.saturating_sub(1);
            self.make_anew();
        }
    }

    fn learn_loop(&mut self, delay: Duration) {
        if let Some(slot) = self.loops.get_mut(self.next_loop) {
            *slot = delay;
        }
        self.next_loop = (self.next_loop + 1) % LOOPS;
    }

    fn loop_delay(&self) -> Duration {
        let longest = self.loops.iter().max().copied().unwrap_or_default();
        if longest.is_zero() {
            LOOP_UNKNOWN
        } else {
            longest
        }
    }

    /// Gives up what should have been acknowledged by now, if it is the newest that was sent: what came
    /// after a lost update has taken its place anyway.
    fn give_up_the_overdue(&mut self) -> Option<Cause> {
        let (newest, last) = (self.newest?, self.sent.back()?);
        let overdue = newest.saturating_since(last.answers) > self.loop_delay() + OVERDUE;
        if !overdue || last.sequence <= self.given_up {
            return None;
        }
        let (given_up, cause) = (last.sequence, last.cause);
        self.lost += self.waiting();
        self.given_up = given_up;
        self.make_anew();
        Some(cause)
    }

    /// The copy that is ahead becomes what the master is, with what is still on its way.
    fn make_anew(&mut self) {
        self.ahead.take_over(&self.confirmed);
        if let Some(update) = self.sent.back().filter(|u| u.sequence > self.given_up) {
            self.ahead.apply(update);
        }
    }

    fn settle(&mut self) {
        let (_, since) = self.applied;
        let quiet = self.newest.map(|newest| newest.saturating_since(since));
        let quiet = quiet.is_some_and(|quiet| quiet >= SETTLED && quiet < SETTLED + TICK);
        if quiet && self.nothing_in_flight() {
            self.make_anew();
        }
    }
}

/// `from`, or so many whole ticks later that no more than [`AT_ONCE`] lie before `until`.
fn no_further_back(from: Time, until: Time) -> Time {
    let ticks = duration_nanos(until.saturating_since(from)) / duration_nanos(TICK);
    let left_out = ticks.saturating_sub(AT_ONCE);
    from + Duration::from_nanos(left_out.saturating_mul(duration_nanos(TICK)))
}

#[cfg(test)]
mod tests;
