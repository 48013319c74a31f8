//! The hand's device as a command uses it: a known one, or one that is plugged in.

use std::sync::Mutex;

use mmt_client::device::DeviceProfile;
use mmt_client::device::link::DeviceLinkConfig;
use mmt_client::io::device::ports::{SerialPort, serial_ports};
use mmt_client::io::device::{DeviceAddress, DeviceHost, DeviceHostError};
use mmt_client::io::{MasterOptions, OperatorChoice};
use mmt_client::operator::pointer::{Driver, HandTuning};
use mmt_shared::io::plug_socket::PlugSocketError;

use crate::args::{DeviceArguments, DeviceWords, PlugWords};
use crate::config::device_config;
use crate::failure::{Exit, Failure};
use crate::output::note;

/// The device of a command.
pub(in crate::commands) struct Device {
    /// What it can do.
    pub(in crate::commands) profile: DeviceProfile,
    pub(super) plugged_in: Option<(DeviceHost, HandTuning)>,
}

impl Device {
    /// The device that the arguments name, used with this stiffness (N/m) if one is given. Where it is to be plugged in it
    /// is served from now on, and its address is noted.
    ///
    /// # Errors
    /// Wrong input, an address that cannot be had, or a device that does not answer.
    pub(in crate::commands) fn start(
        arguments: &DeviceArguments,
        stiffness: Option<f64>,
    ) -> Result<Self, Failure> {
        let profile = profile(arguments, stiffness)?;
        let plug = arguments.plug()?.map(address).transpose()?;
        let plugged_in = match (&arguments.device, plug) {
            (DeviceWords::PluggedIn(kind), Some(at)) => {
                let config = device_config(*kind, arguments.device_config.as_deref())?;
                let host = DeviceHost::start(&at, config).map_err(failure)?;
                note(format_args!("device: {}", host.address()));
                Some((host, config.tuning()))
            }
            _ => None,
        };
        Ok(Self {
            profile,
            plugged_in,
        })
    }

    /// Gives the session that begins this device; one that is plugged in is the hand, whoever else was to be.
    pub(in crate::commands) fn give(&self, options: &mut MasterOptions) {
        options.device = self.profile;
        let Some((host, tuning)) = &self.plugged_in else {
            return;
        };
        options.device_port = Mutex::new(Some(host.port()));
        if let OperatorChoice::Scripted(scripted) | OperatorChoice::Person { scripted, .. } =
            options.operator
        {
            options.operator = OperatorChoice::Person {
                scripted,
                driver: Driver::Pointer,
                device: Some(*tuning),
            };
        }
    }
}

/// What the device that the arguments name can do, used with this stiffness (N/m) if one is given.
///
/// # Errors
/// Wrong input.
pub(in crate::commands) fn profile(
    arguments: &DeviceArguments,
    stiffness: Option<f64>,
) -> Result<DeviceProfile, Failure> {
    // what goes with no plug is named before what is wrong with it
    arguments.plug()?;
    let profile = match &arguments.device {
        DeviceWords::Known(profile) => profile.used_with(stiffness, None),
        DeviceWords::PluggedIn(kind) => {
            let config = device_config(*kind, arguments.device_config.as_deref())?;
            DeviceProfile::plugged_in(&DeviceLinkConfig {
                stiffness_n_per_m: stiffness.unwrap_or(config.stiffness_n_per_m),
                ..config
            })
        }
    };
    profile.map_err(|error| match stiffness {
        Some(_) => Failure::usage(format!("--stiffness: {error}")),
        None => Failure::usage(error),
    })
}

/// Where the device is: a 2DIY without a port is at the one board that is there.
///
/// # Errors
/// There is none, or more than one.
pub(super) fn address(words: PlugWords) -> Result<DeviceAddress, Failure> {
    let port = match words {
        PlugWords::Listen(listen) => return Ok(DeviceAddress::Link(listen)),
        PlugWords::Service(at) => return Ok(DeviceAddress::Inverse3(at)),
        PlugWords::Port(Some(port)) => return Ok(DeviceAddress::TwoDiy(port)),
        PlugWords::Port(None) => serial_ports(),
    };
    let boards: Vec<_> = port.iter().filter(|port| port.looks_like_a_board).collect();
    match boards.as_slice() {
        [SerialPort { port, .. }] => Ok(DeviceAddress::TwoDiy(port.clone())),
        [] => Err(
            Failure::usage("no serial port looks like the board of a 2DIY").remedy(
                "plug it in, or name its port: --device-at /dev/tty…; mmt device list shows all",
            ),
        ),
        _ => Err(
            Failure::usage("more than one serial port looks like the board of a 2DIY")
                .remedy("name the one: --device-at /dev/tty…; mmt device list shows all"),
        ),
    }
}

pub(super) fn failure(error: DeviceHostError) -> Failure {
    match error {
        DeviceHostError::Socket(PlugSocketError::Listen { .. }) => {
            Failure::new(Exit::Address, error)
                .remedy("give another --device-listen address, or port 0 for any free port")
        }
        DeviceHostError::Config(_) => {
            Failure::usage(error).remedy("change that number in --device-config")
        }
        DeviceHostError::Service { .. } => Failure::new(Exit::NoAnswer, error)
            .remedy("start the Haply Hub or the Inverse Service, or name its address: --device-at"),
        DeviceHostError::Port { .. } => Failure::usage(error).remedy(
            "check the path (mmt device list), and that you may use it: often the group dialout",
        ),
        DeviceHostError::Socket(_) | DeviceHostError::Thread(_) => Failure::failed(error),
    }
}
