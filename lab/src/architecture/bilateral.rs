//! A bilateral architecture in virtual time: its two cores, the operator, the device and the two directions of a link.
//!
//! Operator, hand, device limits, play-out, environment, sensing and emulated link are those of `World`; only what
//! crosses the network differs. A sample goes out every tick in a packet of its own, since a force that is waited for
//! must not wait for nine others.

use std::time::Duration;

use crate::baselines::master::BilateralMaster;
use crate::baselines::message::{ToMaster, ToSlave, wire_bytes};
use crate::baselines::slave::{BilateralSlave, BilateralSlaveTick};
use crate::baselines::{Baseline, Tuning};
use mmt_client::device::DeviceProfile;
use mmt_client::limiter::ForceLimiter;
use mmt_client::master::PortObserver;
use mmt_client::operator::Operator;
use mmt_client::operator::scripted::{Phase, Scripted, VisualFeedback};
use mmt_netem::config::{LinkConfig, Loss};
use mmt_netem::counters::Tally;
use mmt_netem::link::LinkId;
use mmt_netem::{Link, Packet};
use mmt_server::environment::Environment;
use mmt_server::slave::SlaveError;
use mmt_shared::metrics::{ContactBreaks, ForcePeak, ForceSummary};
use mmt_shared::model::geometry::Vec2;
use mmt_shared::time::{TICK, Time};

use super::aligned::AlignedError;
use super::felt::FeltMasses;
use crate::world::delayed_view::{DelayedView, scene};
use crate::world::{WorldConfig, WorldError};

/// Least smoothing of waves on a path with jitter or loss, ticks: several packets that are lost in a row.
const SMOOTHING_TICKS: u16 = 20;

/// What a run came to.
#[derive(Clone, Debug, Default)]
pub struct BilateralOutcome {
    /// Breaks of contact at the tool: the hand is in contact with nothing but a force.
    pub breaks: ContactBreaks,
    /// Force on the hand.
    pub on_hand: ForcePeak,
    /// What the hand and the tool would take the object's mass for.
    pub felt: FeltMasses,
    /// The hand's force against the tool's of a way ago.
    pub(super) aligned: AlignedError,
    /// The passivity observer at the hand.
    pub hand_port: PortObserver,
    /// The same at the tool: energy that the tool put into the object.
    pub tool_port: PortObserver,
    /// The least of what the hand had put in less what the tool had put out, J: below 0 the network made energy.
    pub network_min_j: f64,
}

/// The world of a bilateral architecture.
pub struct Bilateral {
    now: Time,
    bytes: usize,
    master: BilateralMaster,
    /// The slave.
    pub(super) slave: BilateralSlave,
    /// The operator.
    pub(super) operator: Operator,
    /// The force on the hand now, N.
    pub(super) hand_force: Vec2,
    up: Link<ToSlave>,
    down: Link<ToMaster>,
    delayed_view: DelayedView,
    view_delay: Duration,
    /// From a tick of the tool's to the tick in which the hand has its force: what is sent in a tick is there in the
    /// next at the soonest.
    way_down: Duration,
    /// What the run has come to so far.
    pub(super) outcome: BilateralOutcome,
}

