//! The slave's end: where the tool goes and when it stands, what is played, which updates leave.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use mmt_server::end::{SlaveEnd, SlaveGiven};
use mmt_server::playout::PlayoutCounts;
use mmt_server::slave::{SlaveConfig, SlaveTick};
use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::model::sample::ForceCounts;
use mmt_shared::model::update::{Cause, Update};
use mmt_shared::time::{TICK, Time};
use mmt_shared::wire::{Datagram, Message, RawState, Side};

mod tool;
mod trigger;

use super::both::Totals;
use super::channel::ChannelChecks;
use super::{Invariant, Verdict};

/// A tick counts as at most this long.
const TICK_MAX: Duration = Duration::from_millis(10);
/// Without a new sample for this long the tool is disengaged; a tick more is none less.
const DISENGAGE: Duration = Duration::from_millis(2010);
/// Stamps go ahead of all samples by at most this.
const AHEAD: Duration = Duration::from_secs(1);
/// Rounding of a force, N.
const ROUNDING_N: f64 = 1e-9;
/// Samples are remembered for so long.
const REMEMBERED: Duration = Duration::from_secs(3);

/// What a slave's end is made of.
#[derive(Clone, Debug)]
pub struct SlaveAbout {
    /// When it begins.
    pub began: Time,
    /// The slave, with the play-out of the session.
    pub config: SlaveConfig,
    /// k_p and k_d of the session.
    pub coupling: Coupling,
    /// Where the tool is at the beginning, m.
    pub tool: Vec2,
}

/// A tick of the slave's end.
#[derive(Clone, Copy)]
pub struct SlaveTicked<'a> {
    /// Its deadline.
    pub now: Time,
    /// When its datagrams leave.
    pub polled: Time,
    /// What it was given.
    pub given: SlaveGiven,
    /// What it gave; none before the first sample is due.
    pub done: Option<&'a SlaveTick>,
    /// The end after it.
    pub end: &'a SlaveEnd,
}

/// Judges one session of a slave.
pub struct SlaveChecks {
    about: SlaveAbout,
    verdict: Verdict,
    channel: ChannelChecks,
    ticked: Time,
    tool: Vec2,
    /// The tool's velocity in the tick before, m/s; none where that tick was missed or the tool touched something.
    velocity: Option<Vec2>,
    /// The tool's velocity as if it had gone its way in one tick, m/s.
    velocity_before: Vec2,
    /// What the tool felt in the tick before, N.
    f_s: Vec2,
    /// Whether the force sensor is broken, and whether the force may still be what it was then.
    sensor_broken: bool,
    unmeasured: bool,
    /// Whether an emergency stop was set in the tick before.
    stopped: bool,
    stops: bool,
    /// Stamp of the newest sample.
    newest: Option<Time>,
    /// For how long there has been no sample that was not there before, as ticks count it: also one behind a stamp
    /// that an enemy put ahead is new.
    quiet: Duration,
    disengaged: bool,
    /// Forces by stamp; an enemy may have sent another one with a stamp that the slave did not accept then.
    samples: BTreeMap<Time, Vec<ForceCounts>>,
    /// Stamps of samples that came since the last tick.
    fresh: Vec<Time>,
    /// Stamps of samples that came when play-out refused some: it may not have these.
    doubtful: BTreeSet<Time>,
    /// What play-out had counted by the last tick.
    counts: PlayoutCounts,
    played: Option<Time>,
    /// How many samples arrived, repeats as well, and how many updates were made.
    arrived: u64,
    updates: u64,
    acknowledged: BTreeSet<u32>,
    /// Numbers and causes of updates that no command has acknowledged, or of late: the samples show it later. And
    /// what had been ticked by then.
    unconfirmed: Vec<(u32, Duration, Cause)>,
    /// All that has been ticked.
    lived: Duration,
    /// The newest update that the slave has given up as lost.
    given_up: u32,
    /// When the trigger last sent something, or began.
    updated: Option<Time>,
    /// Whether the slave's own trigger decides.
    is_own_scheme: bool,
    /// The newest update as it was made, and as it left.
    made: Option<Update>,
    left: Option<Update<RawState>>,
}

