//! One configuration for every program: the program's own, the keys of a file laid over it, and over those the flags.
//!
//! The keys are the fields of [`WorldConfig`]; no other list of them exists. Whatever a run could refuse is refused here,
//! with its place in the file.

mod idle;
mod keys;
mod known;
mod program;
mod template;
#[cfg(test)]
mod tests;

use std::ops::Range;

use mmt_netem::config::LinkConfig;
use mmt_server::playout::PlayoutConfig;
use serde::Serialize;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

pub(crate) use idle::{DEVICE_STIFFNESS, MODEL_STIFFNESS, idle_in_sweep};
pub use known::{Known, Origin};
pub use template::template;

use crate::overlay::{lay, lay_at};
use crate::sweep::{Start, beginning};
use crate::text_error::TextError;
use crate::world::{World, WorldConfig};
use keys::leaves_of;
pub(crate) use keys::{at, configuration};
pub use program::Program;
pub(crate) use program::SEED_KEYS;

/// The emulated network of a demo, each way, where nobody wants another one.
const DEMO_NETWORK: &str = "delay 50ms 5ms loss 1%";

/// A key that the command line sets.
#[derive(Clone, Debug)]
pub struct Flag {
    name: &'static str,
    key: &'static str,
    /// In TOML.
    value: String,
    /// The network itself, where the key is one: what it was read from may lie in files.
    network: Option<LinkConfig>,
}

impl Flag {
    /// The flag `name` sets `key` to this value; none if it cannot be written in TOML.
    #[must_use]
    pub fn new(name: &'static str, key: &'static str, value: &impl Serialize) -> Option<Self> {
        let value = toml::Value::try_from(value).ok()?.to_string();
        Some(Self {
            name,
            key,
            value,
            network: None,
        })
    }

    /// The flag `name` sets the network at `key`, `up` or `down`.
    #[must_use]
    pub fn network(name: &'static str, key: &'static str, network: &LinkConfig) -> Self {
        Self {
            name,
            key,
            value: "\"none\"".to_owned(),
            network: Some(network.clone()),
        }
    }
}

/// What a configuration is made of.
#[derive(Clone, Copy, Debug)]
pub struct Layers<'a> {
    /// Who reads it.
    pub program: Program,
    /// The text of the file; empty if there is none.
    pub file: &'a str,
    /// The flags, each later one over those before it.
    pub flags: &'a [Flag],
    /// The seed of everything, if the command line gives one.
    pub seed: Option<u64>,
}

impl<'a> Layers<'a> {
    /// The configuration.
    ///
    /// # Errors
    /// What is wrong with the file, with line and caret: no TOML, an unknown key, a value that a run refuses.
    pub fn config(&self) -> Result<WorldConfig, TextError> {
        self.config_from(Start::Live)
    }

    /// The configuration over a start that is not the program's own: of experiments.
    ///
    /// # Errors
    /// As [`Layers::config`].
    pub fn config_from(&self, start: Start) -> Result<WorldConfig, TextError> {
        let given = self.given()?;
        if self.program == Program::Sweep {
            idle::agree(self.file, given.get_ref())?;
        }
        let config = self.laid(start, &given)?;
        self.check(start, &given, &config)?;
        Ok(match self.seed {
            Some(seed) => config.seeded(seed),
            None => config,
        })
    }

    /// The keys that file and flags give; those of flags stand behind the end of the file.
    fn given(&self) -> Result<Spanned<DeTable<'a>>, TextError> {
        let read = |error| TextError::of(self.file, &error);
        let mut given = configuration(self.file).map_err(read)?;
        for (n, flag) in self.flags.iter().enumerate() {
            let place = self.file.len() + 1 + n;
            let place = place..place;
            let value = DeValue::parse(&flag.value).map_err(read)?.into_inner();
            let value = Spanned::new(place.clone(), value);
            lay_at(given.get_mut(), flag.key, &place, value);
        }
        Ok(given)
    }

    fn laid(&self, start: Start, given: &Spanned<DeTable>) -> Result<WorldConfig, TextError> {
        let start = beginning(start, given);
        if self.program != Program::Demo {
            return self.lay(&start, given.clone());
        }
        let network: LinkConfig = DEMO_NETWORK.parse().unwrap_or_default();
        let mut start = WorldConfig {
            up: network.clone(),
            down: network,
            ..start
        };
        let wanted = self.lay(&start, given.clone())?;
        // both sides stretch as far
        start.stretch_max = wanted.slave.stretch_max;
        // where the tool may be felt the play-out finds out by itself how long it has to wait
        if !wanted.architecture.feels_tool() {
            let jitter = wanted.up.jitter_span();
            start.slave.playout =
                PlayoutConfig::for_packing_and_jitter(wanted.samples_per_command, jitter);
        }
        self.lay(&start, given.clone())
    }

    fn lay(&self, start: &WorldConfig, given: Spanned<DeTable>) -> Result<WorldConfig, TextError> {
        let length = self.file.len() + 1 + self.flags.len();
        let laid = lay(start, given, length);
        let mut config: WorldConfig = laid.map_err(|error| TextError::of(self.file, &error))?;
        for flag in self.flags {
            let home = match flag.key {
                "up" => &mut config.up,
                "down" => &mut config.down,
                _ => continue,
            };
            if let Some(network) = &flag.network {
                home.clone_from(network);
            }
        }
        Ok(config)
    }

    /// Makes the world, and where that is refused finds the key to blame: the first one that is refused without the others.
    fn check(
        &self,
        start: Start,
        given: &Spanned<DeTable>,
        config: &WorldConfig,
    ) -> Result<(), TextError> {
        let Err(error) = self.attempt(config) else {
            return Ok(());
        };
        let mut leaves = Vec::new();
        leaves_of(given.get_ref(), "", &mut leaves);
        let refused = leaves.into_iter().find(|(key, value)| {
            let mut alone = DeTable::new();
            lay_at(&mut alone, key, &value.span(), (*value).clone());
            let config = self.laid(start, &Spanned::new(0..0, alone));
            config.is_ok_and(|config| self.attempt(&config).is_err())
        });
        let Some((_, value)) = refused else {
            return Err(TextError::at(self.file, None, error));
        };
        let place = value.span();
        Err(match self.flag_at(&place) {
            Some(flag) => TextError::at("", None, format_args!("{}: {error}", flag.name)),
            None => TextError::at(self.file, Some(place), error),
        })
    }

    /// Why no run could be so; empty of what a live program asks the device itself.
    fn attempt(&self, config: &WorldConfig) -> Result<(), String> {
        let mut config = config.clone();
        if self.program != Program::Sweep {
            config.stiffness_n_per_m = None;
        }
        let world = World::try_new(&config);
        world.map(drop).map_err(|error| error.to_string())
    }

    fn flag_at(&self, place: &Range<usize>) -> Option<&'a Flag> {
        self.flags
            .get(place.start.checked_sub(self.file.len() + 1)?)
    }
}