impl Bilateral {
    /// A world at time zero with the scripted operator.
    ///
    /// There is no local model to look at: [`VisualFeedback::Delayed`] is what arrives, at the link's delay and without loss
    /// or jitter; [`VisualFeedback::Model`] is the scene as it is, which no operator at a distance could see.
    ///
    /// # Errors
    /// When a number of the configuration is not accepted.
    pub fn try_new(
        config: &WorldConfig,
        (baseline, tuning): (Baseline, &Tuning),
        visual_feedback: VisualFeedback,
    ) -> Result<Self, WorldError> {
        let device = DeviceProfile::default().used_with(config.stiffness_n_per_m, None)?;
        let smoothing_up = smoothing_ticks(&config.up);
        let mut slave_config = config.slave.clone();
        // from nothing up, as jitter asks for; where there is none, nothing
        slave_config.playout.delay_ms = 0.0;
        if smoothing_up == 1 {
            slave_config.playout.delay_max_ms = 0.0;
        }
        let environment =
            Environment::try_new(config.slave.environment).map_err(SlaveError::from)?;
        let view = scene(&environment, false);
        let scripted = Scripted::try_new(config.operator, view)?;
        let operator = Operator::Scripted(Box::new(scripted));
        let down_delay = config.down.delay.middle();
        Ok(Self {
            now: Time::ZERO,
            bytes: wire_bytes(baseline),
            master: BilateralMaster::new(
                (baseline, tuning),
                smoothing_ticks(&config.down),
                ForceLimiter::try_new(device.limits())?,
            ),
            slave: BilateralSlave::try_new(
                &slave_config,
                device.coupling(),
                (baseline, tuning),
                smoothing_up,
                operator.start(),
            )?,
            operator,
            hand_force: Vec2::zeros(),
            up: Link::try_new(config.up.clone(), config.seed, LinkId::UP)?,
            down: Link::try_new(config.down.clone(), config.seed, LinkId::DOWN)?,
            delayed_view: DelayedView::new(view),
            view_delay: match visual_feedback {
                VisualFeedback::Delayed => down_delay,
                VisualFeedback::Model => Duration::ZERO,
            },
            way_down: down_delay.max(TICK),
            outcome: BilateralOutcome::default(),
        })
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

    /// Runs for a duration.
    pub fn run(&mut self, duration: Duration) {
        let end = self.now + duration;
        while self.now < end {
            self.step();
        }
    }

    /// One millisecond with the scripted operator, in the order of [`crate::world::World::step`].
    pub fn step(&mut self) -> Option<BilateralSlaveTick> {
        let elapsed = self.now.saturating_since(Time::ZERO);
        let view = self.delayed_view.seen(self.now + TICK);
        let hip = self.operator.step(elapsed, &view, self.hand_force);
        let pushes = pushes(&self.operator) && view.in_contact;
        self.step_at(hip, pushes)
    }

    /// One millisecond with the hand at `hip` (m), whoever moves it; `pushes`: whether it pushes the object.
    pub fn step_at(&mut self, hip: Vec2, pushes: bool) -> Option<BilateralSlaveTick> {
        self.now += TICK;
        while let Some(packet) = self.down.poll_delivered(self.now) {
            if !packet.is_corrupted() {
                self.master.receive(&packet.payload);
            }
        }
        let tick = self.master.tick(self.now, hip);
        self.hand_force = tick.hand_force;
        let outcome = &mut self.outcome;
        outcome.on_hand.push(tick.hand_force);
        outcome.aligned.push_felt(self.now, tick.displayed);
        outcome.hand_port.push(hip, tick.hand_force);
        outcome
            .felt
            .push_hand(self.now, hip, -tick.hand_force, pushes);
        self.up
            .offer(self.now, Packet::new(self.bytes, tick.message));
        while let Some(packet) = self.up.poll_delivered(self.now) {
            if !packet.is_corrupted() {
                self.slave.receive(packet.due, &packet.payload);
            }
        }
        self.slave_tick()
    }

    fn slave_tick(&mut self) -> Option<BilateralSlaveTick> {
        let tick = self.slave.tick(self.now)?;
        if let Some(message) = tick.message {
            self.down.offer(self.now, Packet::new(self.bytes, message));
        }
        let outcome = &mut self.outcome;
        outcome.breaks.push(tick.in_contact);
        outcome
            .aligned
            .push_met(self.now + self.way_down, tick.true_force);
        outcome
            .felt
            .push_tool(tick.stamp, tick.tool, tick.true_force, tick.in_contact);
        outcome.tool_port.push(tick.tool, -tick.true_force);
        let made_j = outcome.hand_port.energy_j() - outcome.tool_port.energy_j();
        outcome.network_min_j = outcome.network_min_j.min(made_j);
        let scene = scene(self.slave.environment(), tick.in_contact);
        self.delayed_view.show(self.now + self.view_delay, scene);
        Some(tick)
    }
}

/// Whether an operator is in the middle of a push.
pub(super) fn pushes(operator: &Operator) -> bool {
    match operator {
        Operator::Scripted(scripted) => scripted.phase() == Phase::Push,
        Operator::Trace(_) | Operator::Person(_) => true,
    }
}

/// The waves' smoothing over a link: none where every packet takes the same time and arrives.
fn smoothing_ticks(link: &LinkConfig) -> u16 {
    let jitter = link.delay.jitter;
    if jitter == Duration::ZERO && link.loss == Loss::None && link.outages.is_empty() {
        return 1;
    }
    let jitter_ms = u16::try_from(2 * jitter.as_millis()).unwrap_or(u16::MAX);
    jitter_ms.max(SMOOTHING_TICKS)
}
