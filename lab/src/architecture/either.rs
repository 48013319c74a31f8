//! The architecture that chooses, in virtual time: TDPA or the local model, by what the path and the model are like.
//!
//! Slave, play-out, environment, estimator, shadow and trigger are the live slave's; only its tool may be held to what the
//! hand has paid for. Messages are typed and never meet a socket: their sizes are those of the architecture that is
//! felt. A sample goes out every tick while the tool's force is wanted, ten in a packet otherwise.

use std::time::Duration;

use mmt_client::choice::Chosen;
use mmt_client::device::DeviceProfile;
use mmt_client::either::{EitherMaster, EitherTick, ToolNews};
use mmt_client::limiter::ForceLimiter;
use mmt_client::operator::Operator;
use mmt_client::operator::scripted::{Phase, Scripted};
use mmt_netem::config::LinkConfig;
use mmt_netem::counters::Tally;
use mmt_netem::link::{Direction, LinkId};
use mmt_netem::pipe::SimPath;
use mmt_server::slave::{Slave, SlaveTick};
use mmt_shared::bilateral::Baseline;
use mmt_shared::bilateral::message::{OVERHEAD_BYTES, wire_bytes};
use mmt_shared::geometry::Vec2;
use mmt_shared::metrics::{ContactBreaks, ForcePeak, ForceSummary, PoseError};
use mmt_shared::time::{TICK, Time};
use mmt_shared::wire::{DATAGRAM_MAX, ForceCounts, HipSample, Label, Update, Welcome};

use super::felt::FeltMasses;
use crate::world::{WorldConfig, WorldError};

/// Without a force to stream the slave sends an update or, this often, a heartbeat.
const HEARTBEAT: Duration = Duration::from_millis(50);

/// Master to slave.
#[derive(Clone, Debug)]
struct Up {
    samples: Vec<HipSample>,
    newest_update: u32,
    in_j: f64,
    wants_force: bool,
    passive_tool: bool,
}

/// Slave to master.
#[derive(Clone, Copy, Debug)]
struct Down {
    news: ToolNews,
    update: Option<Update>,
}

/// What a run came to.
#[derive(Clone, Debug, Default)]
pub struct EitherOutcome {
    /// Breaks of contact in what is felt: of the model or of the tool.
    pub breaks: ContactBreaks,
    /// Force on the hand.
    pub on_hand: ForcePeak,
    /// What hand and tool would take the object's mass for.
    pub felt: FeltMasses,
    /// Error of the model's pose, felt or not.
    pub pose: PoseError,
    /// Largest change of the force on the hand in a tick of a fade, N.
    pub fade_step_n: f64,
    /// Ticks in which the tool's force was felt alone.
    pub tdpa_ticks: u64,
    /// Ticks in all.
    pub ticks: u64,
    /// Packets with a force or an update.
    pub with_news: u64,
}

/// The world of the architecture that chooses.
pub struct EitherWorld {
    now: Time,
    slave: Slave,
    master: EitherMaster,
    operator: Operator,
    hand_force: Vec2,
    unsent: Vec<HipSample>,
    samples_per_command: usize,
    /// The newest update that the master has.
    newest_update: u32,
    /// The stamp of the newest sample that the slave has.
    newest_sample: Option<Time>,
    streams: bool,
    last_sent: Time,
    up: SimPath<Up>,
    down: SimPath<Down>,
    outcome: EitherOutcome,
}

impl EitherWorld {
    /// A world at time zero with the scripted operator. `fixed` leaves the master no choice.
    ///
    /// # Errors
    /// When a number of the configuration is not accepted.
    pub fn try_new(config: &WorldConfig, fixed: Option<Chosen>) -> Result<Self, WorldError> {
        let device = DeviceProfile::default().used_with(config.stiffness_n_per_m, None)?;
        let settings = config.slave.mode.model_settings(device.coupling());
        let mut slave_config = config.slave.clone();
        // from nothing up, as packing and jitter ask for
        slave_config.playout.delay_ms = 0.0;
        let mut slave = Slave::with_settings(&slave_config, settings)?;
        let welcome = Welcome {
            settings,
            state: *slave.state(),
            scheme: Label::clipped(&config.slave.trigger.scheme.to_string()),
            program: Label::clipped("lab"),
        };
        let limiter = ForceLimiter::try_new(device.limits())?;
        let master = EitherMaster::new(&welcome, limiter, fixed);
        let scripted = Scripted::try_new(config.operator, master.view())?;
        let operator = Operator::Scripted(Box::new(scripted));
        slave.start_at(operator.start());
        let link = |direction| LinkId::first(direction);
        Ok(Self {
            now: Time::ZERO,
            slave,
            master,
            operator,
            hand_force: Vec2::zeros(),
            unsent: Vec::with_capacity(config.samples_per_command.into()),
            samples_per_command: config.samples_per_command.into(),
            newest_update: 0,
            newest_sample: None,
            streams: false,
            last_sent: Time::ZERO,
            up: SimPath::try_new(config.up.clone(), config.seed, link(Direction::Up))?,
            down: SimPath::try_new(config.down.clone(), config.seed, link(Direction::Down))?,
            outcome: EitherOutcome::default(),
        })
    }

    /// The master.
    #[must_use]
    pub fn master(&self) -> &EitherMaster {
        &self.master
    }

    /// The slave.
    #[must_use]
    pub fn slave(&self) -> &Slave {
        &self.slave
    }

