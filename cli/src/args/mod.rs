//! The arguments of every command, as clap takes them, with help and examples.

mod bench;
mod config;
mod console;
mod demo;
mod device;
mod doctor;
mod help;
mod identity;
mod master;
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

use clap::{Parser, Subcommand};

pub(crate) use self::netem::{
    EmulationArguments, NetemArguments, NetemCommand, NetemFileArguments, NetemReportArguments,
    NetemShellArguments, NetemTraceArguments,
};
pub(crate) use bench::{
    BenchArguments, BenchSubject, PlantBenchArguments, TransportBenchArguments,
};
pub(crate) use config::{ConfigArguments, ConfigCommand, ShowArguments};
pub(crate) use console::{ConsoleArguments, hinted};
pub(crate) use demo::DemoArguments;
pub(crate) use device::{
    DeviceArguments, DeviceListArguments, DeviceTestArguments, DeviceWords, DevicesArguments,
    DevicesCommand, PlugWords,
};
pub(crate) use doctor::{DoctorArguments, ManArguments};
pub(crate) use identity::{
    IdentityArguments, IdentityCommand, IdentityListArguments, RevokeArguments, RotateArguments,
};
pub(crate) use master::MasterArguments;
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

#[cfg(test)]
mod tests;
