//! The slave's core: one tick from the HIP sample to the update.
//!
//! Stage by stage: play-out, tool, contact, pose and parameters, shadow, trigger, update. Pure: the time is an
//! argument, the seed comes with the configuration, and what it returns is all that it does.

use std::time::Duration;

use mmt_shared::metrics::ForceMetrics;
use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::{Pose, Twist, Vec2};
use mmt_shared::model::params::ModelState;
use mmt_shared::model::sample::ForceCounts;
use mmt_shared::model::settings::ModelSettings;
use mmt_shared::model::tool::{HandPort, Scene, Tool};
use mmt_shared::model::update::Update;
use mmt_shared::pairing::Token;
use mmt_shared::report::TrueForce;
use mmt_shared::time::Time;
use mmt_shared::wire::{Label, Welcome};

use crate::contact::ContactStage;
use crate::environment::{Environment, EnvironmentConfig};
use crate::estimator::Estimate;
use crate::playout::{PlayoutBuffer, PlayoutConfig};
use crate::pose_observer::PoseObserver;
use crate::shadow::Shadow;
use crate::tool::ToolDrive;
use crate::tool::compliance::Compliance;
use crate::tool::energy::ToolEnergy;
use crate::tool::force::ToolForce;
use crate::tool::port::ToolPort;
use crate::trigger::{Scheme, Trigger};

mod config;
mod force_errors;
mod linked;
mod memory;
mod object;
mod plant;
mod reference;
mod tick;
mod update_builder;

pub use config::{SlaveConfig, SlaveError, StartModel};
pub use memory::Memory;
pub use tick::{OtherEstimator, OtherScheme, Substitutes};

use force_errors::ForceErrors;
use object::ObjectEstimate;
use reference::ForceReference;
use update_builder::UpdateBuilder;

/// What one tick of the slave gave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlaveTick {
    /// Stamp of the HIP sample, by the master's clock.
    pub stamp: Time,
    /// The tool, m.
    pub tool: Vec2,
    /// f_s as measured, N, on the object.
    pub f_s: Vec2,
    /// Contact force as it is, N: for reports.
    pub true_force: Vec2,
    /// The shadow's force, N: f_m as the trigger sees it.
    pub f_shadow: Vec2,
    /// f_m as the master rendered it for this sample, N; none if the sample was lost or the tool is held back from it.
    pub f_m: Option<Vec2>,
    /// Whether the slave is in contact.
    pub in_contact: bool,
    /// The object's true pose.
    pub truth: Pose,
    /// What goes to the master.
    pub update: Option<Update>,
}

