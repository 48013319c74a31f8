//! The hand's device as a command uses it: a known one, or one that is plugged in.

use std::sync::Mutex;

use mmt_client::device::DeviceProfile;
use mmt_client::device::link::DeviceLinkConfig;
use mmt_client::io::device_link::{DeviceHost, DeviceHostError};
use mmt_client::io::{MasterOptions, OperatorChoice};
use mmt_client::operator::pointer::{Driver, HandTuning};
use mmt_shared::io::plug_socket::PlugSocketError;

use crate::args::{DeviceArguments, DeviceWords};
use crate::config::device_config;
use crate::failure::{Exit, Failure};
use crate::output::note;

/// The device of a command.
pub(super) struct Device {
    /// What it can do.
    pub(super) profile: DeviceProfile,
    plugged_in: Option<(DeviceHost, HandTuning)>,
}

impl Device {
    /// The device that the arguments name, used with this stiffness (N/m) if one is given. Where it is to be plugged in it
    /// listens from now on, and the address is noted.
    ///
    /// # Errors
    /// Wrong input, or an address that cannot be had.
    pub(super) fn start(
        arguments: &DeviceArguments,
        stiffness: Option<f64>,
    ) -> Result<Self, Failure> {
        let listen = arguments.plug()?;
        let config = device_config(arguments.device_config.as_deref())?;
        let profile = profile(arguments, stiffness)?;
        let plugged_in = listen.map(|listen| {
            let host = DeviceHost::start(listen, config).map_err(failure)?;
            note(format_args!("device: {}", host.address()));
            Ok::<_, Failure>((host, config.tuning()))
        });
        Ok(Self {
            profile,
            plugged_in: plugged_in.transpose()?,
        })
    }

    /// Gives the session that begins this device; one that is plugged in is the hand, whoever else was to be.
    pub(super) fn give(&self, options: &mut MasterOptions) {
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
pub(super) fn profile(
    arguments: &DeviceArguments,
    stiffness: Option<f64>,
) -> Result<DeviceProfile, Failure> {
    // what goes with no plug is named before what is wrong with it
    arguments.plug()?;
    let config = device_config(arguments.device_config.as_deref())?;
    let profile = match &arguments.device {
        DeviceWords::Known(profile) => profile.used_with(stiffness, None),
        DeviceWords::Link => DeviceProfile::plugged_in(&DeviceLinkConfig {
            stiffness_n_per_m: stiffness.unwrap_or(config.stiffness_n_per_m),
            ..config
        }),
    };
    profile.map_err(|error| match stiffness {
        Some(_) => Failure::usage(format!("--stiffness: {error}")),
        None => Failure::usage(error),
    })
}

fn failure(error: DeviceHostError) -> Failure {
    match error {
        DeviceHostError::Socket(PlugSocketError::Listen { .. }) => {
            Failure::new(Exit::Address, error)
                .remedy("give another --device-listen address, or port 0 for any free port")
        }
        DeviceHostError::Config(_) => {
            Failure::usage(error).remedy("change that number in --device-config")
        }
        DeviceHostError::Socket(_) | DeviceHostError::Thread(_) => Failure::failed(error),
    }
}
