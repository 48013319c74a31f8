//! The arguments of `mmt bench`.

use std::path::PathBuf;
use std::time::Duration;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args, Subcommand};
use mmt_lab::io::transport_bench::{BYTES_MAX, BYTES_MIN, Cores, RATE_MAX};

use mmt_netem::LinkConfig;
use mmt_server::trigger::Scheme;

use super::{PlantArguments, values};

/// Arguments of `mmt bench`.
#[derive(Debug, Args)]
pub(crate) struct BenchArguments {
    /// What to measure.
    #[command(subcommand)]
    pub(crate) subject: BenchSubject,
}

/// What can be measured.
#[derive(Debug, Subcommand)]
pub(crate) enum BenchSubject {
    /// Latency, CPU time, packets and bytes of a message over raw UDP and QUIC, on loopback
    Transport(TransportBenchArguments),
    /// How well an object is felt in virtual time: the simulated one, or a plant of your own in lock-step
    Plant(Box<PlantBenchArguments>),
}

/// Arguments of `mmt bench plant`.
#[derive(Clone, Debug, Args)]
pub(crate) struct PlantBenchArguments {
    /// What the tool meets.
    #[command(flatten)]
    pub(crate) plant: PlantArguments,
    /// How long the scripted operator pushes, in virtual time
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = values::duration, allow_hyphen_values = true)]
    pub(crate) duration: Duration,
    /// Emulated network in each direction
    #[arg(long, value_name = "WORDS", default_value = "delay 50ms 5ms loss 1%", value_parser = values::netem)]
    pub(crate) netem: LinkConfig,
    /// Configuration, TOML, of which the slave's keys alone count
    #[arg(long, value_name = "FILE")]
    pub(crate) config: Option<PathBuf>,
    /// When updates are sent [default: the file's, else the mode's]
    #[arg(long, value_name = "WORDS", value_parser = values::scheme)]
    pub(crate) scheme: Option<Scheme>,
    /// Seed of operator, sensors and network
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = values::seed, allow_negative_numbers = true)]
    pub(crate) seed: u64,
    /// Print one JSON document instead of a table
    #[arg(long)]
    pub(crate) json: bool,
}

/// Arguments of `mmt bench transport`.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct TransportBenchArguments {
    /// Messages a second
    #[arg(long, value_name = "HZ", default_value_t = 1000, value_parser = values::whole::<u32>(1, RATE_MAX.into()), allow_negative_numbers = true)]
    pub(crate) rate: u32,
    /// How long, all turns of all carriers together
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = values::duration, allow_hyphen_values = true)]
    pub(crate) duration: Duration,
    /// Bytes of a message
    #[arg(long, value_name = "BYTES", default_value_t = 100, value_parser = values::whole::<u16>(BYTES_MIN as u64, BYTES_MAX as u64), allow_negative_numbers = true)]
    pub(crate) size: u16,
    /// Where the two ends run
    #[arg(long, default_value = "own", value_parser = cores())]
    pub(crate) cores: Cores,
    /// Print one JSON document instead of tables
    #[arg(long)]
    pub(crate) json: bool,
}

fn cores() -> impl TypedValueParser<Value = Cores> {
    let own = PossibleValue::new("own")
        .help("Each on a core of its own that stays awake, as on two hosts set up for low latency");
    let any = PossibleValue::new("any").help("Where the kernel puts them, often both on one core");
    PossibleValuesParser::new([own, any]).map(|name| {
        if name == "any" {
            Cores::Any
        } else {
            Cores::Own
        }
    })
}