/// The slave between the link and the object: its stages in the order of a tick.
pub struct Slave {
    settings: ModelSettings,
    playout: PlayoutBuffer,
    tool: ToolDrive,
    compliance: Compliance,
    contact: ContactStage,
    object: ObjectEstimate,
    shadow: Shadow,
    reference: ForceReference,
    trigger: Trigger,
    updates: UpdateBuilder,
    /// The state that the master starts from.
    start: ModelState,
    /// Where the tool is, m.
    tool_at: Vec2,
    errors: ForceErrors,
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
    pub fn with_settings(
        config: &SlaveConfig,
        settings: ModelSettings,
    ) -> Result<Self, SlaveError> {
        config.plant.check()?;
        config.trigger.check()?;
        config.conditioning.check()?;
        let coupling = settings.checked().map_err(SlaveError::Settings)?.coupling;
        let environment = EnvironmentConfig {
            coupling,
            ..config.environment
        };
        let environment = Environment::of_scene(environment, &config.scene)?;
        let pose = environment.pose();
        let object = ObjectEstimate::try_new(
            config,
            coupling,
            pose,
            plant::sizes_seen(config, &environment),
        )?;
        let footprint = object.observer.footprint();
        let start =
            ModelState::try_new(object.params, footprint, pose, Twist::default(), &coupling)?;
        let noise_n = config.sensing.force_noise_n;
        let limit = ToolForce::try_new(config.tool_force_max_n, coupling)?;
        let speed_max_m_per_s = (config.playout.speed_max_m_per_s).min(limit.approach_speed()?);
        let playout = PlayoutConfig {
            speed_max_m_per_s,
            ..config.playout
        };
        let energy = ToolEnergy::try_new(
            config.tool_energy,
            config.tool_force_max_n,
            coupling,
            speed_max_m_per_s,
        )?;
        let port = ToolPort::new(noise_n, speed_max_m_per_s);
        let plant = plant::of_config(config, environment, coupling, speed_max_m_per_s)?;
        let timer_carries_pose = config.trigger.timer_carries_pose;
        let compliance = Compliance::try_new(config.tool_compliance)?;
        Ok(Self {
            settings,
            playout: PlayoutBuffer::try_new(playout)?,
            tool: ToolDrive::new(
                port,
                limit,
                energy,
                playout.limits(),
                config.playout.reach_m,
            ),
            compliance: if config.plant.link {
                compliance.of_plant()
            } else {
                compliance
            },
            contact: ContactStage::at(plant, config.conditioner(&coupling)),
            object,
            shadow: Shadow::new(settings, start, config.tool_force_max_n),
            reference: ForceReference::new(config.trigger_reference),
            trigger: Trigger::new(config.trigger),
            updates: UpdateBuilder::new(settings.correction, timer_carries_pose),
            start,
            tool_at: Vec2::zeros(),
            errors: ForceErrors::default(),
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
        &self.start
    }

    /// What a master that is let in is sent: the model as it begins, the tool's place (m), the secret to resume with, and the
    /// names of the update scheme and of the program, clipped.
    #[must_use]
    pub fn welcome(&self, resume: Token, scheme: &str, program: &str) -> Welcome {
        Welcome {
            settings: self.settings,
            state: *self.state(),
            tool: self.tool_at,
            tool_force_max_n: self.tool_force().max_n(),
            resume,
            scheme: Label::clipped(scheme),
            program: Label::clipped(program),
        }
    }

    /// The real object: the truth, for reports, never for the estimate. With a plant that is plugged in the configured
    /// object, where the plant saw its own last.
    #[must_use]
    pub fn environment(&self) -> &Environment {
        self.contact.environment()
    }

    /// The real object, to be changed in mid-run: scenarios do, sessions never.
    pub fn environment_mut(&mut self) -> &mut Environment {
        self.contact.plant_mut().environment_mut()
    }

    /// What the estimator found so far.
    #[must_use]
    pub fn estimate(&self) -> &Estimate {
        self.object.estimator.estimate()
    }

    /// The noise of the measured force per axis, N, where (12) is judged by averages for it; else 0.
    #[must_use]
    pub fn force_noise_n(&self) -> f64 {
        self.contact.noise_n()
    }

    /// Estimates whose numbers were not accepted as parameters.
    #[must_use]
    pub fn refused_estimates(&self) -> u64 {
        self.object.refused
    }

    /// Images that no tick was given: a newer one was due, they showed another body, or the clock was set back.
    #[must_use]
    pub fn images_dropped(&self) -> u64 {
        self.contact.plant().images_dropped()
    }

    /// Images that showed a moment of longer ago than the slave remembers (256 ms).
    #[must_use]
    pub fn images_too_old(&self) -> u64 {
        self.object.images_too_old
    }

    /// Updates whose state lay beyond what a master accepts and was brought to the edge of it.
    #[must_use]
    pub fn clamped_states(&self) -> u64 {
        self.updates.clamped()
    }

    /// Play-out.
    #[must_use]
    pub fn playout(&self) -> &PlayoutBuffer {
        &self.playout
    }

    /// What is known of the master's model.
    #[must_use]
    pub fn shadow(&self) -> &Shadow {
        &self.shadow
    }

    /// The pose as the slave sees it.
    #[must_use]
    pub fn observer(&self) -> &PoseObserver {
        &self.object.observer
    }

    /// Force metrics over all samples whose f_m is known.
    #[must_use]
    pub fn force(&self) -> &ForceMetrics {
        &self.errors.measured
    }

    /// The same metrics with the true force in place of the measured one: for reports.
    #[must_use]
    pub fn true_force(&self) -> TrueForce {
        self.errors.truth()
    }

    /// Holds the tool where it is, or no longer ([`PlayoutBuffer::hold`]).
    pub fn hold_tool(&mut self, held: bool) {
        self.playout.hold(held);
    }

    /// From now on the trigger's thresholds and times are `by` as large as configured: the answer to congestion.
    pub fn stretch(&mut self, by: f64) {
        self.trigger.stretch(by);
    }

    /// The update scheme as it is now, stretched or not.
    #[must_use]
    pub fn scheme_now(&self) -> Scheme {
        self.trigger.scheme_now()
    }

    /// The tool's port, as time-domain passivity control sees it.
    #[must_use]
    pub fn tool_port(&self) -> &ToolPort {
        self.tool.port()
    }

    /// The limit of the tool's force, and what came of it.
    #[must_use]
    pub fn tool_force(&self) -> &ToolForce {
        self.tool.force()
    }

    /// Measured force over true force, as contacts have shown it; none where it is not looked for, and before one has.
    #[must_use]
    pub fn sensor_gain(&self) -> Option<f64> {
        self.contact.sensor_gain()
    }

    /// The limit of the tool's energy, and what passed both ports.
    #[must_use]
    pub fn tool_energy(&self) -> &ToolEnergy {
        self.tool.energy()
    }

    /// The path takes so long, there and back: the limit of the tool's energy allows for it.
    pub fn set_round_trip(&mut self, path: Duration) {
        self.tool.set_round_trip(path);
    }

    /// Takes in the state of the hand's port, newer than all before: the hand feels the tool, which from now on goes only
    /// as far as the hand has paid for.
    pub fn handle_hand_port(&mut self, port: &HandPort) {
        self.tool.credit(port.in_j, self.playout.played_hip());
    }

    /// What the hand feels of the tool after a tick, where it does.
    #[must_use]
    pub fn tool_state(&self, tick: &SlaveTick) -> Option<Tool> {
        let port = self.tool_port();
        self.tool.is_passive().then(|| Tool {
            answers: tick.stamp,
            force: ForceCounts::nearest(port.held()),
            in_contact: tick.in_contact,
            in_j: port.energy().in_j,
        })
    }

    /// What a viewer sees after a tick: the object where the slave takes it to be.
    #[must_use]
    pub fn scene(&self, tick: &SlaveTick) -> Scene {
        Scene {
            answers: tick.stamp,
            object: self.object.observer.pose(),
            tool: tick.tool,
            force: if tick.in_contact {
                tick.f_s
            } else {
                Vec2::zeros()
            },
        }
    }
}

#[cfg(test)]
mod tests;
