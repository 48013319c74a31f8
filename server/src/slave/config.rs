//! What a slave is made of, and why it could not be.

use mmt_shared::channel::rate_control::StretchMax;
use mmt_shared::model::architecture::Architecture;
use mmt_shared::model::contact::Coupling;
use mmt_shared::model::params::ParamsError;
use mmt_shared::model::settings::Mode;
use mmt_shared::model::tool::TOOL_FORCE_MAX_N;
use mmt_shared::range::OutOfRange;
use serde::{Deserialize, Serialize};

use crate::conditioning::{Conditioner, ConditioningConfig};
use crate::environment::{EnvironmentConfig, EnvironmentError, SceneConfig};
use crate::estimator::{EstimatorConfig, ToolGives};
use crate::plant::PlantConfig;
use crate::playout::PlayoutConfig;
use crate::repeats::Repeats;
use crate::sensing::{SensingConfig, SensingError, VisionConfig};
use crate::shadow::TriggerReference;
use crate::tool::energy::EnergyConfig;
use crate::trigger::TriggerConfig;

/// What the local model starts from before anything is known of the object.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
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
        Self {
            mass_kg: 0.4,
            damping_ns_per_m: 0.0,
            friction_n: 1.0,
            side_m: 0.40,
        }
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
    /// Bodies and walls, where there is more than one body.
    pub scene: SceneConfig,
    /// What the tool meets: the above, or a plant of somebody else's.
    pub plant: PlantConfig,
    /// Noise, vision.
    pub sensing: SensingConfig,
    /// What is made of the measured force before it is judged.
    pub conditioning: ConditioningConfig,
    /// Buffer for the master's samples.
    pub playout: PlayoutConfig,
    /// The tool presses with no more than this on what it touches, N. Default 15: the hand's device gives 8.
    pub tool_force_max_n: f64,
    /// The tool gives no more energy than the hand gave, and a budget.
    pub tool_energy: EnergyConfig,
    /// A spring that the tool gives by under the measured force, for contacts that are stiffer than the rendered one. Recommended
    /// mode changes its stiffness when it knows the contact. Default: none.
    pub tool_compliance: Option<Coupling>,
    /// The estimator of m, b and c; the mode's own if absent. It starts from `start` in any case.
    pub estimator: Option<EstimatorConfig>,
    /// When updates are sent.
    pub trigger: TriggerConfig,
    /// What the trigger compares the measured force with.
    pub trigger_reference: TriggerReference,
    /// What the local model starts from.
    pub start: StartModel,
    /// When an update is sent again.
    pub repeats_ms: Repeats,
    /// By how much congestion may stretch the trigger's thresholds and times; 1: not at all.
    pub stretch_max: StretchMax,
}

impl SlaveConfig {
    /// The default of a mode: the default scenario, with the mode's update scheme. Only recommended mode sends
    /// updates again, answers congestion and sees the object while it is pushed.
    #[must_use]
    pub fn of_mode(mode: Mode) -> Self {
        let (repeats_ms, stretch_max, vision) = match mode {
            Mode::Paper => (Repeats::NONE, StretchMax::OFF, VisionConfig::off()),
            Mode::Recommended => (
                Repeats::recommended(),
                StretchMax::RECOMMENDED,
                VisionConfig::default(),
            ),
        };
        Self {
            seed: 1,
            mode,
            environment: EnvironmentConfig::default(),
            scene: SceneConfig::default(),
            plant: PlantConfig::default(),
            sensing: SensingConfig {
                vision,
                ..SensingConfig::default()
            },
            conditioning: ConditioningConfig::of_mode(mode),
            playout: PlayoutConfig::default(),
            tool_force_max_n: TOOL_FORCE_MAX_N,
            tool_energy: EnergyConfig {
                bounded: mode == Mode::Recommended,
                ..EnergyConfig::default()
            },
            tool_compliance: None,
            estimator: None,
            trigger: TriggerConfig::of_mode(mode),
            trigger_reference: TriggerReference::default(),
            start: StartModel::default(),
            repeats_ms,
            stretch_max,
        }
    }
}

impl SlaveConfig {
    /// The same for a master that sends so many new samples in a command, and whose hand feels this: play-out waits as long
    /// as that needs ([`PlayoutConfig::for_session`]).
    #[must_use]
    pub fn for_session(&self, samples_per_command: u8, architecture: Architecture) -> Self {
        Self {
            playout: self.playout.for_session(samples_per_command, architecture),
            ..self.clone()
        }
    }

    /// What gives while the tool presses.
    #[must_use]
    pub fn tool_gives(&self) -> ToolGives {
        match self.tool_compliance {
            Some(_) => ToolGives::BySlave,
            None if self.plant.link => ToolGives::ByPlant,
            None => ToolGives::No,
        }
    }

    /// What conditions the measured force of a tool with this coupling.
    #[must_use]
    pub fn conditioner(&self, coupling: &Coupling) -> Conditioner {
        Conditioner::new(self.conditioning, self.trigger.contact, coupling)
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
    #[error(transparent)]
    Environment(#[from] EnvironmentError),
    /// The sensors' numbers are wrong.
    #[error(transparent)]
    Sensing(#[from] SensingError),
    /// A number of play-out, of the estimator or of the tool's force is wrong.
    #[error(transparent)]
    OutOfRange(#[from] OutOfRange),
    /// A number of the local model's settings is not accepted.
    #[error("local model: {0}")]
    Settings(ParamsError),
    /// The start model's numbers are not accepted.
    #[error("start model: {0}")]
    Start(#[from] ParamsError),
}
