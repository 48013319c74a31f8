//! What a device that is plugged in is like: its axes, its room and its limits.
//!
//! A kind of device has its own defaults ([`DeviceLinkConfig::of`]); a file ([`DeviceFile`](super::DeviceFile))
//! changes single numbers of them.

use std::time::Duration;

use mmt_shared::model::geometry::Vec2;
use mmt_shared::range::{OutOfRange, all_in_range};
use serde::{Deserialize, Serialize};

use crate::limiter::STEP_MAX_N;
use crate::operator::pointer::HandTuning;

/// Accepted distance of the workspace's middle from the device's origin, m, on each axis.
const CENTRE_M: (f64, f64) = (-1.0, 1.0);
/// Accepted greatest torque of a motor, Nm: the links of a 2DIY are 7 cm long.
const TORQUE_MAX_NM: (f64, f64) = (0.01, 2.0);
/// Accepted workspace, m: the side of a cube.
const WORKSPACE_M: (f64, f64) = (0.01, 10.0);
/// Accepted greatest speed, m/s: a hand that throws reaches 10.
const SPEED_MAX_M_PER_S: (f64, f64) = (0.1, 20.0);
/// Accepted play-out, ms.
const PLAYOUT_MS: (f64, f64) = (0.0, 50.0);
/// Accepted silence, ms: above a few lost packets, and no longer than that of a pointer.
const SILENCE_MS: (f64, f64) = (5.0, 120.0);
/// Accepted number of the button's bit.
const BUTTON: (f64, f64) = (0.0, 15.0);
/// Accepted greatest stiffness of the device, N/m.
const STIFFNESS_MAX_N_PER_M: (f64, f64) = (50.0, 30_000.0);

/// An axis of the device with its sign.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Axis {
    /// The first.
    #[serde(rename = "x")]
    X,
    /// The first, the other way.
    #[serde(rename = "-x")]
    MinusX,
    /// The second.
    #[serde(rename = "y")]
    Y,
    /// The second, the other way.
    #[serde(rename = "-y")]
    MinusY,
    /// The third.
    #[serde(rename = "z")]
    Z,
    /// The third, the other way.
    #[serde(rename = "-z")]
    MinusZ,
}

impl Axis {
    /// Its number from 0, and its sign.
    fn place(self) -> (usize, f64) {
        match self {
            Self::X => (0, 1.0),
            Self::MinusX => (0, -1.0),
            Self::Y => (1, 1.0),
            Self::MinusY => (1, -1.0),
            Self::Z => (2, 1.0),
            Self::MinusZ => (2, -1.0),
        }
    }
}

/// What a device speaks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub enum DeviceKind {
    /// The packets of `docs/plugs.md`, over UDP.
    #[default]
    #[serde(rename = "link")]
    Link,
    /// Haply Inverse3: JSON over a WebSocket of the vendor's service.
    #[serde(rename = "inverse3")]
    Inverse3,
    /// Haply 2DIY: hAPI over a serial port.
    #[serde(rename = "2diy")]
    TwoDiy,
}

impl DeviceKind {
    /// All kinds.
    pub const ALL: [Self; 3] = [Self::Link, Self::Inverse3, Self::TwoDiy];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Link => "link",
            Self::Inverse3 => "inverse3",
            Self::TwoDiy => "2diy",
        }
    }
}

/// What holds the hand.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Hold {
    /// The button, while it is down.
    #[default]
    Button,
    /// Rest: a device that has stood within 2 mm for a second is held until it is let go, and again after the next rest.
    Rest,
}

/// How the force is written for an Inverse3.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Dialect {
    /// As the service's version has it.
    #[default]
    Auto,
    /// `set_cursor_force.vector`, from 3.5 on.
    Vector,
    /// `set_cursor_force.values`, before.
    Values,
}