impl SlaveChecks {
    /// At the beginning of a session.
    #[must_use]
    pub fn new(about: SlaveAbout) -> Self {
        Self {
            verdict: Verdict::since(about.began),
            channel: ChannelChecks::new(Side::Slave, about.began),
            ticked: about.began,
            tool: about.tool,
            velocity: Some(Vec2::zeros()),
            velocity_before: Vec2::zeros(),
            f_s: Vec2::zeros(),
            sensor_broken: false,
            unmeasured: false,
            stopped: false,
            stops: false,
            newest: None,
            quiet: Duration::ZERO,
            disengaged: false,
            samples: BTreeMap::new(),
            fresh: Vec::new(),
            doubtful: BTreeSet::new(),
            counts: PlayoutCounts::default(),
            played: None,
            arrived: 0,
            updates: 0,
            acknowledged: BTreeSet::from([0]),
            given_up: 0,
            updated: None,
            is_own_scheme: true,
            unconfirmed: Vec::new(),
            lived: Duration::ZERO,
            made: None,
            left: None,
            about,
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
        let Message::Command(command) = message else {
            return;
        };
        self.arrived += command.samples.len() as u64;
        self.acknowledged.insert(command.newest_update);
        self.confirm(command.newest_update);
        if self.disengaged {
            return;
        }
        for sample in command.samples.as_slice() {
            let forces = self.samples.entry(sample.stamp).or_default();
            if forces.is_empty() {
                self.quiet = Duration::ZERO;
            }
            self.fresh.push(sample.stamp);
            // repeats are the same
            if !forces.contains(&sample.force) {
                forces.push(sample.force);
            }
            self.newest = self.newest.max(Some(sample.stamp));
        }
        let newest = self.newest.unwrap_or_default();
        self.samples = self.samples.split_off(&(newest - REMEMBERED));
        self.doubtful = self.doubtful.split_off(&(newest - REMEMBERED));
    }

    /// Takes in what play-out counts: it did not accept a sample, had no room for it, or learned the clock anew and dropped all.
    fn doubt(&mut self, counts: PlayoutCounts) {
        let before = std::mem::replace(&mut self.counts, counts);
        let fresh = self.fresh.drain(..);
        if counts.relearned > before.relearned {
            self.doubtful.extend(self.samples.keys());
        } else if counts.implausible > before.implausible || counts.overflow > before.overflow {
            self.doubtful.extend(fresh);
        }
    }

    /// A command acknowledges an update; of a number that never left it acknowledges none.
    fn confirm(&mut self, sequence: u32) {
        let left = self.left.map_or(0, |left| left.sequence);
        let lived = self.lived;
        if sequence <= left {
            self.unconfirmed
                .retain(|(made, then, _)| *made > sequence || *then + REMEMBERED > lived);
        }
    }

    /// A datagram that leaves.
    pub fn left(&mut self, at: Time, bytes: &[u8]) {
        let datagram = self.channel.left(at, bytes, self.stops, &mut self.verdict);
        let Some(Message::Update(update)) = datagram.map(|datagram| datagram.message) else {
            return;
        };
        let made = self.made.as_ref().map(Update::from);
        let repeats = self.left.as_ref() == Some(&update);
        let next = self.left.map_or(1, |left| left.sequence.saturating_add(1));
        let holds = repeats || (made.as_ref() == Some(&update) && update.sequence == next);
        self.verdict.judge(Invariant::UpdateTrue, at, holds, || {
            format!("{update:?} leaves; {made:?} was made, number {next} is due")
        });
        self.left = Some(update);
    }

    /// Whether the force sensor is broken from now on. The limit of the tool's force bounds only what the sensor measures.
    pub(crate) fn set_sensor_broken(&mut self, broken: bool) {
        self.sensor_broken = broken;
    }

    /// A tick, before what it sends leaves.
    pub fn ticked(&mut self, tick: &SlaveTicked<'_>) {
        self.stops = tick.given.stops;
        self.channel
            .ticked(tick.now, tick.polled, &mut self.verdict);
        let elapsed = tick.now.saturating_since(self.ticked).min(TICK_MAX);
        self.lived += elapsed;
        if self.newest.is_some() {
            self.quiet += elapsed;
        }
        self.disengaged |= self.quiet > DISENGAGE;
        self.doubt(tick.end.slave().playout().counts());
        if let Some(done) = tick.done {
            // the tool begins from rest: its first tick is one period, however long ago the session began
            let elapsed = self.played.map_or(TICK, |_| elapsed);
            // a plant of somebody else's moves its tool itself
            if tick.end.plant_command().is_none() {
                self.judge_tool(tick, done, elapsed);
                self.judge_standing(tick, done, elapsed);
                self.judge_force(tick.now, done);
            }
            self.judge_play(tick.now, done);
            self.judge_trigger(tick, done);
            self.judge_update(tick.now, done);
            (self.tool, self.f_s) = (done.tool, done.f_s);
        }
        self.judge_counters(tick);
        let confirmed = tick.end.slave().shadow().newest_confirmed();
        let sent = self.left.map_or(0, |left| left.sequence);
        let holds = confirmed <= sent && self.acknowledged.contains(&confirmed);
        self.verdict
            .judge(Invariant::ShadowConfirmed, tick.now, holds, || {
                format!("update {confirmed} is taken for confirmed, {sent} is the newest that left")
            });
        self.ticked = tick.now;
    }

    /// Each sample that arrived was played out or dropped, and each update but the one that waits left or was dropped.
    fn judge_counters(&mut self, tick: &SlaveTicked<'_>) {
        let (now, end, counts) = (tick.now, tick.end, tick.end.counts());
        self.channel.balances(now, end.channel(), &mut self.verdict);
        let samples = counts.samples + counts.samples_disengaged;
        let became = counts.updates.total() + counts.updates_superseded + counts.updates_unsent;
        let (arrived, made) = (self.arrived, self.updates);
        let holds = samples == arrived && (became == made || became + 1 == made);
        self.verdict
            .judge(Invariant::CountersBalance, now, holds, || {
                format!("{arrived} samples arrived, {made} updates were made: {counts:?}")
            });
    }

    fn judge_play(&mut self, now: Time, done: &SlaveTick) {
        let (stamp, newest) = (done.stamp, self.newest.unwrap_or_default());
        let before = self.played.replace(stamp).unwrap_or_default();
        // a clock that was learned anew may go back by more than a second
        let learned = before.saturating_since(stamp) > AHEAD;
        let holds = (stamp >= before || learned) && stamp <= newest + AHEAD;
        self.verdict.judge(Invariant::PlaysInOrder, now, holds, || {
            format!("{stamp:?} is played after {before:?}, {newest:?} is the newest sample")
        });
        if let (Some(f_m), Some(rendered)) = (done.f_m, self.rendered_at(stamp)) {
            let holds = rendered
                .iter()
                .any(|force| (force - f_m).norm() <= ROUNDING_N);
            self.verdict.judge(Invariant::PlaysTrue, now, holds, || {
                format!(
                    "{f_m:?} N are taken for f_m at {stamp:?}, the samples there have {rendered:?}"
                )
            });
        }
    }

    /// f_m at a stamp, N: linear between the samples around it, by each of the forces that came with their stamps.
    /// None where play-out may not have these samples.
    fn rendered_at(&self, stamp: Time) -> Option<Vec<Vec2>> {
        let (before, from) = self.samples.range(..=stamp).next_back()?;
        let (after, to) = if *before == stamp {
            (before, from)
        } else {
            self.samples.range(stamp..).next()?
        };
        if self.doubtful.contains(before) || self.doubtful.contains(after) {
            return None;
        }
        let gap = after.saturating_since(*before).as_secs_f64();
        let share = if gap > 0.0 {
            stamp.saturating_since(*before).as_secs_f64() / gap
        } else {
            0.0
        };
        let mix = |a: Vec2, b: Vec2| a + (b - a) * share;
        let pairs = from
            .iter()
            .flat_map(|a| to.iter().map(move |b| mix(a.newtons(), b.newtons())));
        Some(pairs.collect())
    }
}
