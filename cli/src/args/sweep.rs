//! The arguments of `mmt sweep`. They choose where and how rows run, never what a row is: that is the plan's.

use std::num::NonZero;
use std::path::PathBuf;

use clap::Args;
use mmt_lab::sweep::Shard;

use super::values;

/// Arguments of `mmt sweep`.
#[derive(Clone, Debug, Args)]
pub(crate) struct SweepArguments {
    /// The plan, TOML
    #[arg(value_name = "PLAN.toml")]
    pub(crate) plan: PathBuf,
    /// Configuration below the plan's keys, TOML (docs/configuration.md)
    #[arg(long, value_name = "FILE")]
    pub(crate) config: Option<PathBuf>,
    /// Folder for the rows and results.csv; made if it is not there
    #[arg(long, value_name = "DIR", default_value = "sweep")]
    pub(crate) out: PathBuf,
    /// Run only this share of the rows, such as 2/8 [default: all]
    #[arg(long, value_name = "I/N", default_value_t = Shard::WHOLE, hide_default_value = true)]
    pub(crate) shard: Shard,
    /// Threads [default: as many as the machine has cores]
    #[arg(long, value_name = "N", value_parser = values::jobs, allow_negative_numbers = true)]
    pub(crate) jobs: Option<NonZero<usize>>,
    /// Run nothing: put together what the shards have left in the folder
    #[arg(long, conflicts_with_all = ["shard", "jobs", "dry_run"])]
    pub(crate) merge: bool,
    /// Run nothing: check the plan, and print how many rows there are, the first and the last
    #[arg(long)]
    pub(crate) dry_run: bool,
    /// Print the summary as one JSON document
    #[arg(long)]
    pub(crate) json: bool,
}
