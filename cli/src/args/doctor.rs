//! The arguments of the commands about this host and this program: `mmt doctor`, `mmt man`.

use std::path::PathBuf;

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

/// Arguments of `mmt man`.
#[derive(Debug, Args)]
pub(crate) struct ManArguments {
    /// Folder for the pages; made if it is not there
    #[arg(long, value_name = "DIR", default_value = "man")]
    pub(crate) out: PathBuf,
}
