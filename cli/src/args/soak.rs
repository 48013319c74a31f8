//! The arguments of `mmt soak`.

use std::path::PathBuf;

use clap::Args;

use super::values;

/// Arguments of `mmt soak`.
#[derive(Debug, Args)]
pub(crate) struct SoakArguments {
    /// How long, in hours
    #[arg(long, value_name = "H", default_value_t = 1.0, value_parser = values::hours)]
    pub(crate) hours: f64,
    /// Seed of hands, networks and faults
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = values::seed, allow_negative_numbers = true)]
    pub(crate) seed: u64,
    /// Folder for the records of the cycle that runs, and of those in which something broke; made if it is not there
    #[arg(long, value_name = "DIR", default_value = "soak")]
    pub(crate) out: PathBuf,
    /// Print one JSON document instead of a table
    #[arg(long)]
    pub(crate) json: bool,
}
