//! The master's end: what the hand is pushed with, the state of the link, which updates are applied, what leaves.

use std::collections::VecDeque;
use std::time::Duration;

use mmt_client::end::{MasterEnd, MasterGiven};
use mmt_client::failsafe::LinkState;
use mmt_client::limiter::Limits;
use mmt_client::master::MasterTick;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::model::sample::HipSample;
use mmt_shared::model::settings::ModelSettings;
use mmt_shared::time::{TICK, Time};
use mmt_shared::wire::{Command, Datagram, Message, Side};

mod accepted;
mod hand;

use accepted::Accepted;

use super::both::Totals;
use super::channel::ChannelChecks;
use super::intake::WINDOW;
use super::{Invariant, Verdict};

/// The contract's thresholds, not those of the code.
const LATE: Duration = Duration::from_millis(120);
const STALE: Duration = Duration::from_millis(250);
const RELEASE: Duration = Duration::from_secs(1);
/// From the sample that a slave plays to the update that answers it and to its last repeat, at most.
const ANSWER: Duration = Duration::from_millis(500);
/// No hand goes as far in a tick, m: that is 50 m/s, or 5 m/s through ten ticks that were missed.
const JUMP_M: f64 = 0.05;
/// Samples that are remembered: three commands and more.
const SAMPLES: usize = 256;
/// Ticks that are remembered: more than any age that is allowed.
const STAMPS: usize = 8192;

/// What a master's end is made of.
#[derive(Clone, Copy, Debug)]
pub struct MasterAbout {
    /// When it begins.
    pub began: Time,
    /// F_max and S_max.
    pub limits: Limits,
    /// How both sides run the model.
    pub settings: ModelSettings,
    /// Where the tool is, and with it the HIP, m.
    pub start: Vec2,
}

/// A tick of the master's end.
#[derive(Clone, Copy)]
pub struct MasterTicked<'a> {
    /// Its deadline.
    pub now: Time,
    /// When its datagrams leave.
    pub polled: Time,
    /// What it was given.
    pub given: MasterGiven,
    /// What it gave.
    pub done: &'a MasterTick,
    /// The end after it.
    pub end: &'a MasterEnd,
}

/// An update that arrived and may be applied.
#[derive(Clone, Copy)]
struct Arrived {
    /// The ticks since the sample that it answers.
    age: Duration,
    sequence: u32,
    /// Whether the end must take it.
    sure: bool,
    /// The longest round trip of late; none before the first.
    path: Option<Duration>,
}

/// Judges one session of a master.
pub struct MasterChecks {
    about: MasterAbout,
    verdict: Verdict,
    channel: ChannelChecks,
    force: Vec2,
    /// How far the ramp may be in.
    ramp: u32,
    /// |f| where an emergency stop began, N, and the ticks since.
    stopped: Option<(f64, u32)>,
    stops: bool,
    ended: bool,
    link: LinkState,
    /// Since the last tick.
    arrived: Vec<Arrived>,
    accepted: Accepted,
    /// The last sequence that was too far ahead.
    far: u32,
    applied: u32,
    samples: VecDeque<HipSample>,
    stamps: VecDeque<Time>,
    hip: Vec2,
    /// The device's reading has jumped in this session, as no hand does.
    jumped: bool,
}

impl MasterChecks {
    /// At the beginning of a session.
    #[must_use]
    pub fn new(about: MasterAbout) -> Self {
        Self {
            about,
            verdict: Verdict::since(about.began),
            channel: ChannelChecks::new(Side::Master, about.began),
            force: Vec2::zeros(),
            ramp: 0,
            stopped: None,
            stops: false,
            ended: false,
            link: LinkState::Fresh,
            arrived: Vec::new(),
            accepted: Accepted::default(),
            far: 0,
            applied: 0,
            samples: VecDeque::new(),
            stamps: VecDeque::new(),
            hip: about.start,
            jumped: false,
        }
    }

