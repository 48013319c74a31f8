//! The arguments of `mmt demo`.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use mmt_netem::LinkConfig;
use mmt_server::repeats::Repeats;
use mmt_server::trigger::Scheme;
use mmt_shared::channel::rate_control::StretchMax;
use mmt_shared::model::architecture::Architecture;
use mmt_shared::model::settings::Mode;

use super::console::ConsoleArguments;
use super::device::DeviceArguments;
use super::netem::EmulationArguments;
use super::transport::TransportArguments;
use super::values;

/// Arguments of `mmt demo`.
#[derive(Clone, Debug, Args)]
pub(crate) struct DemoArguments {
    /// How long the operator works; a demo that a browser shows goes on until that is closed
    #[arg(long, value_name = "TIME", default_value = "20s", value_parser = values::duration, allow_hyphen_values = true)]
    pub(crate) duration: Duration,
    /// Configuration of both sides, TOML (docs/configuration.md)
    #[arg(long, value_name = "FILE")]
    pub(crate) config: Option<PathBuf>,
    /// Seed of operator, sensors and network [default: the file's, else 1]
    #[arg(long, value_name = "N", value_parser = values::seed, allow_negative_numbers = true)]
    pub(crate) seed: Option<u64>,
    /// Emulated network in each direction [default: the file's, else "delay 50ms 5ms loss 1%"]
    #[arg(long, value_name = "WORDS", value_parser = values::netem)]
    pub(crate) netem: Option<LinkConfig>,
    /// Emulated network from master to slave [default: --netem]
    #[arg(long, value_name = "WORDS", value_parser = values::netem)]
    pub(crate) netem_up: Option<LinkConfig>,
    /// Emulated network from slave to master [default: --netem]
    #[arg(long, value_name = "WORDS", value_parser = values::netem)]
    pub(crate) netem_down: Option<LinkConfig>,
    /// Record and control of the emulated networks
    #[command(flatten)]
    pub(crate) emulation: EmulationArguments,
    /// Record the session of both ends in this file, MCAP: for mmt replay, report, export and the tools of ROS 2
    #[arg(long, value_name = "FILE")]
    pub(crate) record: Option<PathBuf>,
    /// The bundle of choices [default: the file's, else recommended]
    #[arg(long, value_name = "NAME", value_parser = values::mode())]
    pub(crate) mode: Option<Mode>,
    /// Whose force the hand feels [default: the file's, else mmt]
    #[arg(long, value_name = "NAME", value_parser = values::architecture())]
    pub(crate) architecture: Option<Architecture>,
    /// Bodies and walls, TOML [default: the configuration's, else one cube]
    #[arg(long, value_name = "FILE")]
    pub(crate) scene: Option<PathBuf>,
    /// When updates are sent [default: the file's, else the mode's]
    #[arg(long, value_name = "WORDS", value_parser = values::scheme)]
    pub(crate) scheme: Option<Scheme>,
    /// What carries the session.
    #[command(flatten)]
    pub(crate) transport: TransportArguments,
    /// When an update is repeated, such as "10ms 30ms", or none [default: the file's, else the mode's]
    #[arg(long, value_name = "WORDS")]
    pub(crate) repeats: Option<Repeats>,
    /// How many commands before it each command repeats the samples of [default: the file's, else 0]
    #[arg(long, value_name = "N", value_parser = values::repeat_samples, allow_negative_numbers = true)]
    pub(crate) repeat_samples: Option<u8>,
    /// Greatest factor that congestion may stretch Delta, T_update and the time between samples by; 1: off
    /// [default: the file's, else the mode's]
    #[arg(long, value_name = "FACTOR")]
    pub(crate) stretch_max: Option<StretchMax>,
    /// The haptic device.
    #[command(flatten)]
    pub(crate) device: DeviceArguments,
    /// A blind comparison: two configurations, in the browser, in random order, a question on each (docs/console.md)
    #[arg(long, value_names = ["A.toml", "B.toml"], num_args = 2, requires = "consent",
          conflicts_with_all = ["config", "record", "json", "full", "netem_record", "netem_control", "no_console"])]
    pub(crate) blind: Option<Vec<PathBuf>>,
    /// What a participant agrees to, text, with --blind
    #[arg(long, value_name = "FILE", requires = "blind")]
    pub(crate) consent: Option<PathBuf>,
    /// What a participant is asked after each part, with --blind
    #[arg(
        long,
        value_name = "TEXT",
        requires = "blind",
        default_value = "How real did the box feel?"
    )]
    pub(crate) question: String,
    /// Folder of the answers and records, with --blind
    #[arg(long, value_name = "DIR", requires = "blind", default_value = "study")]
    pub(crate) study: PathBuf,
    /// The console; on a terminal there is one unless it is switched off.
    #[command(flatten)]
    pub(crate) console: ConsoleArguments,
    /// Print every number of the report; without it a sentence and ten lines
    #[arg(long, conflicts_with = "json")]
    pub(crate) full: bool,
    /// Print the report as one JSON document; plain lines instead of the live view
    #[arg(long)]
    pub(crate) json: bool,
}
