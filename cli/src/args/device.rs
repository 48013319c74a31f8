//! The arguments of the hand's device, and of `mmt device`. They hold options only.

use std::net::{Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, Subcommand};
use mmt_client::device::DeviceProfile;
use mmt_client::device::link::DeviceKind;

use super::{help, values};
use crate::failure::Failure;

/// Where the vendor's service listens by itself.
const SERVICE: (Ipv4Addr, u16) = (Ipv4Addr::LOCALHOST, 10_001);

/// A device, in words.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum DeviceWords {
    /// A known one.
    Known(DeviceProfile),
    /// One that is plugged in.
    PluggedIn(DeviceKind),
}

/// Where a device that is plugged in is, in words.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum PlugWords {
    /// It comes to this address.
    Listen(SocketAddr),
    /// The Inverse Service listens there.
    Service(SocketAddr),
    /// At this serial port, or whichever there is.
    Port(Option<PathBuf>),
}

/// A device by its name.
fn device(name: &str) -> Result<DeviceWords, String> {
    let kinds = DeviceKind::ALL;
    if let Some(kind) = kinds.into_iter().find(|kind| kind.name() == name) {
        return Ok(DeviceWords::PluggedIn(kind));
    }
    let known = DeviceProfile::by_name(name).map(DeviceWords::Known);
    let kinds = kinds.map(DeviceKind::name).join(", ");
    known.map_err(|error| format!("{error}, {kinds}"))
}

/// Arguments of every command with a hand.
#[derive(Clone, Debug, Args)]
pub(crate) struct DeviceArguments {
    /// The haptic device: default, falcon, link (one of your own, over UDP), inverse3 or 2diy (docs/plugs.md)
    #[arg(long, value_name = "NAME", default_value = "default", value_parser = device)]
    pub(crate) device: DeviceWords,
    /// Axes, scale, room and limits of a device that is plugged in, TOML
    #[arg(long, value_name = "FILE")]
    pub(crate) device_config: Option<PathBuf>,
    /// Where it is: the service of --device inverse3, ADDR:PORT, or the serial port of --device 2diy
    /// [default: 127.0.0.1:10001; the one board that is there]
    #[arg(long, value_name = "WHERE")]
    pub(crate) device_at: Option<String>,
    /// Where --device link listens [default: 127.0.0.1:0]
    #[arg(long, value_name = "ADDR:PORT", value_parser = values::listen)]
    pub(crate) device_listen: Option<SocketAddr>,
    /// Let --device-listen or --device-at leave this host, where whoever sees a packet can be the hand
    #[arg(long)]
    pub(crate) device_insecure: bool,
}

impl DeviceArguments {
    /// Where the device that is plugged in is; none where it is a known one.
    ///
    /// # Errors
    /// Options of another device, or an address that others can reach without the word that allows it.
    pub(crate) fn plug(&self) -> Result<Option<PlugWords>, Failure> {
        let kind = match self.device {
            DeviceWords::Known(_) => None,
            DeviceWords::PluggedIn(kind) => Some(kind),
        };
        let needs = |option: &str, devices: &str| {
            let what = format!("{option} goes with {devices} only");
            Err(Failure::usage(what).remedy(format!("add {devices}, or leave it out")))
        };
        match kind {
            None if self.device_config.is_some() => {
                needs("--device-config", "--device link, inverse3 or 2diy")
            }
            None if self.device_insecure => {
                needs("--device-insecure", "--device link, inverse3 or 2diy")
            }
            None | Some(DeviceKind::Inverse3 | DeviceKind::TwoDiy)
                if self.device_listen.is_some() =>
            {
                needs("--device-listen", "--device link")
            }
            None | Some(DeviceKind::Link) if self.device_at.is_some() => {
                needs("--device-at", "--device inverse3 or 2diy")
            }
            None => Ok(None),
            Some(DeviceKind::Link) => {
                let insecure = self.device_insecure;
                let listen = plug_address("--device-listen", self.device_listen, insecure)?;
                Ok(Some(PlugWords::Listen(listen)))
            }
            Some(DeviceKind::Inverse3) => self.service().map(PlugWords::Service).map(Some),
            Some(DeviceKind::TwoDiy) => {
                let port = self.device_at.as_ref().map(PathBuf::from);
                Ok(Some(PlugWords::Port(port)))
            }
        }
    }

