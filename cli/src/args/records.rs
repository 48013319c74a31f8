//! The arguments of the commands that take what was recorded: replay, check, report, export.

use std::path::PathBuf;

use clap::Args;
use mmt_lab::replay::ReplayConfig;
use mmt_netem::LinkConfig;
use mmt_server::trigger::Scheme;

use super::values::{self, Period};

/// Arguments of `mmt replay`.
#[derive(Debug, Args)]
pub(crate) struct ReplayArguments {
    /// Recorded pushes; or records of sessions (MCAP), of which --deadband, --t-update, --splits and --seed change
    /// nothing
    #[arg(value_name = "FILE", required = true)]
    pub(crate) files: Vec<PathBuf>,
    /// Delta of (12): the force error that calls for an update
    #[arg(long, value_name = "PERCENT", default_value = "10%", value_parser = values::deadband)]
    pub(crate) deadband: f64,
    /// Longest time without an update in contact; none for the pure deadband
    #[arg(long, value_name = "TIME", default_value = "150ms", value_parser = values::period)]
    pub(crate) t_update: Period,
    /// Of records: what if updates were sent by this scheme
    #[arg(long, value_name = "WORDS", value_parser = values::scheme)]
    pub(crate) scheme: Option<Scheme>,
    /// Of records: what if this were the network in each direction
    #[arg(long, value_name = "WORDS", value_parser = values::netem)]
    pub(crate) netem: Option<LinkConfig>,
    /// Of records: what if this were the network from master to slave [default: --netem]
    #[arg(long, value_name = "WORDS", value_parser = values::netem)]
    pub(crate) netem_up: Option<LinkConfig>,
    /// Of records: what if this were the network from slave to master [default: --netem]
    #[arg(long, value_name = "WORDS", value_parser = values::netem)]
    pub(crate) netem_down: Option<LinkConfig>,
    /// Random splits into fitted and held-out pushes
    #[arg(long, value_name = "N", default_value_t = ReplayConfig::default().repeats, value_parser = values::whole::<u32>(1, 10_000), allow_negative_numbers = true)]
    pub(crate) splits: u32,
    /// Seed of the splits
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = values::seed, allow_negative_numbers = true)]
    pub(crate) seed: u64,
    /// Print one JSON document instead of tables
    #[arg(long)]
    pub(crate) json: bool,
}

/// Arguments of `mmt check`.
#[derive(Debug, Args)]
pub(crate) struct CheckArguments {
    /// Records of one run made with --record: of a demo, of one host, or of both hosts
    #[arg(value_name = "FILE", required = true)]
    pub(crate) files: Vec<PathBuf>,
    /// Print one JSON document instead of a table
    #[arg(long)]
    pub(crate) json: bool,
}

/// Arguments of `mmt report`.
#[derive(Debug, Args)]
pub(crate) struct ReportArguments {
    /// Records of one run made with --record: of a demo, or of both hosts
    #[arg(value_name = "FILE", required = true)]
    pub(crate) files: Vec<PathBuf>,
    /// Folder for CSV and SVG; made if it is not there
    #[arg(long, value_name = "DIR", default_value = "report")]
    pub(crate) out: PathBuf,
    /// Print one JSON document instead of tables
    #[arg(long)]
    pub(crate) json: bool,
}

/// Arguments of `mmt live`.
#[cfg(feature = "live")]
#[derive(Debug, Args)]
pub(crate) struct LiveArguments {
    /// The record that a running --record writes, or will write
    #[arg(value_name = "FILE")]
    pub(crate) file: PathBuf,
    /// Port on 127.0.0.1; 0: any that is free
    #[arg(long, value_name = "PORT", default_value_t = 8765, value_parser = values::whole::<u16>(0, 65_535), allow_negative_numbers = true)]
    pub(crate) port: u16,
}

/// Arguments of `mmt export`.
#[derive(Debug, Args)]
pub(crate) struct ExportArguments {
    /// A record made with --record
    #[arg(value_name = "FILE")]
    pub(crate) file: PathBuf,
    /// Folder for the tables; made if it is not there
    #[arg(long, value_name = "DIR", default_value = "tables")]
    pub(crate) out: PathBuf,
}
