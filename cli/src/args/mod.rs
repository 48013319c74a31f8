//! The arguments of every command, as clap takes them, with help and examples.

mod bench;
mod config;
mod console;
mod demo;
mod device;
mod doctor;
mod help;
mod identity;
mod netem;
mod plant;
mod records;
mod reproduce;
mod slave;
mod soak;
mod swarm;
mod sweep;
mod transport;
mod values;

pub(crate) use values::netem as network;

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, Parser, Subcommand};
use mmt_netem::LinkConfig;
use mmt_shared::channel::rate_control::StretchMax;
use mmt_shared::wire::Architecture;

pub(crate) use self::netem::{
    EmulationArguments, NetemArguments, NetemCommand, NetemFileArguments, NetemReportArguments,
    NetemShellArguments, NetemTraceArguments,
};
pub(crate) use bench::{
    BenchArguments, BenchSubject, PlantBenchArguments, TransportBenchArguments,
};
pub(crate) use config::{ConfigArguments, ConfigCommand, ShowArguments};
pub(crate) use console::ConsoleArguments;
pub(crate) use demo::DemoArguments;
pub(crate) use device::{
    DeviceArguments, DeviceListArguments, DeviceTestArguments, DeviceWords, DevicesArguments,
    DevicesCommand, PlugWords,
};
pub(crate) use doctor::{DoctorArguments, ManArguments};
pub(crate) use identity::{
    IdentityArguments, IdentityCommand, IdentityListArguments, RevokeArguments, RotateArguments,
};
pub(crate) use plant::PlantArguments;
#[cfg(feature = "live")]
pub(crate) use records::LiveArguments;
pub(crate) use records::{CheckArguments, ExportArguments, ReplayArguments, ReportArguments};
pub(crate) use reproduce::ReproduceArguments;
pub(crate) use slave::SlaveArguments;
pub(crate) use soak::SoakArguments;
pub(crate) use swarm::SwarmArguments;
pub(crate) use sweep::SweepArguments;
pub(crate) use transport::TransportArguments;
pub(crate) use values::{OperatorWords, PairingWords};

/// The command line.
#[derive(Debug, Parser)]
#[command(name = "mmt", version, about = help::ABOUT, after_help = help::AFTER, arg_required_else_help = true)]
pub(crate) struct Arguments {
    /// What to do.
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Show it at work: slave, emulated network and master on this machine
    #[command(after_help = help::DEMO)]
    Demo(Box<DemoArguments>),
    /// Be the slave: the host with the object
    #[command(after_help = help::SLAVE)]
    Slave(SlaveArguments),
    /// Be the master: the host with the hand
    #[command(after_help = help::MASTER)]
    Master(MasterArguments),
    /// Emulate a network between two hosts: a UDP relay
    #[command(after_help = help::NETEM)]
    Netem(Box<NetemArguments>),
    /// Replay recorded pushes of a real object, or run recorded sessions again to the same bits
    #[command(after_help = help::REPLAY)]
    Replay(Box<ReplayArguments>),
    /// Do recorded sessions keep what is promised? The exit code is the answer
    #[command(after_help = help::CHECK)]
    Check(CheckArguments),
    /// The table and the figures of a recorded run
    #[command(after_help = help::REPORT)]
    Report(ReportArguments),
    /// Tables of a recorded session: comma-separated values, one file a topic
    #[command(after_help = help::EXPORT)]
    Export(ExportArguments),
    /// Show a session in Lichtblick, Foxglove or PlotJuggler while it runs: serves its record as it grows
    #[cfg(feature = "live")]
    #[command(after_help = help::LIVE)]
    Live(LiveArguments),
    /// Reproduce the paper's figures, and go beyond them, in virtual time
    #[command(after_help = help::REPRODUCE, subcommand_required = true, arg_required_else_help = true)]
    Reproduce(ReproduceArguments),
    /// Random worlds with random faults in virtual time, judged as check judges records
    #[command(after_help = help::SWARM)]
    Swarm(SwarmArguments),
    /// Real processes for hours, with random faults: does anything break, leak or grow?
    #[command(after_help = help::SOAK)]
    Soak(SoakArguments),
    /// Run any grid over configuration in virtual time: in shards, resumable, the same bytes
    #[command(after_help = help::SWEEP)]
    Sweep(SweepArguments),
    /// Is this host fit for a 1 kHz loop, and does a slave answer?
    #[command(after_help = help::DOCTOR)]
    Doctor(DoctorArguments),
    /// Haptic devices that can be plugged in: what is there, and does it do
    #[command(after_help = help::DEVICE, subcommand_required = true, arg_required_else_help = true)]
    Device(DevicesArguments),
    /// Who may operate a slave, and who may look on: its tokens
    #[command(after_help = help::IDENTITY, subcommand_required = true, arg_required_else_help = true)]
    Identity(IdentityArguments),
    /// Every key of a configuration: its default, its unit, what is accepted, and where its value comes from
    #[command(after_help = help::CONFIG, subcommand_required = true, arg_required_else_help = true)]
    Config(ConfigArguments),
    /// Print the completions of a shell
    #[command(after_help = help::COMPLETIONS)]
    Completions {
        /// Which shell
        shell: clap_complete::Shell,
    },
    /// Write the manual pages of all commands
    #[command(after_help = help::MAN)]
    Man(ManArguments),
    /// Measure what things cost on this machine
    #[command(after_help = help::BENCH, subcommand_required = true, arg_required_else_help = true)]
    Bench(BenchArguments),
}

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
    #[arg(long, value_name = "N")]
    pub(crate) push: Option<usize>,
    /// How long [default: until the operator has finished, or Ctrl-C]
    #[arg(long, value_name = "TIME", value_parser = values::duration)]
    pub(crate) duration: Option<Duration>,
    /// The haptic device.
    #[command(flatten)]
    pub(crate) device: DeviceArguments,
    /// Configuration, TOML (docs/configuration.md)
    #[arg(long, value_name = "FILE")]
    pub(crate) config: Option<PathBuf>,
    /// Virtual stiffness k_p, N/m [default: the file's, else the device's]
    #[arg(long, value_name = "N_PER_M")]
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
    #[arg(long, value_name = "N")]
    pub(crate) seed: Option<u64>,
    /// HIP samples (1 a millisecond) in a datagram [default: the file's, else 10]
    #[arg(long, value_name = "N", value_parser = values::samples_per_command())]
    pub(crate) samples_per_command: Option<u8>,
    /// What carries the session.
    #[command(flatten)]
    pub(crate) transport: TransportArguments,
    /// How many datagrams before it each datagram repeats the samples of [default: the file's, else 0]
    #[arg(long, value_name = "N", value_parser = values::repeat_samples())]
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

#[cfg(test)]
mod tests;
