//! The slave's core of a bilateral architecture: the hand's motion in, the measured force out.
//!
//! Play-out, environment and sensing are those of the slave of model-mediated teleoperation. The tool goes to the
//! played HIP (position–force), as far along it as the energy allows (TDPA), or where the waves lead the arm. A force
//! that may be the sensor's noise goes out as none. Pure: time is an argument, the seed comes with the configuration. It must
//! never use the truth for anything but reports.

use mmt_shared::metrics::ForceMetrics;
use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::{Pose, Vec2};
use mmt_shared::model::sample::ForceCounts;
use mmt_shared::passivity::PortEnergy;
use mmt_shared::time::{TICK_S, Time};

use mmt_server::contact::ContactStage;
use mmt_server::environment::{Environment, EnvironmentConfig};
use mmt_server::playout::{Played, PlayoutBuffer};
use mmt_server::sensing::Sensing;
use mmt_server::slave::{SlaveConfig, SlaveError};
use mmt_server::tool::port::ToolPort;

use super::arm::Arm;
use super::deadband::PerceptualDeadband;
use super::message::{ToMaster, ToSlave};
use super::wave::{WaveImpedance, WaveReceiver, WaveSender, WaveSum};
use super::{Baseline, Tuning};

/// What one tick of the slave gave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BilateralSlaveTick {
    /// Stamp of the HIP sample that is played, by the master's clock.
    pub stamp: Time,
    /// The tool, m.
    pub tool: Vec2,
    /// f_s as measured, N, on the object.
    pub f_s: Vec2,
    /// Contact force as it is, N: for reports.
    pub true_force: Vec2,
    /// Whether the slave is in contact.
    pub in_contact: bool,
    /// The object's true pose.
    pub truth: Pose,
    /// What goes to the master.
    pub message: Option<ToMaster>,
}

/// The slave between the link and the object.
pub struct BilateralSlave {
    baseline: Baseline,
    playout: PlayoutBuffer,
    contact: ContactStage,
    tool: Vec2,
    port: ToolPort,
    /// All the work that the tool did, J.
    put_out_j: f64,
    deadband: PerceptualDeadband,
    arm: Arm,
    waves_in: WaveReceiver,
    waves_out: WaveSender,
    force: ForceMetrics,
}

impl BilateralSlave {
    /// A slave whose tool touches with `coupling` and starts at `hip` (m). `smoothing_ticks` is the waves' smoothing time.
    ///
    /// # Errors
    /// When the configuration's numbers are not accepted.
    pub fn try_new(
        config: &SlaveConfig,
        coupling: Coupling,
        (baseline, tuning): (Baseline, &Tuning),
        smoothing_ticks: u16,
        hip: Vec2,
    ) -> Result<Self, SlaveError> {
        let mut playout = PlayoutBuffer::try_new(config.playout)?;
        playout.start_at(hip);
        let environment = EnvironmentConfig {
            coupling,
            ..config.environment
        };
        let environment = Environment::of_scene(environment, &config.scene)?;
        let sensing = Sensing::try_new(config.sensing, config.seed)?;
        let speed_max_m_per_s = config.playout.speed_max_m_per_s;
        Ok(Self {
            baseline,
            playout,
            contact: ContactStage::new(environment, sensing, config.conditioner(&coupling)),
            tool: hip,
            port: ToolPort::new(config.sensing.force_noise_n, speed_max_m_per_s),
            put_out_j: 0.0,
            deadband: PerceptualDeadband::new(tuning.delta),
            arm: Arm::new(
                coupling.stiffness_n_per_m,
                speed_max_m_per_s,
                WaveImpedance::new(tuning.wave_impedance_ns_per_m),
            ),
            waves_in: WaveReceiver::new(smoothing_ticks),
            waves_out: WaveSender::default(),
            force: ForceMetrics::default(),
        })
    }

    /// The real object: the truth, for reports and pictures only.
    #[must_use]
    pub fn environment(&self) -> &Environment {
        self.contact.environment()
    }

    /// The play-out buffer.
    #[must_use]
    pub fn playout(&self) -> &PlayoutBuffer {
        &self.playout
    }

    /// Force metrics over all samples whose f_m is known.
    #[must_use]
    pub fn force(&self) -> &ForceMetrics {
        &self.force
    }

    /// Energy that passed the tool's port, J.
    #[must_use]
    pub fn port(&self) -> PortEnergy {
        self.port.energy()
    }

    /// Takes in a message that arrived at `now`.
    pub fn receive(&mut self, now: Time, message: &ToSlave) {
        self.playout.push(now, &message.sample);
        self.port.receive(message.in_j);
        self.waves_in.receive(message.wave);
    }

    /// One sample period. None before the first HIP sample is due.
    pub fn tick(&mut self, now: Time) -> Option<BilateralSlaveTick> {
        let played = self.playout.advance(now)?;
        let (way, wave) = self.way(&played);
        self.tool += way;
        self.put_out_j += self.port.moved(way);
        let contact = self.contact.step(now, 1, self.tool, way / TICK_S);
        if let Some(f_m) = played.force {
            self.force.push(contact.force, f_m);
        }
        self.port.measured(contact.force);
        Some(BilateralSlaveTick {
            stamp: played.stamp,
            tool: self.tool,
            f_s: contact.force,
            true_force: contact.true_force,
            in_contact: contact.in_contact,
            truth: contact.truth,
            message: self.message(now, wave),
        })
    }

    /// The tool's way in this tick, m, and all waves sent.
    fn way(&mut self, played: &Played) -> (Vec2, WaveSum) {
        match self.baseline {
            Baseline::PositionForce | Baseline::DampedPositionForce | Baseline::DeadbandForce => {
                (played.hip - self.tool, WaveSum::default())
            }
            Baseline::Tdpa | Baseline::TdpaDeadband => {
                let way = self.port.allowed(played.hip - self.tool, TICK_S);
                (way, WaveSum::default())
            }
            Baseline::Waves => {
                let u = self.waves_in.take();
                let held = self.port.held();
                let (way, w) = self.arm.step(u, held);
                let given_j = self.put_out_j + held.dot(&way);
                let taken_in_j = self.waves_in.energy_j() - given_j;
                (way, self.waves_out.send(w, taken_in_j))
            }
        }
    }

    fn message(&mut self, now: Time, wave: WaveSum) -> Option<ToMaster> {
        let sends = !self.baseline.has_deadband() || self.deadband.offer(now, self.port.held());
        sends.then(|| ToMaster {
            sent: now,
            force: ForceCounts::nearest(self.port.held()),
            in_j: self.port.energy().in_j,
            wave,
        })
    }
}
