//! A slave, a master and the two directions of a link in one struct, stepped in virtual time.
//!
//! Everything that decides anything is the live system's own core: the same slave, master, link ends and
//! emulated link. A run is a pure function of its configuration; equal ones have equal digests of
//! their event logs.

use std::time::Duration;

use mmt_client::device::DeviceProfile;
use mmt_client::end::{MasterEnd, MasterGiven};
use mmt_client::limiter::ForceLimiter;
use mmt_client::master::{Master, MasterTick};
use mmt_client::operator::Operator;
use mmt_client::operator::scripted::{Scripted, View, VisualFeedback};
use mmt_client::operator::trace::Trace;
use mmt_netem::link::LinkId;
use mmt_netem::{Direction, Link, Packet};
use mmt_server::end::{SlaveEnd, SlaveGiven};
use mmt_server::plant::PlantAnswer;
use mmt_server::slave::{Slave, SlaveTick, Substitutes};
use mmt_shared::metrics::{PoseError, Staleness};
use mmt_shared::model::geometry::Vec2;
use mmt_shared::pairing::Token;
use mmt_shared::time::{TICK, Time};
use mmt_shared::wire::DATAGRAM_MAX;
use sha2::{Digest, Sha256};

use crate::check::SessionChecks;

mod config;
mod datagram;
pub(crate) mod delayed_view;
mod delivery;
mod given;
mod measures;
mod outcome;
mod packets;
mod plant;
mod slave_clock;

pub use config::{WorldConfig, WorldError};
pub use given::Given;
pub use outcome::{Outcome, WorldTraffic};
pub use packets::{WorldPacket, WorldPackets};

use datagram::Datagram;
use delayed_view::{DelayedView, scene};
use slave_clock::SlaveClock;

/// By how much the slave's clock is ahead of the master's at the start: nothing may depend on it.
const SLAVE_EPOCH: Duration = Duration::from_secs(3600);

/// What one millisecond of the world gave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorldTick {
    /// Time since the start, by the master's clock.
    pub now: Time,
    /// The master's tick.
    pub master: MasterTick,
    /// The slave's tick; none before the first sample is played.
    pub slave: Option<SlaveTick>,
}

/// The world.
pub struct World {
    now: Time,
    slave: SlaveEnd,
    master: MasterEnd,
    operator: Operator,
    hand_force: Vec2,
    /// What the operator looks at, if it is not the local model.
    delayed_view: Option<DelayedView>,
    up: Link<Datagram>,
    down: Link<Datagram>,
    /// The delay of `down`, without jitter.
    down_delay: Duration,
    slave_clock: SlaveClock,
    staleness: Staleness,
    pose: PoseError,
    log: Sha256,
    /// What a plant of somebody else's measured, for the next tick of the slave.
    answer: Option<PlantAnswer>,
    /// Kept where somebody asks for them.
    packets: Option<Box<WorldPackets>>,
    /// They see every tick of every test, and of runs that ask for it.
    checks: Box<SessionChecks>,
    judges: bool,
}

impl World {
    /// A world at time zero with the scripted operator.
    ///
    /// # Errors
    /// When a number of the configuration is not accepted.
    pub fn try_new(config: &WorldConfig) -> Result<Self, WorldError> {
        Self::at_device(config, DeviceProfile::default())
    }

    /// The same whose hand has this device, used with the stiffness of the configuration.
    ///
    /// # Errors
    /// As [`World::try_new`].
    pub fn at_device(config: &WorldConfig, device: DeviceProfile) -> Result<Self, WorldError> {
        Self::operated(config, device, |view| {
            let scripted = Scripted::try_new(config.operator, view)?;
            Ok(Operator::Scripted(Box::new(scripted)))
        })
    }

    /// A world at time zero whose hand goes this way, whatever it feels.
    ///
    /// # Errors
    /// As [`World::try_new`].
    pub fn along(config: &WorldConfig, hand: Trace) -> Result<Self, WorldError> {
        let device = DeviceProfile::default();
        Self::operated(config, device, |_| Ok(Operator::Trace(hand)))
    }

