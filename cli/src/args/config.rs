//! The arguments of `mmt config`, and which keys of the configuration the options of each command set.

use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, Subcommand};
use mmt_lab::layers::Program;
use mmt_netem::LinkConfig;
use mmt_server::repeats::Repeats;
use mmt_server::trigger::Scheme;
use mmt_shared::channel::rate_control::StretchMax;
use mmt_shared::model::architecture::Architecture;
use mmt_shared::model::settings::Mode;

use super::master::MasterArguments;
use super::{DemoArguments, SlaveArguments, values};
use crate::config::Flags;
use crate::failure::Failure;

/// What both sides of a demo stretch by.
const BOTH_STRETCH: [&str; 2] = ["stretch_max", "slave.stretch_max"];

/// Arguments of `mmt config`.
#[derive(Debug, Args)]
pub(crate) struct ConfigArguments {
    /// What to print.
    #[command(subcommand)]
    pub(crate) command: ConfigCommand,
}

/// What can be printed.
#[derive(Debug, Subcommand)]
pub(crate) enum ConfigCommand {
    /// The default as a file to be changed: given back with --config it changes nothing
    Default {
        /// The bundle of choices
        #[arg(long, value_name = "NAME", default_value = "recommended", value_parser = values::mode())]
        mode: Mode,
    },
    /// What would be in force, and where each value comes from
    Show(Box<ShowArguments>),
}

/// Arguments of `mmt config show`: the options of every command that set a key.
#[derive(Debug, Args)]
pub(crate) struct ShowArguments {
    /// Whose configuration: demo, slave, master or sweep
    #[arg(value_name = "PROGRAM", default_value = "demo", value_parser = program())]
    pub(crate) program: Program,
    /// The file, TOML
    #[arg(long, value_name = "FILE")]
    pub(crate) config: Option<PathBuf>,
    /// Seed of everything
    #[arg(long, value_name = "N", value_parser = values::seed, allow_negative_numbers = true)]
    seed: Option<u64>,
    /// The bundle of choices
    #[arg(long, value_name = "NAME", value_parser = values::mode())]
    mode: Option<Mode>,
    /// When updates are sent
    #[arg(long, value_name = "WORDS", value_parser = values::scheme)]
    scheme: Option<Scheme>,
    /// When an update is repeated
    #[arg(long, value_name = "WORDS")]
    repeats: Option<Repeats>,
    /// Bodies and walls, TOML
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
    /// Whose force the hand feels
    #[arg(long, value_name = "NAME", value_parser = values::architecture())]
    architecture: Option<Architecture>,
    /// Virtual stiffness k_p, N/m
    #[arg(long, value_name = "N_PER_M", value_parser = values::number, allow_negative_numbers = true)]
    stiffness: Option<f64>,
    /// HIP samples in a datagram
    #[arg(long, value_name = "N", value_parser = values::samples_per_command, allow_negative_numbers = true)]
    samples_per_command: Option<u8>,
    /// How many datagrams before it each datagram repeats the samples of
    #[arg(long, value_name = "N", value_parser = values::repeat_samples, allow_negative_numbers = true)]
    repeat_samples: Option<u8>,
    /// Greatest factor that congestion may stretch by
    #[arg(long, value_name = "FACTOR")]
    stretch_max: Option<StretchMax>,
    /// Emulated network: of the slave what it sends, of the master what it sends, else each direction
    #[arg(long, value_name = "WORDS", value_parser = values::netem)]
    netem: Option<LinkConfig>,
    /// Emulated network from master to slave
    #[arg(long, value_name = "WORDS", value_parser = values::netem)]
    netem_up: Option<LinkConfig>,
    /// Emulated network from slave to master
    #[arg(long, value_name = "WORDS", value_parser = values::netem)]
    netem_down: Option<LinkConfig>,
    /// Print one JSON document instead of a table
    #[arg(long)]
    pub(crate) json: bool,
}

