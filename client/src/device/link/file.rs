//! A file about a device that is plugged in.

use serde::Deserialize;

use super::{Axis, DeviceKind, DeviceLinkConfig, DeviceLinkError, Dialect, Hold, Version};

/// What a file has of a device; what it leaves out is as the kind has it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[allow(missing_docs, reason = "the keys are those of the configuration")]
pub struct DeviceFile {
    pub axes: Option<[Axis; 2]>,
    pub centre_m: Option<[f64; 3]>,
    pub scale: Option<f64>,
    pub workspace_m: Option<f64>,
    pub speed_max_m_per_s: Option<f64>,
    pub force_max_n: Option<f64>,
    pub step_max_n: Option<f64>,
    pub stiffness_n_per_m: Option<f64>,
    pub stiffness_max_n_per_m: Option<f64>,
    pub playout_ms: Option<f64>,
    pub silence_ms: Option<f64>,
    pub hold: Option<Hold>,
    pub button: Option<u8>,
    pub dialect: Option<Dialect>,
    pub version: Option<Version>,
    pub torque_max_nm: Option<f64>,
}

impl DeviceFile {
    /// The device of this kind that the file describes.
    ///
    /// # Errors
    /// It has a key that goes with another kind only.
    pub fn device(&self, kind: DeviceKind) -> Result<DeviceLinkConfig, DeviceLinkError> {
        let only = [
            ("dialect", self.dialect.is_some(), DeviceKind::Inverse3),
            ("version", self.version.is_some(), DeviceKind::TwoDiy),
            (
                "torque_max_nm",
                self.torque_max_nm.is_some(),
                DeviceKind::TwoDiy,
            ),
        ];
        let foreign = only
            .into_iter()
            .find(|(_, given, of)| *given && *of != kind);
        if let Some((key, _, of)) = foreign {
            let of = of.name();
            return Err(DeviceLinkError::OfAnother { key, of });
        }
        let default = DeviceLinkConfig::of(kind);
        let version = self.version.unwrap_or(default.version);
        let centre_m = match kind {
            DeviceKind::TwoDiy => version.centre_m(),
            DeviceKind::Link | DeviceKind::Inverse3 => default.centre_m,
        };
        let or = |given: Option<f64>, otherwise| given.unwrap_or(otherwise);
        Ok(DeviceLinkConfig {
            kind,
            axes: self.axes.unwrap_or(default.axes),
            centre_m: self.centre_m.unwrap_or(centre_m),
            scale: or(self.scale, default.scale),
            workspace_m: or(self.workspace_m, default.workspace_m),
            speed_max_m_per_s: or(self.speed_max_m_per_s, default.speed_max_m_per_s),
            force_max_n: or(self.force_max_n, default.force_max_n),
            step_max_n: or(self.step_max_n, default.step_max_n),
            stiffness_n_per_m: or(self.stiffness_n_per_m, default.stiffness_n_per_m),
            stiffness_max_n_per_m: or(self.stiffness_max_n_per_m, default.stiffness_max_n_per_m),
            playout_ms: or(self.playout_ms, default.playout_ms),
            silence_ms: or(self.silence_ms, default.silence_ms),
            hold: self.hold.unwrap_or(default.hold),
            button: self.button.unwrap_or(default.button),
            dialect: self.dialect.unwrap_or(default.dialect),
            version,
            torque_max_nm: or(self.torque_max_nm, default.torque_max_nm),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_of_device_has_its_own_keys_and_refuses_those_of_another() {
        let dialect = DeviceFile {
            dialect: Some(Dialect::Values),
            ..DeviceFile::default()
        };
        let version = DeviceFile {
            version: Some(Version::Two),
            ..DeviceFile::default()
        };
        assert!(dialect.device(DeviceKind::Inverse3).is_ok());
        for (file, kind, key) in [
            (dialect, DeviceKind::Link, "dialect"),
            (dialect, DeviceKind::TwoDiy, "dialect"),
            (version, DeviceKind::Inverse3, "version"),
        ] {
            let refused = file.device(kind).unwrap_err();
            assert!(matches!(refused, DeviceLinkError::OfAnother { key: k, .. } if k == key));
        }
        let two = version.device(DeviceKind::TwoDiy).unwrap();
        assert_eq!(two.centre_m, [0.0, 0.09, 0.0]);
        assert_eq!(
            DeviceFile::default().device(DeviceKind::TwoDiy),
            Ok(DeviceLinkConfig::of(DeviceKind::TwoDiy))
        );
        let button = DeviceLinkConfig {
            hold: Hold::Button,
            ..two
        };
        assert_eq!(button.check(), Err(DeviceLinkError::NoButton));
        for bad in [f64::NAN, 0.0, 1e9] {
            let torque_max_nm = bad;
            assert!(
                DeviceLinkConfig {
                    torque_max_nm,
                    ..two
                }
                .check()
                .is_err()
            );
            let centre_m = [0.0, 0.0, if bad == 0.0 { 2.0 } else { bad }];
            assert!(DeviceLinkConfig { centre_m, ..two }.check().is_err());
        }
    }
}