    fn operated(
        config: &WorldConfig,
        device: DeviceProfile,
        operator: impl FnOnce(View) -> Result<Operator, WorldError>,
    ) -> Result<Self, WorldError> {
        config.commands().check()?;
        let device = device.used_with(config.stiffness_n_per_m, None)?;
        let settings = config.model_settings(device.coupling());
        let mut slave = Slave::with_settings(&config.slave(), settings)?;
        let scheme = config.slave.trigger.scheme.to_string();
        let welcome = slave.welcome(Token::new([0; 32]), &scheme, "lab");
        let limiter = ForceLimiter::try_new(device.limits())?;
        let master = Master::with_architecture(&welcome, limiter, config.architecture);
        let view = master.view();
        let operator = operator(view)?;
        slave.start_at(operator.start());
        let down_delay = config.down.delay.middle();
        let checks = SessionChecks::new(
            (Time::ZERO + down_delay, Time::ZERO + SLAVE_EPOCH),
            device.limits(),
            settings,
            config.slave(),
            slave.tool_at(),
        );
        Ok(Self {
            checks: Box::new(checks),
            judges: cfg!(test),
            now: Time::ZERO,
            slave: SlaveEnd::new(Time::ZERO + SLAVE_EPOCH, slave, config.slave_end()),
            // a session begins with the slave's welcome, which takes its time as well
            master: MasterEnd::new(Time::ZERO + down_delay, master, config.commands()),
            operator,
            hand_force: Vec2::zeros(),
            delayed_view: (config.operator.view == VisualFeedback::Delayed)
                .then(|| DelayedView::new(view)),
            up: Link::try_new(config.up.clone(), config.seed, LinkId::UP)?,
            down: Link::try_new(config.down.clone(), config.seed, LinkId::DOWN)?,
            down_delay,
            slave_clock: SlaveClock {
                ahead: SLAVE_EPOCH,
                drift_ppm: 0,
            },
            staleness: Staleness::default(),
            pose: PoseError::default(),
            log: Sha256::new(),
            answer: None,
            packets: None,
        })
    }

    /// Runs for a duration and hands every tick to `watch`.
    pub fn run(&mut self, duration: Duration, mut watch: impl FnMut(&WorldTick)) {
        let end = self.now + duration;
        while self.now < end {
            let tick = self.step();
            watch(&tick);
        }
    }

    /// One millisecond: what has arrived at the master, the master's tick, what has arrived at the slave
    /// by then, the slave's tick. On a perfect network a sample is played in the tick it was taken in,
    /// and an update is applied in the next.
    pub fn step(&mut self) -> WorldTick {
        self.step_given(Given::default())
    }

    /// The same with what somebody else does in the place of the world's own.
    pub fn step_given(&mut self, given: Given<'_>) -> WorldTick {
        self.now += TICK;
        self.deliver_down();
        let master = self.master_tick(given.hip);
        self.deliver_up();
        let slave = self.slave_tick(given.slave);
        self.log_tick(&master, slave.as_ref());
        WorldTick {
            now: self.now,
            master,
            slave,
        }
    }

    fn deliver_down(&mut self) {
        while let Some(packet) = self.next(Direction::Down) {
            // QUIC drops what does not authenticate
            if !packet.is_corrupted() {
                self.master
                    .handle_datagram(packet.due, packet.payload.bytes());
                if self.judges {
                    self.checks.came_down(packet.due, packet.payload.bytes());
                }
            }
        }
        let before = self.master.counts().newest_applied;
        self.master.update_model();
        let newest = self.master.counts().newest_applied;
        if newest != before {
            self.staleness.known(self.now, newest);
        }
    }

    fn master_tick(&mut self, hip: Option<Vec2>) -> MasterTick {
        let reading = hip.unwrap_or_else(|| self.operated_hip());
        let given = MasterGiven::held_at(reading);
        let tick = self.master.tick(self.now, &given);
        self.hand_force = tick.hand_force;
        if self.judges {
            self.checks
                .master_ticked(self.now, given, &tick, &self.master);
        }
        let mut bytes = [0; DATAGRAM_MAX];
        while let Ok(Some(length)) = self.master.poll_transmit(self.now, &mut bytes) {
            let datagram = Datagram { bytes, length };
            if self.judges {
                self.checks.up(self.now, datagram.bytes());
            }
            if let Some(packets) = &mut self.packets {
                packets.left(Direction::Up, self.now, datagram.bytes());
            }
            self.up.offer(self.now, Packet::new(length, datagram));
        }
        tick
    }

