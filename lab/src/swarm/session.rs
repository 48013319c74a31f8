//! One session of the swarm: two ends, the network between them, the hand, and the judges of all of it.

use std::time::Duration;

use mmt_client::commands::CommandConfig;
use mmt_client::device::DeviceProfile;
use mmt_client::end::{MasterEnd, MasterGiven};
use mmt_client::failsafe::LinkState;
use mmt_client::limiter::ForceLimiter;
use mmt_client::master::{Master, MasterTick};
use mmt_client::operator::Operator;
use mmt_client::operator::scripted::Scripted;
use mmt_server::end::{SlaveEnd, SlaveGiven, session_config};
use mmt_server::sensing::{ForceFault, SensorFaults};
use mmt_server::slave::{Memory, SlaveTick};
use mmt_shared::model::architecture::Architecture;
use mmt_shared::model::geometry::{Vec2, rotate};
use mmt_shared::pairing::Token;
use mmt_shared::rng::Substream;
use mmt_shared::time::{TICK, Time};
use mmt_shared::wire::{Claim, DATAGRAM_MAX, Hello, Label, Role, Side};

use super::faults::{Fault, Now};
use super::way::Way;
use crate::check::{SessionChecks, Verdict};
use crate::worlds::RandomWorld;
use mmt_client::device::DeviceError;
use mmt_client::operator::scripted::ScriptedConfig;
use mmt_netem::config::ConfigError;
use mmt_server::slave::SlaveError;
use mmt_shared::range::OutOfRange;

/// How the world's time, the slave's clock and the faults stand in a millisecond.
pub(super) struct Moment<'a> {
    /// The world's time, which is the master's clock.
    pub(super) now: Time,
    /// The slave's.
    pub(super) slave_now: Time,
    pub(super) faults: &'a Now,
}

/// One session.
pub(super) struct Session {
    /// None once its process has died.
    pub(super) master: Option<MasterEnd>,
    pub(super) slave: Option<SlaveEnd>,
    checks: SessionChecks,
    operator: Operator,
    began: Time,
    reading: Vec2,
    hand_force: Vec2,
    releasing: bool,
    /// Since the slave is disengaged.
    farewell_ticks: u32,
    up: Way,
    down: Way,
    /// What has arrived and waits for a process that stands.
    to_master: Vec<(Time, Vec<u8>)>,
    to_slave: Vec<(Time, Vec<u8>)>,
}

/// What the hello of a session holds besides the device.
fn hello(world: &RandomWorld, session: u64, device: &DeviceProfile) -> Hello {
    let mut draws = Substream::new(world.number, "swarm/hello", session);
    let packing = [1, 5, 10, 20].get(draws.bits() as usize % 4).copied();
    let architecture = if draws.chance(0.15) {
        Architecture::Tdpa
    } else {
        Architecture::Mmt
    };
    let (far, place) = (draws.chance(0.1), draws.uniform_in(-5.0, 5.0));
    let hip = if far {
        Vec2::new(place, draws.uniform_in(-5.0, 5.0))
    } else {
        Vec2::new(-0.45, 0.0)
    };
    let samples_per_command = packing.unwrap_or(10);
    Hello {
        token: Token::new([0; 32]),
        role: Role::Operator,
        claim: Claim::IfFree,
        coupling: device.coupling(),
        samples_per_command: if architecture.feels_tool() {
            1
        } else {
            samples_per_command
        },
        architecture,
        scene_hz: if draws.chance(0.5) { 30 } else { 0 },
        hip,
        program: Label::clipped("swarm"),
    }
}