    fn service(&self) -> Result<SocketAddr, Failure> {
        let at = self.device_at.as_deref().map(service).transpose();
        let at = at.map_err(|why| Failure::usage(format!("--device-at: {why}")))?;
        let at = at.unwrap_or_else(|| SERVICE.into());
        if at.ip().is_loopback() || self.device_insecure {
            return Ok(at);
        }
        let what = format!("--device-at {at}: it is not on this host, and nothing is encrypted");
        Err(Failure::usage(what).remedy(
            "tunnel it through SSH, or add --device-insecure where every host of that network may be the hand",
        ))
    }
}

/// The address of the vendor's service: `127.0.0.1:10001`, also with `ws://` and as `localhost`.
pub(super) fn service(text: &str) -> Result<SocketAddr, String> {
    let bare = text.strip_prefix("ws://").unwrap_or(text);
    let bare = bare.strip_suffix('/').unwrap_or(bare);
    let numeric = bare.replacen("localhost:", "127.0.0.1:", 1);
    let wrong = "write the address of the Inverse Service as ADDR:PORT, such as 127.0.0.1:10001";
    numeric
        .parse()
        .map_err(|_| format!("no address: {text}; {wrong}"))
}

/// Arguments of `mmt device`.
#[derive(Debug, Args)]
pub(crate) struct DevicesArguments {
    /// What to do
    #[command(subcommand)]
    pub(crate) command: DevicesCommand,
}

/// What to do with devices.
#[derive(Debug, Subcommand)]
pub(crate) enum DevicesCommand {
    /// What can be plugged in, and what of it is there
    #[command(after_help = help::DEVICE_LIST)]
    List(DeviceListArguments),
    /// Read a device for some seconds, with no force or a gentle one: its rate, its range, what was lost, a verdict
    #[command(after_help = help::DEVICE_TEST)]
    Test(DeviceTestArguments),
}

/// Arguments of `mmt device list`.
#[derive(Debug, Args)]
pub(crate) struct DeviceListArguments {
    /// Where to look for the Inverse Service [default: 127.0.0.1:10001]
    #[arg(long, value_name = "ADDR:PORT", value_parser = service)]
    service: Option<SocketAddr>,
    /// Print one JSON document instead of lines
    #[arg(long)]
    pub(crate) json: bool,
}

impl DeviceListArguments {
    /// Where to look for the Inverse Service.
    pub(crate) fn service(&self) -> SocketAddr {
        self.service.unwrap_or_else(|| SERVICE.into())
    }
}

/// Arguments of `mmt device test`.
#[derive(Debug, Args)]
pub(crate) struct DeviceTestArguments {
    /// The haptic device.
    #[command(flatten)]
    pub(crate) device: DeviceArguments,
    /// How long, from its first reading on
    #[arg(long, value_name = "TIME", default_value = "5s", value_parser = values::duration, allow_hyphen_values = true)]
    pub(crate) duration: Duration,
    /// A force along the world's x while the hand is held, N, 0 to 2
    #[arg(long, value_name = "N", default_value = "0", value_parser = gentle)]
    pub(crate) force: f64,
    /// Print one JSON document instead of lines
    #[arg(long)]
    pub(crate) json: bool,
}

/// A force that nobody is hurt by, N.
fn gentle(text: &str) -> Result<f64, String> {
    let newtons = text.parse().ok();
    let newtons = newtons.filter(|newtons| (0.0..=2.0).contains(newtons));
    newtons.ok_or_else(|| format!("write newtons from 0 to 2, such as 0.5, not {text}"))
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