    /// Where the world's own operator has the HIP now, m.
    fn operated_hip(&mut self) -> Vec2 {
        let elapsed = self.now.saturating_since(Time::ZERO + TICK);
        let view = self.seen();
        self.operator.step(elapsed, &view, self.hand_force)
    }

    /// What the operator sees; contact is felt, not seen.
    fn seen(&mut self) -> View {
        let model = self.master().view();
        let (delayed, master) = (self.delayed_view.as_mut(), self.master.master());
        delayed.map_or(model, |delayed| {
            let seen = delayed.seen(self.now);
            View {
                pose: master.seen_by_hand(seen.pose),
                in_contact: model.in_contact,
                ..seen
            }
        })
    }

    fn deliver_up(&mut self) {
        while let Some(packet) = self.next(Direction::Up) {
            if !packet.is_corrupted() {
                let arrived = self.slave_clock.at(packet.due);
                self.slave.handle_datagram(arrived, packet.payload.bytes());
                if self.judges {
                    self.checks.came_up(arrived, packet.payload.bytes());
                }
            }
        }
    }

    fn slave_tick(&mut self, others: Substitutes<'_>) -> Option<SlaveTick> {
        let now = self.slave_clock.at(self.now);
        if others.scheme.is_some() {
            self.checks.slave.other_scheme();
        }
        let given = SlaveGiven {
            stops: false,
            plant: self.answer.take(),
        };
        let tick = self.slave.tick_with(now, &given, others);
        if self.judges {
            self.checks
                .slave_ticked(now, given, tick.as_ref(), &self.slave);
        }
        if let Some(tick) = &tick {
            if let Some(delayed) = &mut self.delayed_view {
                let scene = scene(self.slave.slave().environment(), tick.in_contact);
                delayed.show(self.now + self.down_delay, scene);
            }
            if let Some(then) = self.master().model().history().at(tick.stamp) {
                let model = then.motion.pose;
                self.pose.push(&model, &tick.truth);
            }
            if let Some(update) = &tick.update {
                self.staleness.sent(self.now, update.sequence);
            }
        }
        let mut bytes = [0; DATAGRAM_MAX];
        while let Ok(Some(length)) = self.slave.poll_transmit(now, &mut bytes) {
            let datagram = Datagram { bytes, length };
            if self.judges {
                self.checks.down(now, datagram.bytes());
            }
            if let Some(packets) = &mut self.packets {
                packets.left(Direction::Down, self.now, datagram.bytes());
            }
            self.down.offer(self.now, Packet::new(length, datagram));
        }
        tick
    }

    /// Every number that either side felt or sent goes into the log, bit by bit.
    fn log_tick(&mut self, master: &MasterTick, slave: Option<&SlaveTick>) {
        let mut number = |value: f64| self.log.update(value.to_bits().to_le_bytes());
        [master.displayed, master.hand_force].iter().for_each(|f| {
            number(f.x);
            number(f.y);
        });
        if let Some(slave) = slave {
            [slave.tool, slave.f_s, slave.f_shadow]
                .iter()
                .for_each(|v| {
                    number(v.x);
                    number(v.y);
                });
            if let Some(update) = &slave.update {
                update
                    .state
                    .params()
                    .to_array()
                    .into_iter()
                    .for_each(number);
                self.log.update(update.answers.as_nanos().to_le_bytes());
            }
        }
    }
}

/// A test's world holds what every session promises, whatever else the test is about.
#[cfg(test)]
impl Drop for World {
    fn drop(&mut self) {
        if let (Some(verdict), false) = (self.verdict(), std::thread::panicking()) {
            assert!(verdict.holds(), "{verdict}");
        }
    }
}

#[cfg(test)]
mod tests;