impl Session {
    /// Session `number` from this moment on, where an earlier one left `memory`.
    pub(super) fn begin(
        world: &RandomWorld,
        number: u64,
        moment: &Moment<'_>,
        memory: Option<&Memory>,
    ) -> Result<Self, SwarmError> {
        let stiffness = world.config.stiffness_n_per_m;
        let device = DeviceProfile::default().used_with(stiffness, None)?;
        let hello = hello(world, number, &device);
        let config = &world.config.slave;
        let slave = SlaveEnd::of_session(moment.slave_now, config, &hello, memory)?;
        let welcome = slave.slave().welcome(Token::new([0; 32]), "any", "swarm");
        let checks = SessionChecks::new(
            (moment.now, moment.slave_now),
            device.limits(),
            welcome.settings,
            session_config(config, &hello),
            welcome.tool,
        );
        let limiter = ForceLimiter::try_new(device.limits())?;
        let master = Master::with_architecture(&welcome, limiter, hello.architecture);
        let view = master.view();
        let scripted = Scripted::try_new(hand(world, number), view)?;
        let operator = Operator::Scripted(Box::new(scripted)).led_from(welcome.tool, &view);
        let commands = CommandConfig {
            samples_per_command: hello.samples_per_command,
            ..CommandConfig::default()
        };
        let seed = world.number.wrapping_mul(1000).wrapping_add(number);
        Ok(Self {
            master: Some(MasterEnd::new(
                moment.now,
                master,
                commands.for_architecture(hello.architecture),
            )),
            slave: Some(slave),
            checks,
            reading: operator.start(),
            operator,
            began: moment.now + TICK,
            hand_force: Vec2::zeros(),
            releasing: false,
            farewell_ticks: 0,
            up: Way::try_new(Side::Master, &world.config.up, seed)?,
            down: Way::try_new(Side::Slave, &world.config.down, seed)?,
            to_master: Vec::new(),
            to_slave: Vec::new(),
        })
    }

    /// What was found so far.
    pub(super) fn verdict(&self) -> Verdict {
        self.checks.verdict()
    }

    /// The network's part of a millisecond. What waits for a dead process is gone.
    pub(super) fn deliver(&mut self, moment: &Moment<'_>) {
        let Moment {
            now,
            slave_now,
            faults,
        } = *moment;
        let both = &mut self.checks.both;
        for (at, bytes) in self.down.arrivals(now, faults, &mut both.down) {
            self.to_master.push((at, bytes));
        }
        for (at, bytes) in self.up.arrivals(now, faults, &mut both.up) {
            // by the slave's clock
            let at = slave_now - now.saturating_since(at);
            self.to_slave.push((at, bytes));
        }
    }

    /// A tick of the master; whether the session is over and no force is left on the hand.
    pub(super) fn tick_master(&mut self, moment: &Moment<'_>) -> Option<(MasterTick, bool)> {
        let Moment { now, faults, .. } = *moment;
        self.handle_farewell();
        let end = self.master.as_mut()?;
        for (at, bytes) in self.to_master.drain(..) {
            end.handle_datagram(at, &bytes);
            self.checks.came_down(at, &bytes);
        }
        let view = end.update_model();
        let stops = faults.has(Fault::MasterStops);
        if stops || end.channel().other().stopped {
            self.operator.stand(TICK);
        } else if !faults.has(Fault::ReadingFrozen) {
            let elapsed = now.saturating_since(self.began);
            self.reading = self.operator.step(elapsed, &view, self.hand_force);
        }
        let over = self.releasing;
        let given = MasterGiven {
            reading: disturbed(self.reading, faults),
            engaged: !faults.has(Fault::HandLetsGo),
            releases: over,
            stops,
        };
        let done = end.tick(now, &given);
        self.hand_force = done.hand_force;
        self.checks.master_ticked(now, given, &done, end);
        let mut out = [0; DATAGRAM_MAX];
        while let Ok(Some(length)) = end.poll_transmit(now, &mut out) {
            let bytes = out.get(..length).unwrap_or_default();
            self.checks.up(now, bytes);
            self.up.offer(now, bytes);
        }
        let broken = end.master().model().not_finite() > 0;
        let lost = done.link == LinkState::Released;
        self.releasing |= lost || broken || faults.has(Fault::SessionEnds);
        let at_rest = over && end.master().limiter().at_rest();
        Some((done, at_rest))
    }

