//! The slave's end: where the tool goes and when it stands, what is played, which updates leave.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use mmt_server::end::{SlaveEnd, SlaveGiven};
use mmt_server::slave::{SlaveConfig, SlaveTick};
use mmt_server::trigger::MismatchMetric;
use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::model::sample::ForceCounts;
use mmt_shared::model::update::{Cause, Update};
use mmt_shared::time::{TICK, TICK_S, Time};
use mmt_shared::wire::{Datagram, Message, RawState, Side};

use super::channel::ChannelChecks;
use super::{Invariant, Verdict};

/// Rounding of places, m.
const HAIR_M: f64 = 1e-9;
/// A tick counts as at most this long.
const TICK_MAX: Duration = Duration::from_millis(10);
/// Without a new sample for this long the tool is disengaged; a tick more is none less.
const DISENGAGE: Duration = Duration::from_millis(2010);
/// From the end of the ramp to where the tool must stand: an overrun, and clocks that drift.
const SLACK: Duration = Duration::from_millis(12);
/// Stamps go ahead of all samples by at most this.
const AHEAD: Duration = Duration::from_secs(1);
/// Samples are remembered for so long.
const REMEMBERED: Duration = Duration::from_secs(3);
/// Clocks that drift make a tick longer or shorter by far less than this share.
const CLOCKS: f64 = 0.01;
/// A force above is no error of the sensor's, N.
const FREE_N: f64 = 1.0;
/// The force may be above the limit by this share: the body moves on within a tick.
const FORCE_SHARE: f64 = 0.02;

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
    /// The tool's speed in the tick before, m/s.
    speed_before: f64,
    /// Whether an emergency stop was set in the tick before.
    stopped: bool,
    stops: bool,
    /// Stamp of the newest sample, and for how long there has been no newer one, as ticks count it.
    newest: Option<Time>,
    silent: Duration,
    /// For how long there has been no sample that was not there before: also one behind a stamp that an enemy put ahead is new.
    quiet: Duration,
    disengaged: bool,
    /// Forces by stamp; an enemy may have sent another one with a stamp that the slave did not believe then.
    samples: BTreeMap<Time, Vec<ForceCounts>>,
    played: Option<Time>,
    acknowledged: BTreeSet<u32>,
    /// Numbers, times and causes of updates that no command has acknowledged, or of late: the samples say it later.
    unconfirmed: Vec<(u32, Time, Cause)>,
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
            speed_before: 0.0,
            stopped: false,
            stops: false,
            newest: None,
            silent: Duration::ZERO,
            quiet: Duration::ZERO,
            disengaged: false,
            samples: BTreeMap::new(),
            played: None,
            acknowledged: BTreeSet::from([0]),
            unconfirmed: Vec::new(),
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

    /// A datagram that arrived.
    pub fn arrived(&mut self, at: Time, bytes: &[u8]) {
        let Some(Datagram { message, .. }) = self.channel.arrived(at, bytes) else {
            return;
        };
        let Message::Command(command) = message else {
            return;
        };
        self.acknowledged.insert(command.newest_update);
        self.confirm(at, command.newest_update);
        if self.disengaged {
            return;
        }
        for sample in command.samples.as_slice() {
            let forces = self.samples.entry(sample.stamp).or_default();
            if forces.is_empty() {
                self.quiet = Duration::ZERO;
            }
            // repeats are the same
            if !forces.contains(&sample.force) {
                forces.push(sample.force);
            }
            if Some(sample.stamp) > self.newest {
                (self.newest, self.silent) = (Some(sample.stamp), Duration::ZERO);
            }
        }
        let newest = self.newest.unwrap_or_default();
        self.samples = self.samples.split_off(&(newest - REMEMBERED));
    }

    /// A command acknowledges an update; of a number that never left it acknowledges none.
    fn confirm(&mut self, at: Time, sequence: u32) {
        let left = self.left.map_or(0, |left| left.sequence);
        if sequence <= left {
            self.unconfirmed
                .retain(|(made, then, _)| *made > sequence || *then + REMEMBERED > at);
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

    /// A tick, before what it sends leaves.
    pub fn ticked(&mut self, tick: &SlaveTicked<'_>) {
        self.stops = tick.given.stops;
        self.channel
            .ticked(tick.now, tick.polled, &mut self.verdict);
        let elapsed = tick.now.saturating_since(self.ticked).min(TICK_MAX);
        if self.newest.is_some() {
            self.silent += elapsed;
            self.quiet += elapsed;
        }
        self.disengaged |= self.silent > DISENGAGE;
        if let Some(done) = tick.done {
            // a plant of somebody else's moves its tool itself
            if tick.end.plant_command().is_none() {
                self.judge_tool(tick, done, elapsed);
                self.judge_standing(tick, done, elapsed);
                self.judge_force(tick.now, done);
            }
            self.judge_play(tick.now, done);
            self.judge_update(tick.now, done);
            self.tool = done.tool;
        }
        let confirmed = tick.end.slave().shadow().newest_confirmed();
        let sent = self.left.map_or(0, |left| left.sequence);
        let holds = confirmed <= sent && self.acknowledged.contains(&confirmed);
        self.verdict
            .judge(Invariant::ShadowConfirmed, tick.now, holds, || {
                format!("update {confirmed} is taken for confirmed, {sent} is the newest that left")
            });
        self.ticked = tick.now;
    }

    /// Speed and reach. What a compliant tool gives by is not its way.
    fn judge_tool(&mut self, tick: &SlaveTicked<'_>, done: &SlaveTick, elapsed: Duration) {
        if self.about.config.tool_compliance.is_some() {
            return;
        }
        let (now, period) = (tick.now, elapsed.max(TICK));
        let way = (done.tool - self.tool).norm();
        let most = self.speed() * period.as_secs_f64();
        self.verdict
            .judge(Invariant::ToolSpeed, now, way <= most + HAIR_M, || {
                format!("{way} m in {period:?}, {most} m are allowed")
            });
        // where the hand feels the tool, it goes only as far as the energy allows
        if !tick.end.architecture().feels_tool() {
            self.judge_acceleration(now, done, elapsed);
        }
        let (before, far) = (self.tool.norm(), done.tool.norm());
        let most = self.about.config.playout.reach_m.max(before);
        self.verdict
            .judge(Invariant::ToolReach, now, far <= most + HAIR_M, || {
                format!("{far} m from the origin, {most} m are allowed")
            });
    }

    /// Acceleration in free space. What the limit of its force does to a tool that touches something is not its own motion, nor
    /// is the end of its reach.
    fn judge_acceleration(&mut self, now: Time, done: &SlaveTick, elapsed: Duration) {
        let playout = &self.about.config.playout;
        let free = done.true_force == Vec2::zeros() && done.f_s.norm() < FREE_N;
        let inside = done.tool.norm() < playout.reach_m - HAIR_M;
        let missed = elapsed > TICK.mul_f64(1.5) || elapsed < TICK.mul_f64(0.5);
        let velocity = (done.tool - self.tool) / TICK_S;
        let velocity = Some(velocity).filter(|_| !missed && free && inside);
        let (Some(velocity), Some(before)) =
            (velocity, std::mem::replace(&mut self.velocity, velocity))
        else {
            return;
        };
        let change = (velocity - before).norm() / TICK_S;
        let most = playout.acceleration_max_m_per_s2;
        let holds = change <= most * (1.0 + CLOCKS) + HAIR_M / (TICK_S * TICK_S);
        self.verdict
            .judge(Invariant::ToolAcceleration, now, holds, || {
                format!("{change} m/s², {most} m/s² are allowed")
            });
    }

    /// The greatest speed, m/s: the configured one, and that at which a first touch costs the limit of the force.
    fn speed(&self) -> f64 {
        let Coupling {
            stiffness_n_per_m: k_p,
            damping_ns_per_m: k_d,
        } = self.about.coupling;
        let approach = self.about.config.tool_force_max_n / (k_d + 2.0 * k_p * TICK_S);
        self.about.config.playout.speed_max_m_per_s.min(approach)
    }

    /// Hold, disengaged and emergency stop: the tool stands, or brakes as hard as it may. One that is pressed on may give way.
    fn judge_standing(&mut self, tick: &SlaveTicked<'_>, done: &SlaveTick, elapsed: Duration) {
        let (now, way) = (tick.now, done.tool - self.tool);
        let stands = way.norm() <= HAIR_M
            || done.f_s.dot(&way) < 0.0
            || self.about.config.tool_compliance.is_some();
        let playout = &self.about.config.playout;
        let period = elapsed.max(TICK).as_secs_f64();
        let speed = way.norm() / period;
        let slower = playout.acceleration_max_m_per_s2 * period * (1.0 - CLOCKS);
        let stands = stands || speed <= self.speed_before - slower;
        self.speed_before = speed;
        let ramp =
            playout.extrapolation_ms * 1e-3 + self.speed() / playout.acceleration_max_m_per_s2;
        let ramp = Duration::from_secs_f64(ramp) + SLACK;
        let beyond = done.stamp.saturating_since(self.newest.unwrap_or_default());
        if beyond.min(self.quiet) > ramp {
            self.verdict.judge(Invariant::ToolHolds, now, stands, || {
                format!("the tool goes {way:?} m at a stamp {beyond:?} after the newest sample's")
            });
        }
        if self.disengaged {
            self.verdict
                .judge(Invariant::ToolDisengaged, now, stands, || {
                    format!("the tool goes {way:?} m in a session that is disengaged")
                });
        }
        let stops = tick.given.stops || self.channel.other_stops();
        if stops && self.stopped {
            self.verdict.judge(Invariant::ToolStops, now, stands, || {
                format!("the tool goes {way:?} m during an emergency stop")
            });
        }
        self.stopped = stops;
    }

    fn judge_force(&mut self, now: Time, done: &SlaveTick) {
        let config = &self.about.config;
        let known = config.environment.contact.is_none_or(|contact| {
            contact.stiffness_n_per_m <= self.about.coupling.stiffness_n_per_m
                && contact.damping_ns_per_m <= self.about.coupling.damping_ns_per_m
        });
        let sensor = &config.sensing;
        let scene = &config.scene;
        // what stops the object at once costs the damping of its speed for a tick: nobody can know before
        let meets = scene.bodies.len() > 1 || !scene.walls.is_empty();
        let stop = if meets || config.environment.wall.is_some() {
            self.about.coupling.damping_ns_per_m * self.speed()
        } else {
            0.0
        };
        // a sensor that lags is no judge of the last milliseconds
        if !known || sensor.force_lag_ms > 0.0 {
            return;
        }
        let drift =
            sensor.force_drift_n_per_s * now.saturating_since(self.about.began).as_secs_f64();
        let errors = sensor.force_bias_n + drift + 6.0 * sensor.force_noise_n;
        let gain = sensor.force_gain.min(1.0);
        let most = (config.tool_force_max_n * (1.0 + FORCE_SHARE) + errors) / gain + stop;
        let force = done.true_force.norm();
        self.verdict
            .judge(Invariant::ToolForce, now, force <= most, || {
                format!("{force} N, {most} N are allowed")
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
        if let (Some(f_m), Some(forces)) = (done.f_m, self.samples.get(&stamp)) {
            let holds = forces.iter().any(|force| force.newtons() == f_m);
            self.verdict.judge(Invariant::PlaysTrue, now, holds, || {
                format!("{f_m:?} N are taken for f_m at {stamp:?}, {forces:?} came with it")
            });
        }
    }

    fn judge_update(&mut self, now: Time, done: &SlaveTick) {
        let Some(update) = done.update else {
            return;
        };
        let touches = done.in_contact;
        // what was lost is sent again, whatever is touched by now
        let again = self
            .unconfirmed
            .iter()
            .any(|(.., cause)| *cause == update.cause);
        // a touch of another body shows the master that body, also after the touch
        let lone = self.about.config.scene.bodies.len() < 2;
        let metric = self.about.config.trigger.metric;
        let fits = !lone
            || match update.cause {
                Cause::MasterOnlyContact | Cause::ContactLost => !touches,
                Cause::SlaveOnlyContact => touches,
                // parameters and pose can differ in free space
                Cause::Deadband => touches || metric != MismatchMetric::Force,
                Cause::Timer | Cause::EverySample => true,
            };
        let holds =
            (fits || again) && update.slave_in_contact == touches && update.answers == done.stamp;
        self.verdict.judge(Invariant::UpdateCause, now, holds, || {
            format!(
                "{:?} with contact {touches} at {:?}, answering {:?}",
                update.cause, done.stamp, update.answers
            )
        });
        self.made = Some(update);
        self.unconfirmed.push((update.sequence, now, update.cause));
    }
}
