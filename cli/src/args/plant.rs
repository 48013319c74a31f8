//! The arguments of what the tool meets. They hold options only.

use std::net::SocketAddr;

use clap::Args;

use super::device::plug_address;
use super::values;
use crate::failure::Failure;

/// Arguments of a command with an object.
#[derive(Clone, Debug, Args)]
pub(crate) struct PlantArguments {
    /// What the tool meets: the simulated world, or a plant of your own over UDP (docs/plugs.md) [default: the file's, else world]
    #[arg(long, value_name = "NAME", value_parser = values::plant())]
    plant: Option<bool>,
    /// Where --plant link listens [default: 127.0.0.1:0]
    #[arg(long, value_name = "ADDR:PORT", value_parser = values::listen)]
    plant_listen: Option<SocketAddr>,
    /// Let --plant-listen leave this host, where whoever sees a packet can be the plant
    #[arg(long, requires = "plant_listen")]
    plant_insecure: bool,
}

impl PlantArguments {
    /// Whether a plant is to be plugged in: the command line comes before the file.
    ///
    /// # Errors
    /// An address for one where none is.
    pub(crate) fn is_linked(&self, of_file: bool) -> Result<bool, Failure> {
        let linked = self.plant.unwrap_or(of_file);
        if !linked && self.plant_listen.is_some() {
            let what = "--plant-listen goes with --plant link only";
            return Err(Failure::usage(what).remedy("add --plant link, or leave it out"));
        }
        Ok(linked)
    }

    /// Where the plug listens.
    ///
    /// # Errors
    /// An address that others can reach, without the word that allows it.
    pub(crate) fn listen(&self) -> Result<SocketAddr, Failure> {
        plug_address("--plant-listen", self.plant_listen, self.plant_insecure)
    }
}
