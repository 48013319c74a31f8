//! The arguments of the hand's device. They hold options only.

use std::net::{Ipv4Addr, SocketAddr};
use std::path::PathBuf;

use clap::Args;
use mmt_client::device::DeviceProfile;

use super::values;
use crate::failure::Failure;

/// A device, in words.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum DeviceWords {
    /// A known one.
    Known(DeviceProfile),
    /// One that is plugged in.
    Link,
}

/// A device by its name.
fn device(name: &str) -> Result<DeviceWords, String> {
    if name == "link" {
        return Ok(DeviceWords::Link);
    }
    let known = DeviceProfile::by_name(name).map(DeviceWords::Known);
    known.map_err(|error| format!("{error}, link"))
}

/// Arguments of every command with a hand.
#[derive(Clone, Debug, Args)]
pub(crate) struct DeviceArguments {
    /// The haptic device: default, falcon, or link (one of your own, over UDP; docs/plugs.md)
    #[arg(long, value_name = "NAME", default_value = "default", value_parser = device)]
    pub(crate) device: DeviceWords,
    /// Axes, scale, room and limits of --device link, TOML
    #[arg(long, value_name = "FILE")]
    pub(crate) device_config: Option<PathBuf>,
    /// Where --device link listens [default: 127.0.0.1:0]
    #[arg(long, value_name = "ADDR:PORT", value_parser = values::listen)]
    pub(crate) device_listen: Option<SocketAddr>,
    /// Let --device-listen leave this host, where whoever sees a packet can be the hand
    #[arg(long, requires = "device_listen")]
    pub(crate) device_insecure: bool,
}

impl DeviceArguments {
    /// Where the plug listens; none where the device is a known one.
    ///
    /// # Errors
    /// Options of a plug without one, or an address that others can reach without the word that allows it.
    pub(crate) fn plug(&self) -> Result<Option<SocketAddr>, Failure> {
        if self.device != DeviceWords::Link {
            let unused = self.device_config.is_some() || self.device_listen.is_some();
            return if unused {
                let what = "--device-config and --device-listen go with --device link only";
                Err(Failure::usage(what).remedy("add --device link, or leave them out"))
            } else {
                Ok(None)
            };
        }
        plug_address("--device-listen", self.device_listen, self.device_insecure).map(Some)
    }
}

/// Where a plug listens: by itself on loopback.
///
/// # Errors
/// An address that others can reach, without the word that allows it.
pub(super) fn plug_address(
    option: &str,
    listen: Option<SocketAddr>,
    insecure: bool,
) -> Result<SocketAddr, Failure> {
    let listen = listen.unwrap_or((Ipv4Addr::LOCALHOST, 0).into());
    if listen.ip().is_loopback() || insecure {
        return Ok(listen);
    }
    let what = format!("{option} {listen}: others could reach it, and nothing of it is encrypted");
    let insecure = option.replace("listen", "insecure");
    Err(Failure::usage(what).remedy(format!(
        "leave the address out, or add {insecure} where every host of that network may see the token"
    )))
}
