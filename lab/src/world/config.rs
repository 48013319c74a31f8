//! What a run depends on, and why a world could not be made of it.
//!
//! Numbers only: it builds nothing and runs nothing.

use mmt_client::commands::CommandConfig;
use mmt_client::device::DeviceError;
use mmt_client::operator::scripted::ScriptedConfig;
use mmt_netem::config::{ConfigError, LinkConfig};
use mmt_server::end::SlaveEndConfig;
use mmt_server::slave::{SlaveConfig, SlaveError};
use mmt_shared::channel::rate_control::StretchMax;
use mmt_shared::model::architecture::Architecture;
use mmt_shared::model::contact::Coupling;
use mmt_shared::model::settings::ModelSettings;
use mmt_shared::range::OutOfRange;
use serde::{Deserialize, Serialize};

/// Everything that a run depends on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct WorldConfig {
    /// Seed of the network's draws; the slave's and the operator's seeds are their own.
    pub seed: u64,
    /// The slave.
    pub slave: SlaveConfig,
    /// How both run the local model; the mode's own if absent.
    pub settings: Option<ModelSettings>,
    /// Stiffness k_p of the device, N/m; the default profile's if absent.
    pub stiffness_n_per_m: Option<f64>,
    /// The scripted operator.
    pub operator: ScriptedConfig,
    /// Whose force the hand feels.
    pub architecture: Architecture,
    /// New samples in a command.
    pub samples_per_command: u8,
    /// Each command repeats the samples of this many commands before it.
    pub repeat_samples: u8,
    /// By how much congestion may stretch the time between the master's samples; 1: not at all.
    pub stretch_max: StretchMax,
    /// Network from master to slave.
    pub up: LinkConfig,
    /// Network from slave to master.
    pub down: LinkConfig,
}

impl Default for WorldConfig {
    /// The default scenario over a perfect network.
    fn default() -> Self {
        let CommandConfig {
            samples_per_command,
            repeat_samples,
            stretch_max,
        } = CommandConfig::default();
        Self {
            seed: 1,
            slave: SlaveConfig::default(),
            settings: None,
            stiffness_n_per_m: None,
            operator: ScriptedConfig::default(),
            architecture: Architecture::default(),
            samples_per_command,
            repeat_samples,
            stretch_max,
            up: LinkConfig::default(),
            down: LinkConfig::default(),
        }
    }
}

impl WorldConfig {
    /// The default scenario over a network, the same both ways.
    #[must_use]
    pub fn over(link: LinkConfig) -> Self {
        Self {
            up: link.clone(),
            down: link,
            ..Self::default()
        }
    }

    /// This configuration with these greatest stretches of master and slave.
    #[cfg(feature = "io")]
    pub(crate) fn stretched(mut self, master: StretchMax, slave: StretchMax) -> Self {
        self.stretch_max = master;
        self.slave.stretch_max = slave;
        self
    }

    /// This configuration with every seed derived from one.
    #[must_use]
    pub fn seeded(mut self, seed: u64) -> Self {
        self.seed = seed;
        self.slave.seed = seed;
        self.operator.seed = seed;
        self
    }

    /// How both run the local model over this coupling.
    pub(crate) fn model_settings(&self, coupling: Coupling) -> ModelSettings {
        let of_mode = || self.slave.mode.model_settings(coupling);
        self.settings.unwrap_or_else(of_mode)
    }

    /// The slave, as in a live session.
    pub(super) fn slave(&self) -> SlaveConfig {
        let samples_per_command = self.commands().samples_per_command;
        (self.slave).for_session(samples_per_command, self.architecture)
    }

    /// How the master sends.
    pub(super) fn commands(&self) -> CommandConfig {
        CommandConfig {
            samples_per_command: self.samples_per_command,
            repeat_samples: self.repeat_samples,
            stretch_max: self.stretch_max,
        }
        .for_architecture(self.architecture)
    }

    /// How the slave sends.
    pub(super) fn slave_end(&self) -> SlaveEndConfig {
        SlaveEndConfig {
            repeats: self.slave.repeats_ms,
            stretch_max: self.slave.stretch_max,
            samples_per_command: self.commands().samples_per_command,
            architecture: self.architecture,
            // nobody looks
            scene_hz: 0,
        }
    }
}

/// Why a world could not be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum WorldError {
    /// The slave's numbers are wrong.
    #[error(transparent)]
    Slave(#[from] SlaveError),
    /// The device cannot do this.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// A number of the device's limits or of the operator is wrong.
    #[error(transparent)]
    OutOfRange(#[from] OutOfRange),
    /// The network's numbers are wrong.
    #[error(transparent)]
    Network(#[from] ConfigError),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_world_waits_in_play_out_as_long_as_a_live_session_of_its_packing() {
        for samples_per_command in [1, 5, 10, 20] {
            let config = WorldConfig {
                samples_per_command,
                ..WorldConfig::default()
            };
            let delay_ms = config.slave().playout.delay_ms;
            assert_eq!(delay_ms, 6.0 + f64::from(samples_per_command));
        }
    }

    #[test]
    fn a_delay_of_play_out_that_was_configured_stays_whatever_the_hand_feels() {
        for architecture in Architecture::ALL {
            let mut config = WorldConfig {
                architecture,
                ..WorldConfig::default()
            };
            let begins = config.slave().playout.delay_ms;
            assert_eq!(begins == 0.0, architecture.feels_tool());
            config.slave.playout.delay_ms = 33.0;
            assert_eq!(config.slave().playout.delay_ms, 33.0);
        }
    }
}
