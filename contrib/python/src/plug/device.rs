//! A device at the device link of a master.

use std::time::{Duration, Instant};

use mmt_shared::plug::{DEVICE_BYTES, PlugKind, singles};
use pyo3::prelude::*;

use super::{End, Pair, Triple, finite, monotonic_ns};

/// Without a packet of mmt for so long there is no force, and no session.
const SILENCE: Duration = Duration::from_millis(20);

/// A haptic device at the device link of a master: it sends readings, and gets the force on the hand.
///
/// address: as mmt printed it after "device: ", "udp://HOST:PORT?token=…". Raises ValueError of another text, OSError where no
/// socket can be had. Whether a session runs shows in the first bit of `state`.
#[pyclass(module = "mmt")]
pub(crate) struct Device {
    end: End,
    flags: u16,
    force: Triple,
    hip: Pair,
    lost_up: f64,
    last_answer: Option<Instant>,
}

#[pymethods]
impl Device {
    #[new]
    fn new(address: &str) -> PyResult<Self> {
        Ok(Self {
            end: End::connect(address)?,
            flags: 0,
            force: (0.0, 0.0, 0.0),
            hip: (0.0, 0.0),
            lost_up: 0.0,
            last_answer: None,
        })
    }

    /// Sends a reading, a thousand times a second.
    ///
    /// position: (3,), m along the device's axes. velocity: (3,), m/s. buttons: a bit for each; the one that holds the hand must be
    /// seen up before it counts. stamp_ns: when it was taken, by a clock that does not go back; `time.monotonic_ns()` if None.
    /// Raises ValueError where a number is not finite.
    #[pyo3(signature = (position, velocity=[0.0; 3], buttons=0, stamp_ns=None))]
    fn send(
        &mut self,
        py: Python<'_>,
        position: [f64; 3],
        velocity: [f64; 3],
        buttons: u16,
        stamp_ns: Option<u64>,
    ) -> PyResult<()> {
        let position = finite(position, "position")?;
        let velocity = finite(velocity, "velocity")?;
        let stamp_ns = match stamp_ns {
            Some(stamp_ns) => stamp_ns,
            None => monotonic_ns(py)?,
        };
        let numbers = position.into_iter().chain(velocity);
        let numbers = numbers.map(|number| (number as f32).to_le_bytes());
        self.end
            .send::<DEVICE_BYTES, 4>(PlugKind::Reading, buttons, stamp_ns, numbers);
        Ok(())
    }

    /// Takes what has come; returns the force on the hand along the device's axes, (x, y, z), N, which is none after
    /// 20 ms of silence.
    fn receive(&mut self) -> Triple {
        let kind = PlugKind::Force;
        while let Some((ahead, flags, numbers)) =
            self.end.receive(kind, DEVICE_BYTES, Duration::ZERO)
        {
            if ahead > 0 {
                let [x, y, z, hip_x, hip_y, lost_up] = singles(&numbers);
                self.flags = flags;
                self.force = (x, y, z);
                self.hip = (hip_x, hip_y);
                self.lost_up = lost_up;
                self.last_answer = Some(Instant::now());
            }
        }
        if self
            .last_answer
            .is_none_or(|last_answer| last_answer.elapsed() > SILENCE)
        {
            self.flags = 0;
            self.force = (0.0, 0.0, 0.0);
        }
        self.force
    }

    /// Force on the hand along the device's axes when `receive` was last called, (x, y, z), N.
    #[getter]
    fn force(&self) -> Triple {
        self.force
    }

    /// The HIP in the world, (x, y), m.
    #[getter]
    fn hip(&self) -> Pair {
        self.hip
    }

    /// What mmt reports of itself, bits: 1 a session runs, 2 the hand is held, 4 in contact, 8 an emergency stop is
    /// set, 16 the slave is late, 32 the newest reading was refused, or the button was never up.
    #[getter]
    fn state(&self) -> u16 {
        self.flags
    }

    /// Number of the newest reading: how many were sent.
    #[getter]
    fn sequence(&self) -> u32 {
        self.end.sequence
    }

    /// Forces that came.
    #[getter]
    fn received(&self) -> u64 {
        self.end.received
    }

    /// Readings that never came, as the master counts them.
    #[getter]
    fn lost_up(&self) -> u64 {
        self.lost_up as u64
    }

    /// Forces that never came.
    #[getter]
    fn lost_down(&self) -> u64 {
        self.end.lost
    }

    fn __repr__(&self) -> String {
        let Self { end, flags, .. } = self;
        format!(
            "<mmt.Device: {} sent, {} received, state {flags}>",
            end.sequence, end.received
        )
    }
}