/// Which 2DIY it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Version {
    /// With a metal plate: both motors on one axis.
    #[serde(rename = "2")]
    Two,
    /// Of plastic: the axes of the motors stand 38 mm apart.
    #[default]
    #[serde(rename = "3")]
    Three,
}

/// A device that is plugged in.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DeviceLinkConfig {
    /// What it speaks.
    pub kind: DeviceKind,
    /// Which of the device's axes are the world's x and y. Default x and y; of a 2DIY -x and -y, whose y comes towards the hand.
    pub axes: [Axis; 2],
    /// Where the middle of its workspace is, m, device. Default its origin; of an Inverse3 the place of the
    /// vendor's own example, of a 2DIY the middle of its reach.
    pub centre_m: [f64; 3],
    /// World metres for a metre of the device. Default 1.
    pub scale: f64,
    /// Side of the square about the middle that it may be in, m. Default 1: more than a desktop device has. Of an Inverse3 0.2,
    /// chosen with room to spare, of a 2DIY 0.1: all of the force acts there.
    pub workspace_m: f64,
    /// Greatest speed of the device, m/s: a reading that is further from the one before is nonsense. Default 5.
    pub speed_max_m_per_s: f64,
    /// `F_max`, N. Default 8, what common desktop devices give; of a 2DIY 3.
    pub force_max_n: f64,
    /// `S_max`, N per tick. Default 2.
    pub step_max_n: f64,
    /// `k_p`, N/m, world metres. Default 500: half of that of the simulated hand, for the loop is closed 3 ms late; of a 2DIY
    /// 300: its encoders see steps of 0.1 mm.
    pub stiffness_n_per_m: f64,
    /// What the hand may feel of it, N/m, device metres. Default 3000; of a 2DIY 1000.
    pub stiffness_max_n_per_m: f64,
    /// From a reading's stamp to its use, ms. Default 2: a packet that is one period late is in time.
    pub playout_ms: f64,
    /// A device of which nothing came for so long is gone, ms. Default 40.
    pub silence_ms: f64,
    /// What holds the hand. Default its button; a 2DIY has none, and is held after a rest.
    pub hold: Hold,
    /// The bit of the button that holds the hand, from 0. Default 0.
    pub button: u8,
    /// How the force is written for an Inverse3. Default as the service's version has it.
    pub dialect: Dialect,
    /// Which 2DIY it is. Default 3.
    pub version: Version,
    /// Greatest torque of a motor of a 2DIY, Nm. Default 0.3: 3 N take at most 0.24 in its workspace. The vendor states none.
    pub torque_max_nm: f64,
}

impl Default for DeviceLinkConfig {
    fn default() -> Self {
        Self {
            kind: DeviceKind::Link,
            axes: [Axis::X, Axis::Y],
            centre_m: [0.0; 3],
            scale: 1.0,
            workspace_m: 1.0,
            speed_max_m_per_s: 5.0,
            force_max_n: 8.0,
            step_max_n: STEP_MAX_N,
            stiffness_n_per_m: 500.0,
            stiffness_max_n_per_m: 3000.0,
            playout_ms: 2.0,
            silence_ms: 40.0,
            hold: Hold::Button,
            button: 0,
            dialect: Dialect::Auto,
            version: Version::Three,
            torque_max_nm: 0.3,
        }
    }
}

impl DeviceLinkConfig {
    /// A device of this kind; a 2DIY of version 3.
    pub fn of(kind: DeviceKind) -> Self {
        let link = Self::default();
        match kind {
            DeviceKind::Link => link,
            DeviceKind::Inverse3 => Self {
                kind,
                centre_m: [0.0, -0.12, 0.15],
                workspace_m: 0.2,
                ..link
            },
            DeviceKind::TwoDiy => Self {
                kind,
                axes: [Axis::MinusX, Axis::MinusY],
                centre_m: Version::Three.centre_m(),
                workspace_m: 0.1,
                force_max_n: 3.0,
                stiffness_n_per_m: 300.0,
                stiffness_max_n_per_m: 1000.0,
                hold: Hold::Rest,
                ..link
            },
        }
    }
}

