//! Device profiles: what a haptic device can do and how its room maps to the world.
//!
//! k_p is per world metre. With a scale s (x_world = s x_device) the hand feels s k_p, and a device's
//! stiffness limit applies to that. No profile may exceed its device's limits. A device is plugged in through `link`, or, where it
//! has a protocol of its own, through `inverse3` or `two_diy`; whatever its protocol, one `hand` engages it.

#[cfg(test)]
mod conformance;
mod hand;
pub mod inverse3;
pub mod link;
pub mod pantograph;
pub mod two_diy;

use mmt_shared::model::contact::Coupling;
use mmt_shared::model::settings::STIFFNESS_N_PER_M;
use mmt_shared::range::{OutOfRange, in_range};
use serde::Serialize;

use crate::limiter::{Limits, STEP_MAX_N};
use link::DeviceLinkConfig;

/// Accepted scale s: the paper displays with 13.
const SCALE: (f64, f64) = (0.1, 100.0);

/// A haptic device and how it is used.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DeviceProfile {
    name: &'static str,
    stiffness_n_per_m: f64,
    stiffness_max_n_per_m: f64,
    force_max_n: f64,
    step_max_n: f64,
    workspace_m: f64,
    scale: f64,
}

/// The known devices; the first is the default.
const PROFILES: [DeviceProfile; 2] = [
    // No device: a simulated hand. The values are those of the design study; the stiffness limit is
    // that of the stiffest profile, the room is the world's accepted workspace.
    DeviceProfile {
        name: "default",
        stiffness_n_per_m: 1000.0,
        stiffness_max_n_per_m: 3000.0,
        force_max_n: 8.0,
        step_max_n: STEP_MAX_N,
        workspace_m: 10.0,
        scale: 1.0,
    },
    // Novint Falcon: 3000 N/m, 8 N, 4 inch cube. The paper sets k_p to the device's maximum.
    DeviceProfile {
        name: "falcon",
        stiffness_n_per_m: 3000.0,
        stiffness_max_n_per_m: 3000.0,
        force_max_n: 8.0,
        step_max_n: STEP_MAX_N,
        workspace_m: 0.10,
        scale: 1.0,
    },
];

/// Why a profile was not accepted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DeviceError {
    /// No profile has this name.
    #[error("there is no device profile \"{name}\"; known are: {known}")]
    Unknown {
        /// The name asked for.
        name: String,
        /// All known names.
        known: String,
    },
    /// The scale is out of range.
    #[error(transparent)]
    Scale(#[from] OutOfRange),
    /// The hand would feel more than the device can render, or nothing.
    #[error(
        "{range} of the device \"{device}\" at scale {scale} (the hand feels scale x stiffness, \
         at most {limit} N/m); change the stiffness or the scale"
    )]
    Stiffness {
        /// k_p asked for and the range that is accepted at this scale.
        range: OutOfRange,
        /// Name of the device.
        device: &'static str,
        /// The device's own limit, N/m.
        limit: f64,
        /// The scale s.
        scale: f64,
    },
}

impl Default for DeviceProfile {
    fn default() -> Self {
        let [default, ..] = PROFILES;
        default
    }
}

