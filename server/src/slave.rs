//! The slave's core: one tick from the HIP sample to the update.
//!
//! Play-out, environment, sensing, pose and parameters, shadow, trigger. Pure: the time is an argument,
//! the seed comes with the configuration, and what it returns is all that it does. The shadow is the
//! master's own local model, driven by the same samples, with every update applied when it is sent.

use mmt_shared::contact::Coupling;
use mmt_shared::geometry::{BoxFootprint, Pose, Twist, Vec2};
use mmt_shared::local_model::LocalModel;
use mmt_shared::metrics::ForceMetrics;
use mmt_shared::params::{ModelParams, ModelState, ParamsError};
use mmt_shared::settings::{Mode, ModelSettings};
use mmt_shared::time::{TICK_S, Time};
use mmt_shared::wire::{Cause, HipSample, Scene, Update};
use serde::{Deserialize, Serialize};

use crate::environment::{Environment, EnvironmentConfig, EnvironmentError};
use crate::estimator::{Estimate, Estimator, EstimatorConfig, Measured};
use crate::playout::{PlayoutBuffer, PlayoutConfig};
use crate::pose_observer::{ObserverConfig, PoseObserver};
use crate::sensing::{Sensing, SensingConfig};
use crate::trigger::{ContactDetector, Trigger, TriggerConfig, TriggerInput};

/// What the local model starts from before anything is known of the object.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StartModel {
    /// m, kg.
    pub mass_kg: f64,
    /// b, N s/m.
    pub damping_ns_per_m: f64,
    /// c, N.
    pub friction_n: f64,
    /// Side l of the model, m.
    pub side_m: f64,
}

impl Default for StartModel {
    /// Wrong on purpose, so that the estimator has something to do; the side is the paper's (IV-A).
    fn default() -> Self {
        Self { mass_kg: 0.4, damping_ns_per_m: 0.0, friction_n: 1.0, side_m: 0.40 }
    }
}

/// Everything that a slave is made of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SlaveConfig {
    /// Seed of the sensors' noise.
    pub seed: u64,
    /// The bundle of choices: paper or recommended.
    pub mode: Mode,
    /// The real object and its ground.
    pub environment: EnvironmentConfig,
    /// Noise, vision.
    pub sensing: SensingConfig,
    /// Buffer for the master's samples.
    pub playout: PlayoutConfig,
    /// When updates are sent.
    pub trigger: TriggerConfig,
    /// What the local model starts from.
    pub start: StartModel,
}

impl SlaveConfig {
    /// The default of a mode: the default scenario, with the mode's update scheme.
    #[must_use]
    pub fn of_mode(mode: Mode) -> Self {
        Self {
            seed: 1,
            mode,
            environment: EnvironmentConfig::default(),
            sensing: SensingConfig::default(),
            playout: PlayoutConfig::default(),
            trigger: TriggerConfig::of_mode(mode),
            start: StartModel::default(),
        }
    }
}

impl Default for SlaveConfig {
    fn default() -> Self {
        Self::of_mode(Mode::Recommended)
    }
}

/// Why a slave could not be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SlaveError {
    /// The environment's numbers are wrong.
    #[error("environment: {0}")]
    Environment(#[from] EnvironmentError),
    /// The start model's numbers are not accepted.
    #[error("start model: {0}")]
    Start(#[from] ParamsError),
}

/// What one tick of the slave gave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlaveTick {
    /// Stamp of the HIP sample, by the master's clock.
    pub stamp: Time,
    /// The tool, m.
    pub tool: Vec2,
    /// f_s as measured, N, on the object.
    pub f_s: Vec2,
    /// The shadow's force, N: f_m as the trigger sees it.
    pub f_shadow: Vec2,
    /// f_m as the master rendered it for this sample, N; none if the sample was lost.
    pub f_m: Option<Vec2>,
    /// Whether the slave is in contact.
    pub in_contact: bool,
    /// The object's true pose.
    pub truth: Pose,
    /// What goes to the master.
    pub update: Option<Update>,
}

/// The slave between the link and the object.
pub struct Slave {
    settings: ModelSettings,
    start: StartModel,
    playout: PlayoutBuffer,
    environment: Environment,
    sensing: Sensing,
    contact: ContactDetector,
    observer: PoseObserver,
    estimator: Estimator,
    shadow: LocalModel,
    trigger: Trigger,
    tool: Option<Vec2>,
    /// The last parameters that were accepted.
    params: ModelParams,
    refused_estimates: u64,
    sequence: u32,
    force: ForceMetrics,
    last: Option<SlaveTick>,
}

impl Slave {
    /// A slave for a master whose device renders `coupling`.
    ///
    /// # Errors
    /// When the configuration's numbers are not accepted.
    pub fn try_new(config: &SlaveConfig, coupling: Coupling) -> Result<Self, SlaveError> {
        Self::with_settings(config, config.mode.model_settings(coupling))
    }