    /// What was found.
    #[must_use]
    pub fn verdict(&self) -> &Verdict {
        &self.verdict
    }

    pub(super) fn totals(&self) -> Totals {
        self.channel.totals()
    }

    /// A datagram that arrived.
    pub fn arrived(&mut self, at: Time, bytes: &[u8]) {
        let Some(Datagram { message, .. }) = self.channel.arrived(at, bytes) else {
            return;
        };
        let Message::Update(update) = message else {
            return;
        };
        if !self.is_fresh(update.sequence) || update.accept(&self.about.settings.coupling).is_err()
        {
            return;
        }
        let (silence, most) = self.channel.silence(at);
        let age = TICK * self.ticks_since(update.answers);
        let path = self.channel.longest_round_trip();
        let too_old = |path| age > path + ANSWER + STALE;
        // between nine and eleven seconds an end may have forgotten a round trip
        let remembered = self.channel.longest_remembered(at).unwrap_or_default();
        let may_be_too_old = path.is_some() && too_old(remembered);
        // whether it is taken in the hair's breadth between is the end's own business
        let sure = most < STALE && !may_be_too_old;
        if silence < STALE {
            self.arrived.push(Arrived {
                age,
                sequence: update.sequence,
                sure,
                path,
            });
        }
        if sure {
            self.accepted.accepts(update.sequence);
        } else if silence < STALE && !path.is_some_and(too_old) {
            self.accepted.may_accept(update.sequence);
        }
    }

    /// Whether an update may be applied by its sequence: beyond the newest, and either near it or not alone there.
    fn is_fresh(&mut self, sequence: u32) -> bool {
        let ahead = sequence.saturating_sub(self.accepted.newest());
        let is_alone = ahead >= WINDOW && sequence.abs_diff(self.far) >= WINDOW;
        if is_alone {
            self.far = sequence;
        }
        ahead > 0 && !is_alone
    }

    /// How many ticks there have been since a stamp: where a process stood still nothing has moved.
    fn ticks_since(&self, stamp: Time) -> u32 {
        let before = self.stamps.partition_point(|tick| *tick <= stamp);
        (self.stamps.len() - before) as u32
    }

    /// A datagram that leaves.
    pub fn left(&mut self, at: Time, bytes: &[u8]) {
        let datagram = self.channel.left(at, bytes, self.stops, &mut self.verdict);
        if let Some(Message::Command(command)) = datagram.map(|datagram| datagram.message) {
            self.commanded(at, &command);
        }
    }

    /// A tick, before what it sends leaves.
    pub fn ticked(&mut self, tick: &MasterTicked<'_>) {
        self.stops = tick.given.stops;
        self.channel
            .ticked(tick.now, tick.polled, &mut self.verdict);
        self.judge_counters(tick);
        self.judge_link(tick);
        self.judge_updates(tick);
        self.judge_force(tick);
        self.judge_model(tick);
        self.judge_sample(tick);
        self.link = tick.done.link;
        self.force = tick.done.hand_force;
    }

    /// Each update that arrived was applied or dropped under its name.
    fn judge_counters(&mut self, tick: &MasterTicked<'_>) {
        let (now, end) = (tick.now, tick.end);
        self.channel.balances(now, end.channel(), &mut self.verdict);
        let arrived = end.channel().counts().received.updates;
        let (applied, drops) = (end.master().applied(), end.update_drops());
        let dropped = drops
            .by_name()
            .iter()
            .map(|(_, number)| number)
            .sum::<u64>();
        let holds = applied.iter().sum::<u64>() + dropped == arrived;
        self.verdict
            .judge(Invariant::CountersBalance, now, holds, || {
                format!("{arrived} updates arrived, {applied:?} by cause are applied, {drops:?}")
            });
    }