    /// The session of a slave that is disengaged is over: its master receives a farewell, and its loop ends.
    fn handle_farewell(&mut self) {
        self.releasing |= self.farewell_ticks > 0;
    }

    /// A tick of the slave.
    pub(super) fn tick_slave(&mut self, moment: &Moment<'_>) -> Option<SlaveTick> {
        let Moment {
            now,
            slave_now,
            faults,
        } = *moment;
        let end = self.slave.as_mut()?;
        for (at, bytes) in self.to_slave.drain(..) {
            end.handle_datagram(at, &bytes);
            self.checks.came_up(at, &bytes);
        }
        self.farewell_ticks += u32::from(end.is_disengaged());
        if self.farewell_ticks > FAREWELL_TICKS {
            return None;
        }
        let sensors = sensor_faults(faults);
        end.slave_mut().set_sensor_faults(sensors);
        self.checks.slave.set_sensor_broken(sensors.force.is_some());
        let given = SlaveGiven {
            stops: faults.has(Fault::SlaveStops),
            plant: None,
        };
        let done = end.tick(slave_now, &given);
        self.checks
            .slave_ticked(slave_now, given, done.as_ref(), end);
        let mut out = [0; DATAGRAM_MAX];
        while let Ok(Some(length)) = end.poll_transmit(slave_now, &mut out) {
            let bytes = out.get(..length).unwrap_or_default();
            self.checks.down(slave_now, bytes);
            self.down.offer(now, bytes);
        }
        done
    }
}

/// What of the slave's sensors is broken.
fn sensor_faults(faults: &Now) -> SensorFaults {
    let off = faults.strength(Fault::ForceOff);
    let off = off.map(|strength| {
        // the direction is any, and goes with the strength
        ForceFault::Off(rotate(1e3 * strength, Vec2::x()) * (strength * FORCE_OFF_N))
    });
    let frozen = faults.has(Fault::ForceFrozen);
    SensorFaults {
        force: frozen.then_some(ForceFault::Frozen).or(off),
        no_images: faults.has(Fault::NoImages),
    }
}

/// What a device that is broken gives.
fn disturbed(reading: Vec2, faults: &Now) -> Vec2 {
    if let Some(strength) = faults.strength(Fault::ReadingFar) {
        return reading + Vec2::new(200.0 * strength * strength, -100.0 * strength);
    }
    if let Some(strength) = faults.strength(Fault::ReadingNone) {
        let none = if strength < 0.5 {
            f64::NAN
        } else {
            f64::INFINITY
        };
        return Vec2::new(none, reading.y);
    }
    reading
}

/// A force sensor is off by up to this, N.
const FORCE_OFF_N: f64 = 30.0;
/// The loop of a slave that is disengaged ends no later than this.
const FAREWELL_TICKS: u32 = 50;
/// From the end of a session to the beginning of the next.
pub(super) const BETWEEN: Duration = Duration::from_millis(300);

/// Why a run could not be made: the generator is wrong.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SwarmError {
    /// The slave's numbers are not accepted.
    #[error("slave: {0}")]
    Slave(#[from] SlaveError),
    /// The device's numbers are not accepted.
    #[error("device: {0}")]
    Device(#[from] DeviceError),
    /// A number is out of its range.
    #[error(transparent)]
    Number(#[from] OutOfRange),
    /// The network is none.
    #[error("network: {0}")]
    Network(#[from] ConfigError),
}

/// The hand of session `session`: another one each time.
pub(super) fn hand(world: &RandomWorld, session: u64) -> ScriptedConfig {
    ScriptedConfig {
        seed: world.number.wrapping_mul(1000).wrapping_add(session),
        ..world.config.operator
    }
}
