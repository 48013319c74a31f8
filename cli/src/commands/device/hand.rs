//! The hand's device as a command uses it: a known one, or one that is plugged in.

use std::path::Path;
use std::sync::Mutex;

use mmt_client::device::link::DeviceLinkConfig;
use mmt_client::device::{DeviceError, DeviceProfile};
use mmt_client::io::device::ports::{SerialPort, serial_ports};
use mmt_client::io::device::{DeviceAddress, DeviceHost, DeviceHostError};
use mmt_client::io::{MasterOptions, OperatorChoice};
use mmt_client::operator::pointer::{Driver, HandTuning};
use mmt_lab::layers::Program;
use mmt_lab::world::WorldConfig;
use mmt_shared::io::plug_socket::PlugSocketError;

use crate::args::{DeviceArguments, DeviceWords, PlugWords};
use crate::config::{ConfigFile, Flags, device_config};
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

/// A device before anybody uses it.
enum Unused {
    Known(DeviceProfile),
    PluggedIn(DeviceLinkConfig),
}

impl Unused {
    fn of(arguments: &DeviceArguments) -> Result<Self, Failure> {
        // what goes with no plug is named before what is wrong with it
        arguments.plug()?;
        Ok(match &arguments.device {
            DeviceWords::Known(profile) => Self::Known(*profile),
            DeviceWords::PluggedIn(kind) => {
                Self::PluggedIn(device_config(*kind, arguments.device_config.as_deref())?)
            }
        })
    }

    /// This device used with this stiffness (N/m) if one is given.
    fn used_with(&self, stiffness: Option<f64>) -> Result<DeviceProfile, DeviceError> {
        match self {
            Self::Known(profile) => profile.used_with(stiffness, None),
            Self::PluggedIn(config) => DeviceProfile::plugged_in(&DeviceLinkConfig {
                stiffness_n_per_m: stiffness.unwrap_or(config.stiffness_n_per_m),
                ..*config
            }),
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
    let used = Unused::of(arguments)?.used_with(stiffness);
    used.map_err(Failure::usage)
}

/// The configuration of a program with a hand, with whose stiffness the device that the arguments name can be used.
///
/// # Errors
/// As [`crate::config::configuration`], and what is wrong with the device.
pub(in crate::commands) fn configuration(
    program: Program,
    path: Option<&Path>,
    flags: &Flags,
    arguments: &DeviceArguments,
) -> Result<WorldConfig, Failure> {
    let device = Unused::of(arguments)?;
    ConfigFile::read(path)?.with(program, flags, |layers| {
        layers.config_with(|stiffness| device.used_with(Some(stiffness)).map(drop))
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
