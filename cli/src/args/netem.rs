//! The arguments of `mmt netem`, and what demo, slave and master can do with their emulated network besides.

use std::ffi::OsString;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, Subcommand};
use mmt_netem::LinkConfig;
use mmt_shared::pairing::Address;

use super::values;

/// Record and control of an emulated network.
#[derive(Clone, Debug, Args)]
pub(crate) struct EmulationArguments {
    /// Record every datagram that meets the emulated network in this file, as mmt netem --record does
    #[arg(long, value_name = "FILE")]
    pub(crate) netem_record: Option<PathBuf>,
    /// Take new networks from stdin while running, one a line: up WORDS, down WORDS; no live view
    #[arg(long)]
    pub(crate) netem_control: bool,
}

/// Arguments of `mmt netem`.
#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub(crate) struct NetemArguments {
    #[command(subcommand)]
    pub(crate) command: Option<NetemCommand>,
    /// Address and UDP port to listen on for masters; port 0 lets the system choose
    #[arg(long, value_name = "ADDR:PORT", value_parser = values::listen, required = true)]
    pub(crate) listen: Option<SocketAddr>,
    /// The slave: host and UDP port
    #[arg(long, value_name = "HOST:PORT", value_parser = values::address, required = true)]
    pub(crate) to: Option<Address>,
    /// Network from master to slave
    #[arg(long, value_name = "WORDS", default_value = "none", value_parser = values::netem)]
    pub(crate) up: LinkConfig,
    /// Network from slave to master
    #[arg(long, value_name = "WORDS", default_value = "none", value_parser = values::netem)]
    pub(crate) down: LinkConfig,
    /// Seed of both
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = values::seed, allow_negative_numbers = true)]
    pub(crate) seed: u64,
    /// Packets per second for which the effect of the networks is printed at the start
    #[arg(long, value_name = "N", default_value_t = 100.0, value_parser = values::number, allow_negative_numbers = true)]
    pub(crate) rate: f64,
    /// Length of these packets, bytes of UDP payload
    #[arg(long, value_name = "N", default_value_t = mmt_netem::effect::BYTES, value_parser = values::whole::<usize>(0, 65_507), allow_negative_numbers = true)]
    pub(crate) bytes: usize,
    /// Masters at one time; one more takes the place of one that does not talk with the slave, or is turned away
    #[arg(long, value_name = "N", default_value_t = mmt_netem::io::relay::CLIENTS, value_parser = values::whole::<usize>(1, 65_535), allow_negative_numbers = true)]
    pub(crate) clients: usize,
    #[command(flatten)]
    pub(crate) files: NetemFileArguments,
    /// Give every master a new port toward the slave this often, as a NAT that forgets
    #[arg(long, value_name = "TIME", value_parser = values::duration, allow_hyphen_values = true)]
    pub(crate) rebind: Option<Duration>,
    /// Take commands from stdin while running, one a line: up WORDS, down WORDS, rebind
    #[arg(long)]
    pub(crate) control: bool,
    /// How long [default: until Ctrl-C]
    #[arg(long, value_name = "TIME", value_parser = values::duration, allow_hyphen_values = true)]
    pub(crate) duration: Option<Duration>,
    /// Print the counters as JSON, after the address
    #[arg(long)]
    pub(crate) json: bool,
}

/// The files that packets are written to.
#[derive(Debug, Args)]
pub(crate) struct NetemFileArguments {
    /// Record every packet in this file: CSV if its name ends in .csv, else a compact form
    #[arg(long, value_name = "FILE")]
    pub(crate) record: Option<PathBuf>,
    /// Write every packet, as it comes and as it leaves, to this file (pcapng), with its fate as a comment
    #[arg(long, value_name = "FILE")]
    pub(crate) pcap: Option<PathBuf>,
}

/// What else `mmt netem` does.
#[derive(Debug, Subcommand)]
pub(crate) enum NetemCommand {
    /// Compare a record with the settings it was made with
    Report(NetemReportArguments),
    /// Make a record of a real path from captures at both its ends
    Trace(NetemTraceArguments),
    /// Run a command with all its IP traffic through the emulated networks
    Shell(Box<NetemShellArguments>),
}

/// Arguments of `mmt netem shell`.
#[derive(Debug, Args)]
pub(crate) struct NetemShellArguments {
    /// Network for what the command sends
    #[arg(long, value_name = "WORDS", default_value = "none", value_parser = values::netem)]
    pub(crate) up: LinkConfig,
    /// Network for what it receives
    #[arg(long, value_name = "WORDS", default_value = "none", value_parser = values::netem)]
    pub(crate) down: LinkConfig,
    /// Seed of both
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = values::seed, allow_negative_numbers = true)]
    pub(crate) seed: u64,
    /// Run this shell command at the other end, in a network of its own, instead of leading to the host's network; needs
    /// no root
    #[arg(long, value_name = "COMMAND")]
    pub(crate) beside: Option<String>,
    #[command(flatten)]
    pub(crate) files: NetemFileArguments,
    /// Write the counters as JSON to this file at the end
    #[arg(long, value_name = "FILE")]
    pub(crate) report: Option<PathBuf>,
    /// What to run: a program and its arguments
    #[arg(value_name = "COMMAND", required = true, last = true)]
    pub(crate) command: Vec<OsString>,
}

/// Arguments of `mmt netem trace`.
#[derive(Debug, Args)]
pub(crate) struct NetemTraceArguments {
    /// Capture at one end (pcap or pcapng): up is from there
    #[arg(value_name = "FROM")]
    pub(crate) from: PathBuf,
    /// Capture of the same time at the other end
    #[arg(value_name = "TO")]
    pub(crate) to: PathBuf,
    /// Where the record goes, CSV [default: stdout]
    #[arg(long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
    /// Believe the clocks: both captures were made by one clock, or by two that agree
    #[arg(long)]
    pub(crate) same_clock: bool,
}

/// Arguments of `mmt netem report`.
#[derive(Debug, Args)]
pub(crate) struct NetemReportArguments {
    /// A record made with --record
    #[arg(value_name = "FILE")]
    pub(crate) file: PathBuf,
    /// Print all numbers, and bars of the delays, the bursts of loss and the packets in flight
    #[arg(long, conflicts_with = "json")]
    pub(crate) full: bool,
    /// Print everything as one JSON document: the numbers, delay histogram, loss bursts, queue
    #[arg(long)]
    pub(crate) json: bool,
}