impl Version {
    /// The middle of its reach, m.
    pub(super) fn centre_m(self) -> [f64; 3] {
        match self {
            Self::Two => [0.0, 0.09, 0.0],
            Self::Three => [0.019, 0.09, 0.0],
        }
    }
}

/// Why a device cannot be plugged in.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum DeviceLinkError {
    /// A number lies outside its accepted range.
    #[error("device: {0}")]
    OutOfRange(#[from] OutOfRange),
    /// One axis is to be both of the world's.
    #[error("device: axes have to be two different axes of the device, such as [\"x\", \"-z\"]")]
    OneAxis,
    /// A key of another kind of device.
    #[error("device: {key} goes with --device {of} only")]
    OfAnother {
        /// The key.
        key: &'static str,
        /// The kind that it belongs to.
        of: &'static str,
    },
    /// A 2DIY is to be held by a button.
    #[error("device: a 2DIY has no button: leave hold out, or write hold = \"rest\"")]
    NoButton,
}

impl DeviceLinkConfig {
    /// How its readings are read.
    pub fn tuning(&self) -> HandTuning {
        HandTuning {
            playout_s: self.playout_ms * 1e-3,
            low_pass: false,
            silence: Duration::from_secs_f64(self.silence_ms * 1e-3),
        }
    }

    /// Checks what the device's profile and its limiter do not.
    pub(in crate::device) fn check(&self) -> Result<(), DeviceLinkError> {
        let [(a, _), (b, _)] = self.axes.map(Axis::place);
        if a == b {
            return Err(DeviceLinkError::OneAxis);
        }
        if self.kind == DeviceKind::TwoDiy && self.hold == Hold::Button {
            return Err(DeviceLinkError::NoButton);
        }
        let stiffness_max = self.stiffness_max_n_per_m;
        let [x, y, z] = self.centre_m;
        #[rustfmt::skip]
        let checks = [
            ("centre_m", "m", x, CENTRE_M),
            ("centre_m", "m", y, CENTRE_M),
            ("centre_m", "m", z, CENTRE_M),
            ("workspace_m", "m", self.workspace_m, WORKSPACE_M),
            ("speed_max_m_per_s", "m/s", self.speed_max_m_per_s, SPEED_MAX_M_PER_S),
            ("stiffness_max_n_per_m", "N/m", stiffness_max, STIFFNESS_MAX_N_PER_M),
            ("playout_ms", "ms", self.playout_ms, PLAYOUT_MS),
            ("silence_ms", "ms", self.silence_ms, SILENCE_MS),
            ("button", "", self.button.into(), BUTTON),
            ("torque_max_nm", "Nm", self.torque_max_nm, TORQUE_MAX_NM),
        ];
        Ok(all_in_range(checks)?)
    }

    /// Where a place of the device (m) is in the world, m; none outside of the workspace.
    pub(in crate::device) fn world(&self, place: [f64; 3]) -> Option<Vec2> {
        let along = |axis: Axis| {
            let (number, sign) = axis.place();
            let from = self.centre_m.get(number).unwrap_or(&0.0);
            place
                .get(number)
                .map_or(0.0, |metres| (metres - from) * sign)
        };
        let [x, y] = self.axes.map(along);
        let reach = self.workspace_m / 2.0;
        let inside = x.abs() <= reach && y.abs() <= reach;
        inside.then(|| Vec2::new(x, y) * self.scale)
    }

    /// A force in the world along the device's axes, N.
    pub(in crate::device) fn device(&self, force: Vec2) -> [f64; 3] {
        let mut along = [0.0; 3];
        for (axis, newtons) in self.axes.into_iter().zip([force.x, force.y]) {
            let (number, sign) = axis.place();
            if let Some(place) = along.get_mut(number) {
                *place = newtons * sign;
            }
        }
        along
    }
}
