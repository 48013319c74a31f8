//! The arguments of `mmt doctor`.

use clap::Args;

use super::values::PairingWords;

/// Arguments of `mmt doctor`.
#[derive(Debug, Args)]
pub(crate) struct DoctorArguments {
    /// Look at the path to this slave as well: what `mmt slave` printed, in quotes; - reads it from stdin
    #[arg(value_name = "PAIRING")]
    pub(crate) pairing: Option<PairingWords>,
    /// Print one JSON document instead of lines
    #[arg(long)]
    pub(crate) json: bool,
}
