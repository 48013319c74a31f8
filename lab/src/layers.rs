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
mod whole;

use std::fmt::Display;
use std::ops::Range;

use mmt_netem::config::LinkConfig;
use mmt_server::playout::PlayoutConfig;
use serde::Serialize;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

pub(crate) use idle::{DEVICE_STIFFNESS, MODEL_STIFFNESS, idle_in_sweep};
pub use known::{Known, Origin};
pub use template::template;

use crate::overlay::{lay, lay_at, lay_over};
use crate::sweep::{Start, beginning};
use crate::text_error::TextError;
use crate::world::{World, WorldConfig};
pub(crate) use keys::{at, configuration};
use keys::{leaves_of, within};
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
    /// The text that the value was read from, if it was.
    text: Option<String>,
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
            text: None,
        })
    }

    /// The same whose value, a table, was read from this text: what is refused of it has its place there.
    #[must_use]
    pub fn read_from(self, text: String) -> Self {
        Self {
            text: Some(text),
            ..self
        }
    }

    /// The flag `name` sets the network at `key`, `up` or `down`.
    #[must_use]
    pub fn network(name: &'static str, key: &'static str, network: &LinkConfig) -> Self {
        Self {
            name,
            key,
            value: "\"none\"".to_owned(),
            network: Some(network.clone()),
            text: None,
        }
    }

    /// The value, with the places of the text that it was read from.
    fn read(&self) -> Result<DeValue<'_>, toml::de::Error> {
        let mut value = DeValue::parse(&self.value)?.into_inner();
        if let (DeValue::Table(whole), Some(text)) = (&mut value, &self.text) {
            lay_over(whole, DeTable::parse(text)?.into_inner());
        }
        Ok(value)
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

    /// The configuration of a program whose device, if it has one, can be used with the stiffness that is given, N/m:
    /// `device` judges it.
    ///
    /// # Errors
    /// As [`Layers::config`], and why the device refuses the stiffness, with its place.
    pub fn config_with<E: Display>(
        &self,
        device: impl FnOnce(f64) -> Result<(), E>,
    ) -> Result<WorldConfig, TextError> {
        let config = self.config()?;
        let key = DEVICE_STIFFNESS;
        let stiffness = config.stiffness_n_per_m.filter(|_| self.program.uses(key));
        if let Some(Err(error)) = stiffness.map(device) {
            let place = at(self.given()?.get_ref(), key).map(Spanned::span);
            return Err(self.blame(key, place, error));
        }
        Ok(config)
    }

    /// The keys that file and flags give; those of flags stand behind the end of the file.
    fn given(&self) -> Result<Spanned<DeTable<'a>>, TextError> {
        let mut given = configuration(self.file)?;
        for (n, flag) in self.flags.iter().enumerate() {
            let place = self.file.len() + 1 + n;
            let place = place..place;
            let value = flag.read();
            let value = value.map_err(|error| TextError::of("", &error).of_option(flag.name))?;
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

    /// Makes the world, and where that is refused finds the key to blame: the first one that is refused without the others, else
    /// the first one without which the others are not.
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
        let attempt = |kept: &dyn Fn(usize) -> bool| {
            let mut some = DeTable::new();
            let kept = leaves.iter().enumerate().filter(|(n, _)| kept(*n));
            for (_, (key, value)) in kept {
                lay_at(&mut some, key, &value.span(), (*value).clone());
            }
            let config = self.laid(start, &Spanned::new(0..0, some)).ok()?;
            Some(self.attempt(&config).is_err())
        };
        let alone = |n: &usize| attempt(&|other| other == *n) == Some(true);
        let with_others = |n: &usize| attempt(&|other| other != *n) == Some(false);
        let numbers = 0..leaves.len();
        let refused = numbers.clone().find(alone);
        let refused = refused.or_else(|| numbers.clone().find(with_others));
        let refused = refused.and_then(|n| leaves.get(n));
        Err(match refused {
            Some((key, value)) => self.blame(key, Some(value.span()), error),
            None => TextError::at(self.file, None, error),
        })
    }

    /// Why a key is refused whose value has this place: in the file, or in what a flag gave.
    fn blame(&self, key: &str, place: Option<Range<usize>>, why: impl Display) -> TextError {
        match self.flags.iter().rfind(|flag| within(key, flag.key)) {
            None => TextError::at(self.file, place, why),
            Some(flag) => match &flag.text {
                Some(text) => TextError::at(text, place, why),
                None => TextError::at("", None, format_args!("{}: {why}", flag.name)),
            }
            .of_option(flag.name),
        }
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
}
