//! What a device that is plugged in is like: its axes, its room and its limits.

use std::time::Duration;

use mmt_shared::model::geometry::Vec2;
use mmt_shared::range::{OutOfRange, all_in_range};
use serde::{Deserialize, Serialize};

use crate::limiter::STEP_MAX_N;
use crate::operator::pointer::HandTuning;

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

/// A device that is plugged in.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DeviceLinkConfig {
    /// Which of the device's axes are the world's x and y. Default x and y.
    pub axes: [Axis; 2],
    /// World metres for a metre of the device. Default 1.
    pub scale: f64,
    /// Side of the square about the device's origin that it may be in, m. Default 1: more than a desktop device has.
    pub workspace_m: f64,
    /// Greatest speed of the device, m/s: a reading that is further from the one before is nonsense. Default 5.
    pub speed_max_m_per_s: f64,
    /// `F_max`, N. Default 8, what common desktop devices give.
    pub force_max_n: f64,
    /// `S_max`, N per tick. Default 2.
    pub step_max_n: f64,
    /// `k_p`, N/m, world metres. Default 500: half of that of the simulated hand, for the loop is closed 3 ms late.
    pub stiffness_n_per_m: f64,
    /// What the hand may feel of it, N/m, device metres. Default 3000.
    pub stiffness_max_n_per_m: f64,
    /// From a reading's stamp to its use, ms. Default 2: a packet that is one period late is in time.
    pub playout_ms: f64,
    /// A device of which nothing came for so long is gone, ms. Default 40.
    pub silence_ms: f64,
    /// The bit of the button that holds the hand, from 0. Default 0.
    pub button: u8,
}

impl Default for DeviceLinkConfig {
    fn default() -> Self {
        Self {
            axes: [Axis::X, Axis::Y],
            scale: 1.0,
            workspace_m: 1.0,
            speed_max_m_per_s: 5.0,
            force_max_n: 8.0,
            step_max_n: STEP_MAX_N,
            stiffness_n_per_m: 500.0,
            stiffness_max_n_per_m: 3000.0,
            playout_ms: 2.0,
            silence_ms: 40.0,
            button: 0,
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
    pub(super) fn check(&self) -> Result<(), DeviceLinkError> {
        let [(a, _), (b, _)] = self.axes.map(Axis::place);
        if a == b {
            return Err(DeviceLinkError::OneAxis);
        }
        let stiffness_max = self.stiffness_max_n_per_m;
        #[rustfmt::skip]
        let checks = [
            ("workspace_m", "m", self.workspace_m, WORKSPACE_M),
            ("speed_max_m_per_s", "m/s", self.speed_max_m_per_s, SPEED_MAX_M_PER_S),
            ("stiffness_max_n_per_m", "N/m", stiffness_max, STIFFNESS_MAX_N_PER_M),
            ("playout_ms", "ms", self.playout_ms, PLAYOUT_MS),
            ("silence_ms", "ms", self.silence_ms, SILENCE_MS),
            ("button", "", self.button.into(), BUTTON),
        ];
        Ok(all_in_range(checks)?)
    }

    /// Where a place of the device (m) is in the world, m; none outside of the workspace.
    pub(super) fn world(&self, place: [f64; 3]) -> Option<Vec2> {
        let along = |axis: Axis| {
            let (number, sign) = axis.place();
            place.get(number).map_or(0.0, |metres| metres * sign)
        };
        let [x, y] = self.axes.map(along);
        let reach = self.workspace_m / 2.0;
        let inside = x.abs() <= reach && y.abs() <= reach;
        inside.then(|| Vec2::new(x, y) * self.scale)
    }

    /// A force in the world along the device's axes, N.
    pub(super) fn device(&self, force: Vec2) -> [f64; 3] {
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