    /// A slave whose local model is run by other settings than its mode's.
    ///
    /// # Errors
    /// As [`Slave::try_new`].
    pub fn with_settings(config: &SlaveConfig, settings: ModelSettings) -> Result<Self, SlaveError> {
        let coupling = settings.coupling;
        let environment =
            Environment::try_new(EnvironmentConfig { coupling, ..config.environment })?;
        let StartModel { mass_kg: m, damping_ns_per_m: b, friction_n: c, side_m } = config.start;
        let params = ModelParams::of_square(m, b, c, side_m, &coupling)?;
        let footprint = BoxFootprint::square(side_m);
        // Vision has looked at the resting box for a while before the session: its noise has averaged out.
        let pose = environment.pose();
        let start = ModelState::try_new(params, footprint, pose, Twist::default())?;
        let learn = config.mode == Mode::Recommended;
        let sensing = config.sensing;
        let observer = ObserverConfig {
            coupling,
            force_noise_n: sensing.force_noise_n,
            vision_noise_m: sensing.vision_noise_m,
            vision_noise_rad: sensing.vision_noise_rad,
            learn,
        };
        Ok(Self {
            settings,
            start: config.start,
            playout: PlayoutBuffer::new(config.playout),
            environment,
            sensing: Sensing::new(sensing, config.seed),
            contact: ContactDetector::new(config.trigger.contact),
            observer: PoseObserver::new(observer, pose, footprint),
            estimator: Estimator::new(EstimatorConfig::of_mode(config.mode, coupling), m, b, c),
            shadow: LocalModel::new(settings, start),
            trigger: Trigger::new(config.trigger),
            tool: None,
            params,
            refused_estimates: 0,
            sequence: 0,
            force: ForceMetrics::default(),
            last: None,
        })
    }

    /// How both sides run the local model.
    #[must_use]
    pub fn settings(&self) -> &ModelSettings {
        &self.settings
    }

    /// The state that the master starts from.
    #[must_use]
    pub fn state(&self) -> &ModelState {
        self.shadow.state()
    }

    /// The real object. What it says is the truth: for reports, never for the estimate.
    #[must_use]
    pub fn environment(&self) -> &Environment {
        &self.environment
    }

    /// Changes the real object in mid-run.
    pub fn environment_mut(&mut self) -> &mut Environment {
        &mut self.environment
    }

    /// What the estimator found so far.
    #[must_use]
    pub fn estimate(&self) -> Estimate {
        self.estimator.estimate()
    }

    /// Estimates whose numbers were not accepted as parameters.
    #[must_use]
    pub fn refused_estimates(&self) -> u64 {
        self.refused_estimates
    }

    /// The play-out buffer.
    #[must_use]
    pub fn playout(&self) -> &PlayoutBuffer {
        &self.playout
    }

    /// The shadow of the master's model.
    #[must_use]
    pub fn shadow(&self) -> &LocalModel {
        &self.shadow
    }

    /// The pose as the slave sees it.
    #[must_use]
    pub fn observer(&self) -> &PoseObserver {
        &self.observer
    }

    /// Force metrics over all samples whose f_m is known.
    #[must_use]
    pub fn force(&self) -> &ForceMetrics {
        &self.force
    }

    /// Takes in a HIP sample that arrived at `now`.
    pub fn handle_sample(&mut self, now: Time, sample: &HipSample) {
        self.playout.push(now, sample);
    }

    /// One sample period. None before the first HIP sample is due.
    pub fn tick(&mut self, now: Time) -> Option<SlaveTick> {
        let played = self.playout.advance(now)?;
        let tool = played.hip;
        let tool_velocity = self.tool.map_or(Vec2::zeros(), |before| (tool - before) / TICK_S);
        self.tool = Some(tool);
        let truth = self.environment.pose();
        let contact = self.environment.step(tool, tool_velocity);
        let sensed = self.sensing.measure(now, tool, contact.force, self.environment.pose());
        let in_contact = self.contact.step(sensed.force.norm());
        self.observer.step(now, sensed.tool, sensed.force, in_contact);
        while let Some(vision) = self.sensing.poll_vision(now) {
            self.observer.see(&vision);
        }
        self.estimate_from(sensed.tool, sensed.force);
        let rendered = self.shadow.step(played.stamp, tool);
        if let Some(f_m) = played.force {
            self.force.push(sensed.force, f_m);
        }
        let mut tick = SlaveTick {
            stamp: played.stamp,
            tool,
            f_s: sensed.force,
            f_shadow: rendered.force,
            f_m: played.force,
            in_contact,
            truth,
            update: None,
        };
        tick.update = self.decide(now, &tick);
        self.last = Some(tick);
        Some(tick)
    }

    fn estimate_from(&mut self, tool: Vec2, force: Vec2) {
        let normal = self.observer.touching().map(|touching| touching.inward);
        self.estimator.step(&Measured { tool, force, normal });
        let Estimate { m, b, c, .. } = self.estimator.estimate();
        // The paper's model keeps the side it was given; otherwise the learned faces say how wide it is.
        let side = match self.settings.correction {
            mmt_shared::settings::PoseCorrection::Snap => self.start.side_m,
            mmt_shared::settings::PoseCorrection::MatchedStamps => {
                self.observer.footprint().mean_side()
            }
        };
        match ModelParams::of_square(m, b, c, side, &self.settings.coupling) {
            Ok(params) => self.params = params,
            Err(_) => self.refused_estimates += 1,
        }
    }
}