impl DeviceProfile {
    /// The names of all known profiles.
    pub fn names() -> impl Iterator<Item = &'static str> {
        PROFILES.iter().map(|profile| profile.name)
    }

    /// The profile of a name.
    ///
    /// # Errors
    /// [`DeviceError::Unknown`] lists the known names.
    pub fn by_name(name: &str) -> Result<Self, DeviceError> {
        let found = PROFILES.into_iter().find(|profile| profile.name == name);
        found.ok_or_else(|| DeviceError::Unknown {
            name: name.to_owned(),
            known: Self::names().collect::<Vec<_>>().join(", "),
        })
    }

    /// The profile of a device that is plugged in with these numbers.
    ///
    /// # Errors
    /// As [`Self::used_with`].
    pub fn plugged_in(config: &DeviceLinkConfig) -> Result<Self, DeviceError> {
        let profile = Self {
            name: config.kind.name(),
            stiffness_n_per_m: config.stiffness_n_per_m,
            stiffness_max_n_per_m: config.stiffness_max_n_per_m,
            force_max_n: config.force_max_n,
            step_max_n: config.step_max_n,
            workspace_m: config.workspace_m,
            scale: config.scale,
        };
        profile.used_with(None, None)
    }

    /// This device used with another k_p (N/m, world metres) and scale s; `None` keeps the profile's.
    ///
    /// # Errors
    /// When the scale is out of range, or s k_p above the device's stiffness limit.
    pub fn used_with(
        self,
        stiffness_n_per_m: Option<f64>,
        scale: Option<f64>,
    ) -> Result<Self, DeviceError> {
        let scale = scale.unwrap_or(self.scale);
        in_range("scale", "", scale, SCALE)?;
        let value = stiffness_n_per_m.unwrap_or(self.stiffness_n_per_m);
        let limit = self.stiffness_max_n_per_m;
        // the ceiling of the simulated hand holds for k_p itself as well: at s < 1 the device allows
        // more than the local model was made for; and a slave accepts no more than the session's settings do
        let (least, most) = STIFFNESS_N_PER_M;
        let accepted = (least, (limit / scale).min(limit).min(most));
        in_range("stiffness", "N/m", value, accepted).map_err(|range| DeviceError::Stiffness {
            range,
            device: self.name,
            limit,
            scale,
        })?;
        Ok(Self {
            stiffness_n_per_m: value,
            scale,
            ..self
        })
    }

    /// Name of the profile.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// k_p, N/m, world metres.
    pub fn stiffness_n_per_m(&self) -> f64 {
        self.stiffness_n_per_m
    }

    /// k_p with the damping that belongs to it.
    pub fn coupling(&self) -> Coupling {
        Coupling::for_stiffness(self.stiffness_n_per_m)
    }

    /// The limits for the force on this device.
    pub fn limits(&self) -> Limits {
        Limits {
            force_max_n: self.force_max_n,
            step_max_n: self.step_max_n,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limiter::ForceLimiter;

    #[test]
    fn every_profile_is_found_by_its_name_and_keeps_its_own_limits() {
        for name in DeviceProfile::names() {
            let profile = DeviceProfile::by_name(name).unwrap();
            assert_eq!(profile.name(), name);
            assert_eq!(profile.used_with(None, None), Ok(profile));
            assert!(ForceLimiter::try_new(profile.limits()).is_ok());
        }
        assert_eq!(
            DeviceProfile::by_name("default"),
            Ok(DeviceProfile::default())
        );
        assert_eq!(
            DeviceProfile::by_name("phantom").unwrap_err().to_string(),
            "there is no device profile \"phantom\"; known are: default, falcon"
        );
    }

    #[test]
    fn the_defaults_are_1000_n_per_m_and_8_n_and_the_falcon_3000() {
        let default = DeviceProfile::default();
        let c = default.coupling();
        assert_eq!((c.stiffness_n_per_m, c.damping_ns_per_m), (1000.0, 10.0));
        assert_eq!((default.force_max_n, default.scale), (8.0, 1.0));
        let falcon = DeviceProfile::by_name("falcon").unwrap();
        let c = falcon.coupling();
        assert_eq!((c.stiffness_n_per_m, c.damping_ns_per_m), (3000.0, 20.0));
        assert_eq!((falcon.force_max_n, falcon.workspace_m), (8.0, 0.10));
    }

    #[test]
    fn the_stiffness_limit_applies_to_what_the_hand_feels() {
        let falcon = DeviceProfile::by_name("falcon").unwrap();
        assert!(falcon.used_with(Some(3000.0), None).is_ok());
        assert!(falcon.used_with(Some(3000.0_f64.next_up()), None).is_err());
        let scaled = falcon.used_with(Some(1500.0), Some(2.0)).unwrap();
        assert_eq!(scaled.scale, 2.0);
        assert!(falcon.used_with(Some(1501.0), Some(2.0)).is_err());
        assert!(falcon.used_with(None, Some(13.0)).is_err());
        let error = falcon.used_with(Some(1501.0), Some(2.0)).unwrap_err();
        assert_eq!(
            error.to_string(),
            "stiffness 1501 is outside the accepted range 50 to 1500 N/m of the device \
             \"falcon\" at scale 2 (the hand feels scale x stiffness, at most 3000 N/m); \
             change the stiffness or the scale"
        );
    }

    #[test]
    fn no_device_is_stiffer_than_a_slave_accepts() {
        let stiff = |stiffness_n_per_m| {
            DeviceProfile::plugged_in(&DeviceLinkConfig {
                stiffness_n_per_m,
                stiffness_max_n_per_m: 30_000.0,
                ..DeviceLinkConfig::default()
            })
        };
        assert!(stiff(10_000.0).is_ok());
        let refused = stiff(10_001.0).unwrap_err().to_string();
        assert!(refused.contains("50 to 10000 N/m"), "{refused}");
    }

    #[test]
    fn numbers_that_are_not_finite_or_not_positive_are_refused() {
        let profile = DeviceProfile::default();
        for bad in [f64::NAN, f64::INFINITY, 0.0, -1000.0] {
            assert!(profile.used_with(Some(bad), None).is_err());
            assert!(profile.used_with(None, Some(bad)).is_err());
        }
    }
}
