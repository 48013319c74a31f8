//! The arguments of `mmt swarm`.

use std::num::NonZero;
use std::time::Duration;

use clap::Args;

use super::values;

/// Arguments of `mmt swarm`.
#[derive(Debug, Args)]
pub(crate) struct SwarmArguments {
    /// How many seeds, from --first on
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = values::whole::<u64>(1, 1_000_000), allow_negative_numbers = true)]
    pub(crate) seeds: u64,
    /// The first seed
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = values::seed, allow_negative_numbers = true)]
    pub(crate) first: u64,
    /// Only this seed, with its faults
    #[arg(long, value_name = "N", conflicts_with_all = ["seeds", "first"], value_parser = values::seed, allow_negative_numbers = true)]
    pub(crate) seed: Option<u64>,
    /// Length of a run, in virtual time
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = values::duration, allow_hyphen_values = true)]
    pub(crate) duration: Duration,
    /// Threads [default: as many as the machine has cores]
    #[arg(long, value_name = "N", value_parser = values::jobs, allow_negative_numbers = true)]
    pub(crate) jobs: Option<NonZero<usize>>,
    /// Print one JSON document instead of a table
    #[arg(long)]
    pub(crate) json: bool,
}
