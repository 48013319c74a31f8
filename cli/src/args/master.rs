//! The arguments of `mmt master`.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use mmt_netem::LinkConfig;
use mmt_shared::channel::rate_control::StretchMax;
use mmt_shared::model::architecture::Architecture;

use super::console::ConsoleArguments;
use super::device::DeviceArguments;
use super::netem::EmulationArguments;
use super::transport::TransportArguments;
use super::values::{self, OperatorWords, PairingWords};

/// Arguments of `mmt master`.
#[derive(Debug, Args)]
pub(crate) struct MasterArguments {
    /// What `mmt slave` printed; - asks for it, or reads it from stdin, and keeps it out of the list of processes
    #[arg(value_name = "PAIRING")]
    pub(crate) pairing: PairingWords,
    /// Look on and move nothing, as any number of others may, while somebody else operates or nobody does
    #[arg(long, conflicts_with_all = ["take_over", "operator", "push", "device", "device_config", "device_at", "device_listen",
          "device_insecure", "stiffness", "architecture", "record", "record_path", "samples_per_command", "repeat_samples",
          "stretch_max"])]
    pub(crate) observe: bool,
    /// Who moves the hand: scripted, pointer (in the console), or trace:FILE
    #[arg(long, value_name = "WHO", default_value = "scripted", value_parser = values::operator)]
    pub(crate) operator: OperatorWords,
    /// Of recorded pushes only this one, from 0 [default: all, joined]
    #[arg(long, value_name = "N", value_parser = values::whole::<usize>(0, u64::MAX), allow_negative_numbers = true)]
    pub(crate) push: Option<usize>,
    /// How long [default: until the operator has finished, or Ctrl-C]
    #[arg(long, value_name = "TIME", value_parser = values::duration, allow_hyphen_values = true)]
    pub(crate) duration: Option<Duration>,
    /// The haptic device.
    #[command(flatten)]
    pub(crate) device: DeviceArguments,
    /// Configuration, TOML (docs/configuration.md)
    #[arg(long, value_name = "FILE")]
    pub(crate) config: Option<PathBuf>,
    /// Virtual stiffness k_p, N/m [default: the file's, else the device's]
    #[arg(long, value_name = "N_PER_M", value_parser = values::number, allow_negative_numbers = true)]
    pub(crate) stiffness: Option<f64>,
    /// Whose force the hand feels [default: the file's, else mmt]
    #[arg(long, value_name = "NAME", value_parser = values::architecture())]
    pub(crate) architecture: Option<Architecture>,
    /// Emulated network on what the master sends [default: the file's, else none]
    #[arg(long, value_name = "WORDS", value_parser = values::netem)]
    pub(crate) netem: Option<LinkConfig>,
    /// Record and control of the emulated network
    #[command(flatten)]
    pub(crate) emulation: EmulationArguments,
    /// Record the master's session in this file, MCAP: for mmt replay, report, export and the tools of ROS 2
    #[arg(long, value_name = "FILE")]
    pub(crate) record: Option<PathBuf>,
    /// End the session of another operator of the slave, and operate it
    #[arg(long)]
    pub(crate) take_over: bool,
    /// Keep the path to the slave in this file: half of each round trip, and losses; a trace for --netem
    #[arg(long, value_name = "FILE")]
    pub(crate) record_path: Option<PathBuf>,
    /// Seed of operator and network [default: the file's, else 1]
    #[arg(long, value_name = "N", value_parser = values::seed, allow_negative_numbers = true)]
    pub(crate) seed: Option<u64>,
    /// HIP samples (1 a millisecond) in a datagram [default: the file's, else 10]
    #[arg(long, value_name = "N", value_parser = values::samples_per_command, allow_negative_numbers = true)]
    pub(crate) samples_per_command: Option<u8>,
    /// What carries the session.
    #[command(flatten)]
    pub(crate) transport: TransportArguments,
    /// How many datagrams before it each datagram repeats the samples of [default: the file's, else 0]
    #[arg(long, value_name = "N", value_parser = values::repeat_samples, allow_negative_numbers = true)]
    pub(crate) repeat_samples: Option<u8>,
    /// Greatest factor that congestion may stretch the time between samples by; 1: off [default: the file's, else 3]
    #[arg(long, value_name = "FACTOR")]
    pub(crate) stretch_max: Option<StretchMax>,
    /// The console.
    #[command(flatten)]
    pub(crate) console: ConsoleArguments,
    /// Print every number of the report; without it a sentence and ten lines
    #[arg(long, conflicts_with = "json")]
    pub(crate) full: bool,
    /// Print the report as one JSON document
    #[arg(long)]
    pub(crate) json: bool,
}
