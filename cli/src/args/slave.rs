//! The arguments of `mmt slave`.

use std::net::SocketAddr;
use std::path::PathBuf;

use clap::Args;
use mmt_netem::LinkConfig;
use mmt_server::repeats::Repeats;
use mmt_server::trigger::Scheme;
use mmt_shared::channel::rate_control::StretchMax;
use mmt_shared::model::settings::Mode;
use mmt_shared::pairing::Host;

use super::{EmulationArguments, PlantArguments, TransportArguments, values};

/// Arguments of `mmt slave`.
#[derive(Debug, Args)]
pub(crate) struct SlaveArguments {
    /// Address and UDP port to listen on; port 0 lets the system choose
    #[arg(long, value_name = "ADDR:PORT", value_parser = values::listen)]
    pub(crate) listen: SocketAddr,
    /// The bundle of choices [default: the file's, else recommended]
    #[arg(long, value_name = "NAME", value_parser = values::mode())]
    pub(crate) mode: Option<Mode>,
    /// When updates are sent, such as "hybrid 10% 150ms" [default: the file's, else the mode's]
    #[arg(long, value_name = "WORDS", value_parser = values::scheme)]
    pub(crate) scheme: Option<Scheme>,
    /// When an update is repeated, such as "10ms 30ms", or none [default: the file's, else the mode's]
    #[arg(long, value_name = "WORDS")]
    pub(crate) repeats: Option<Repeats>,
    /// Greatest factor that congestion may stretch Delta and T_update by; 1: off [default: the file's, else the
    /// mode's]
    #[arg(long, value_name = "FACTOR")]
    pub(crate) stretch_max: Option<StretchMax>,
    /// Configuration, TOML (docs/configuration.md)
    #[arg(long, value_name = "FILE")]
    pub(crate) config: Option<PathBuf>,
    /// Bodies and walls, TOML [default: the configuration's, else one cube]
    #[arg(long, value_name = "FILE")]
    pub(crate) scene: Option<PathBuf>,
    /// What the tool meets.
    #[command(flatten)]
    pub(crate) plant: PlantArguments,
    /// Emulated network on what the slave sends [default: the file's, else none]
    #[arg(long, value_name = "WORDS", value_parser = values::netem)]
    pub(crate) netem: Option<LinkConfig>,
    /// Record and control of the emulated network
    #[command(flatten)]
    pub(crate) emulation: EmulationArguments,
    /// Record the slave's sessions in this file, MCAP: for mmt replay, report, export and the tools of ROS 2
    #[arg(long, value_name = "FILE")]
    pub(crate) record: Option<PathBuf>,
    /// Seed of sensors and network [default: the file's, else 1]
    #[arg(long, value_name = "N", value_parser = values::seed, allow_negative_numbers = true)]
    pub(crate) seed: Option<u64>,
    /// Directory that keeps certificate, key and tokens (mmt identity) [default: $XDG_STATE_HOME/mmt]
    #[arg(long, value_name = "DIR")]
    pub(crate) identity: Option<PathBuf>,
    /// What carries the session.
    #[command(flatten)]
    pub(crate) transport: TransportArguments,
    /// How many observers may look on at a time, 0 to 64
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = values::observers, allow_negative_numbers = true)]
    pub(crate) observers: u8,
    /// End after the first session
    #[arg(long)]
    pub(crate) once: bool,
    /// Print every number of the report; without it a sentence and ten lines
    #[arg(long, conflicts_with = "json")]
    pub(crate) full: bool,
    /// Print the report of the last session as JSON, after the pairing string
    #[arg(long)]
    pub(crate) json: bool,
    /// Host name or address in the pairing string [default: the address listened on]
    #[arg(long, value_name = "HOST", value_parser = values::host)]
    pub(crate) advertise: Option<Host>,
}
