//! What demo, slave and master can do with their emulated network besides. It holds options only.

use std::path::PathBuf;

use clap::Args;

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