    /// The operator.
    #[must_use]
    pub fn operator(&self) -> &Operator {
        &self.operator
    }

    /// What the run has come to so far.
    #[must_use]
    pub fn outcome(&self) -> &EitherOutcome {
        &self.outcome
    }

    /// The force metrics so far.
    #[must_use]
    pub fn force(&self) -> ForceSummary {
        self.slave.force().summary()
    }

    /// Packets sent up and down, with all headers.
    #[must_use]
    pub fn sent(&self) -> [Tally; 2] {
        [self.up.counters().offered, self.down.counters().offered]
    }

    /// Another network from now on, both ways; what is on its way is lost.
    ///
    /// # Errors
    /// When a number of the network is not accepted.
    pub fn rewire(&mut self, link: &LinkConfig, seed: u64) -> Result<(), WorldError> {
        self.up = SimPath::try_new(link.clone(), seed, LinkId::first(Direction::Up))?;
        self.down = SimPath::try_new(link.clone(), seed, LinkId::first(Direction::Down))?;
        Ok(())
    }

    /// One millisecond, in the order of [`crate::world::World::step`].
    pub fn step(&mut self) -> EitherTick {
        self.now += TICK;
        self.deliver_down();
        let tick = self.master_tick();
        self.deliver_up();
        self.slave_tick();
        tick
    }

    fn deliver_down(&mut self) {
        while let Some(packet) = self.down.pop_due(self.now) {
            if packet.corrupted_bit.is_some() {
                continue;
            }
            self.master.receive(self.now, &packet.payload.news);
            let update = packet.payload.update;
            if let Some(update) = update.filter(|update| update.sequence > self.newest_update) {
                self.master.apply(&update);
                self.newest_update = update.sequence;
            }
        }
    }

    fn master_tick(&mut self) -> EitherTick {
        let elapsed = self.now.saturating_since(Time::ZERO + TICK);
        let view = self.master.view();
        let hip = self.operator.step(elapsed, &view, self.hand_force);
        let pushes = match &self.operator {
            Operator::Scripted(scripted) => scripted.phase() == Phase::Push,
            Operator::Trace(_) => true,
        };
        let tick = self.master.tick(self.now, hip);
        let step_n = (tick.hand_force - self.hand_force).norm();
        self.hand_force = tick.hand_force;
        let outcome = &mut self.outcome;
        outcome.ticks += 1;
        if (0.0..1.0).contains(&self.master.model_share()) && !tick.passive_tool {
            outcome.fade_step_n = outcome.fade_step_n.max(step_n);
        }
        outcome.tdpa_ticks += u64::from(tick.passive_tool);
        outcome.on_hand.push(tick.hand_force);
        let in_contact = self.master.view().in_contact;
        outcome.breaks.push(in_contact);
        outcome
            .felt
            .push_hand(self.now, hip, -tick.hand_force, pushes && in_contact);
        self.unsent.push(tick.sample);
        if tick.wants_force || self.unsent.len() >= self.samples_per_command {
            let samples = std::mem::take(&mut self.unsent);
            let bytes =
                wire_bytes(Baseline::Tdpa) * samples.len() - OVERHEAD_BYTES * (samples.len() - 1);
            let payload = Up {
                samples,
                newest_update: self.newest_update,
                in_j: tick.in_j,
                wants_force: tick.wants_force,
                passive_tool: tick.passive_tool,
            };
            self.up.push(self.now, bytes, payload);
        }
        tick
    }

    fn deliver_up(&mut self) {
        while let Some(packet) = self.up.pop_due(self.now) {
            if packet.corrupted_bit.is_some() {
                continue;
            }
            let said = packet.payload;
            let newest = said.samples.last().map(|sample| sample.stamp);
            for sample in &said.samples {
                self.slave
                    .handle_sample(packet.due, sample, said.newest_update);
            }
            // an older packet knows nothing that a newer one has not said
            if newest > self.newest_sample {
                self.newest_sample = newest;
                self.streams = said.wants_force;
                self.slave.pay_tool(said.in_j, said.passive_tool);
            }
        }
    }

    fn slave_tick(&mut self) {
        let Some(tick) = self.slave.tick(self.now) else {
            return;
        };
        let outcome = &mut self.outcome;
        outcome
            .felt
            .push_tool(tick.stamp, tick.tool, tick.f_s, tick.in_contact);
        if let Some(then) = self.master.model().history().at(tick.stamp) {
            outcome.pose.push(&then.motion.pose, &tick.truth);
        }
        self.answer(&tick);
    }

    fn answer(&mut self, tick: &SlaveTick) {
        let quiet = self.now.saturating_since(self.last_sent) < HEARTBEAT;
        if !self.streams && tick.update.is_none() && quiet {
            return;
        }
        self.last_sent = self.now;
        self.outcome.with_news += u64::from(self.streams || tick.update.is_some());
        let port = self.slave.tool_port();
        let payload = Down {
            news: ToolNews {
                sent: self.now,
                echo: tick.stamp,
                force: self.streams.then(|| ForceCounts::nearest(port.held())),
                in_contact: tick.in_contact,
                in_j: port.energy().in_j,
                model_error: self.slave.model_error().relative(),
            },
            update: tick.update,
        };
        // an update is as long as the longest datagram, or shorter
        let bytes = match tick.update {
            Some(_) => OVERHEAD_BYTES + DATAGRAM_MAX,
            None => wire_bytes(Baseline::Tdpa),
        };
        self.down.push(self.now, bytes, payload);
    }
}