impl ShowArguments {
    /// What they set.
    ///
    /// # Errors
    /// The scene's file.
    pub(crate) fn flags(&self) -> Result<Flags, Failure> {
        let (up, down): (&[_], &[_]) = (&["up"], &["down"]);
        let netem = match self.program {
            Program::Slave => down,
            Program::Master => up,
            Program::Demo | Program::Sweep => &["up", "down"],
        };
        let stretch = match self.program {
            Program::Slave => BOTH_STRETCH.get(1..),
            Program::Master => BOTH_STRETCH.get(..1),
            Program::Demo | Program::Sweep => None,
        };
        let flags = Flags::default()
            .seed(self.seed)
            .network("--netem", netem, self.netem.as_ref())
            .network("--netem-up", up, self.netem_up.as_ref())
            .network("--netem-down", down, self.netem_down.as_ref())
            .set("--mode", &["slave.mode"], self.mode)
            .set("--scheme", &["slave.trigger.scheme"], self.scheme)
            .set("--repeats", &["slave.repeats_ms"], self.repeats)
            .set("--architecture", &["architecture"], self.architecture)
            .set("--stiffness", &["stiffness_n_per_m"], self.stiffness)
            .set(
                "--samples-per-command",
                &["samples_per_command"],
                self.samples_per_command,
            )
            .set("--repeat-samples", &["repeat_samples"], self.repeat_samples)
            .set(
                "--stretch-max",
                stretch.unwrap_or(&BOTH_STRETCH),
                self.stretch_max,
            );
        flags.scene(self.scene.as_deref())
    }
}

impl DemoArguments {
    /// What they set.
    ///
    /// # Errors
    /// The scene's file.
    pub(crate) fn flags(&self) -> Result<Flags, Failure> {
        let flags = Flags::default()
            .seed(self.seed)
            .network("--netem", &["up", "down"], self.netem.as_ref())
            .network("--netem-up", &["up"], self.netem_up.as_ref())
            .network("--netem-down", &["down"], self.netem_down.as_ref())
            .set("--mode", &["slave.mode"], self.mode)
            .set("--scheme", &["slave.trigger.scheme"], self.scheme)
            .set("--repeats", &["slave.repeats_ms"], self.repeats)
            .set("--architecture", &["architecture"], self.architecture)
            .set("--repeat-samples", &["repeat_samples"], self.repeat_samples)
            .set("--stretch-max", &BOTH_STRETCH, self.stretch_max);
        flags.scene(self.scene.as_deref())
    }
}

impl SlaveArguments {
    /// What they set.
    ///
    /// # Errors
    /// The scene's file.
    pub(crate) fn flags(&self) -> Result<Flags, Failure> {
        let flags = Flags::default()
            .seed(self.seed)
            .network("--netem", &["down"], self.netem.as_ref())
            .set("--mode", &["slave.mode"], self.mode)
            .set("--scheme", &["slave.trigger.scheme"], self.scheme)
            .set("--repeats", &["slave.repeats_ms"], self.repeats)
            .set("--stretch-max", &["slave.stretch_max"], self.stretch_max);
        flags.scene(self.scene.as_deref())
    }
}

impl MasterArguments {
    /// What they set.
    pub(crate) fn flags(&self) -> Flags {
        Flags::default()
            .seed(self.seed)
            .network("--netem", &["up"], self.netem.as_ref())
            .set("--architecture", &["architecture"], self.architecture)
            .set("--stiffness", &["stiffness_n_per_m"], self.stiffness)
            .set(
                "--samples-per-command",
                &["samples_per_command"],
                self.samples_per_command,
            )
            .set("--repeat-samples", &["repeat_samples"], self.repeat_samples)
            .set("--stretch-max", &["stretch_max"], self.stretch_max)
    }
}

fn program() -> impl TypedValueParser<Value = Program> {
    let names = Program::ALL.map(Program::name);
    PossibleValuesParser::new(names).map(|name| {
        let named = Program::ALL
            .into_iter()
            .find(|program| program.name() == name);
        named.unwrap_or(Program::Demo)
    })
}