    fn judge_link(&mut self, tick: &MasterTicked<'_>) {
        let (now, link) = (tick.now, tick.done.link);
        let (least, most) = self.channel.silence(now);
        let holds =
            self.link == LinkState::Released || (state(least) <= link && link <= state(most));
        self.verdict.judge(Invariant::LinkState, now, holds, || {
            format!("{} after {least:?} to {most:?} of silence", link.name())
        });
        let holds = self.link < LinkState::Released || link == LinkState::Released;
        let name = link.name();
        self.verdict.judge(Invariant::Released, now, holds, || {
            format!("{name} after released")
        });
    }

    fn judge_updates(&mut self, tick: &MasterTicked<'_>) {
        let (now, applied) = (tick.now, tick.end.counts().newest_applied);
        let before = std::mem::replace(&mut self.applied, applied);
        let arrived = std::mem::take(&mut self.arrived);
        let newest = arrived
            .iter()
            .filter(|update| update.sure)
            .map(|update| update.sequence)
            .max();
        // what a released hand is not given is dropped
        let alive = self.link < LinkState::Released;
        let holds = !alive || newest.is_none_or(|newest| applied >= newest);
        self.verdict.judge(Invariant::UpdateTaken, now, holds, || {
            format!("update {newest:?} came and {applied} is in use")
        });
        if applied == before {
            return;
        }
        let found = arrived.iter().find(|update| update.sequence == applied);
        let holds = applied > before && found.is_some();
        self.verdict.judge(Invariant::UpdateOrder, now, holds, || {
            format!(
                "update {applied} is applied after {before}; since the tick before came {:?}",
                sequences(&arrived)
            )
        });
        self.verdict
            .judge(Invariant::UpdateStale, now, found.is_some(), || {
                format!(
                    "update {applied} is applied, which did not come while the link was not stale"
                )
            });
        if let Some((update, path)) = found.and_then(|update| Some((update, update.path?))) {
            let (age, most) = (update.age, path + ANSWER + STALE);
            self.verdict
                .judge(Invariant::UpdateAge, now, age <= most, || {
                    format!(
                        "update {applied} answers a sample of {age:?} of ticks ago, over a path of {path:?}"
                    )
                });
        }
    }

    fn judge_sample(&mut self, tick: &MasterTicked<'_>) {
        let (reading, sample) = (tick.given.reading, tick.done.sample);
        if reading.x.is_finite() && reading.y.is_finite() {
            self.jumped |= (reading - self.hip).norm() > JUMP_M;
            self.hip = reading;
        }
        // where a box that stands takes the HIP back, the one that is used is not the one that was read
        let holds = sample.stamp == tick.now;
        self.verdict
            .judge(Invariant::SamplesTrue, tick.now, holds, || {
                format!("{sample:?} is to be sent")
            });
        if self.samples.len() == SAMPLES {
            self.samples.pop_front();
        }
        self.samples.push_back(sample);
        if self.stamps.len() == STAMPS {
            self.stamps.pop_front();
        }
        self.stamps.push_back(tick.now);
    }

    fn commanded(&mut self, at: Time, command: &Command) {
        let newest = command.newest_update;
        let holds = self.accepted.is_acknowledged(newest);
        let accepted = self.accepted.newest();
        self.verdict.judge(Invariant::Acknowledged, at, holds, || {
            format!("update {newest} is acknowledged, {accepted} is the newest that was accepted")
        });
        let samples = command.samples.as_slice();
        let holds =
            !samples.is_empty() && samples.iter().all(|sample| self.samples.contains(sample));
        self.verdict.judge(Invariant::SamplesTrue, at, holds, || {
            format!("no ticks had all of these samples: {samples:?}")
        });
    }
}

/// The contract's state for this silence.
fn state(silence: Duration) -> LinkState {
    if silence >= RELEASE {
        LinkState::Released
    } else if silence >= STALE {
        LinkState::Stale
    } else if silence >= LATE {
        LinkState::Late
    } else {
        LinkState::Fresh
    }
}

fn sequences(arrived: &[Arrived]) -> Vec<u32> {
    arrived.iter().map(|update| update.sequence).collect()
}
