//! A plant at the plant link of a slave.

use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use mmt_shared::plug::{PLANT_BYTES, PlugKind, doubles};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::{End, Pair, finite, monotonic_ns};

/// The longest wait for a command, s.
const WAIT_MAX_S: f64 = 10.0;
/// Flags of a tool command: a session runs, it begins, and the tool is held by an emergency stop.
const SESSION: u16 = 1;
const BEGINS: u16 = 2;
const HELD: u16 = 4;
/// Flag of an answer: the object was seen.
const OBJECT_SEEN: u16 = 1;

/// Where the tool has to be.
///
/// tool, velocity: (x, y), m and m/s, world. stiffness, damping: k_p and k_d of the master's device, N/m and N s/m. force_max: it
/// presses with no more, N. begins: a session begins, no sample of the hand has come yet. held: an emergency stop is set, the
/// tool stands. periods: of 1 ms since the command before: a simulator computes so many.
#[pyclass(frozen, get_all, module = "mmt")]
pub(crate) struct Command {
    tool: Pair,
    velocity: Pair,
    stiffness: f64,
    damping: f64,
    force_max: f64,
    begins: bool,
    held: bool,
    periods: u32,
}

#[pymethods]
impl Command {
    fn __repr__(&self) -> String {
        let Self { tool, periods, .. } = self;
        format!("<mmt.Command: tool {tool:?} m, {periods} periods>")
    }
}

/// A robot or a simulator at the plant link of a slave: it takes commands, and sends what it measured.
///
/// address: as mmt printed it after "plant: ", "udp://HOST:PORT?token=…". Raises ValueError of another text, OSError where no
/// socket can be had.
#[pyclass(module = "mmt")]
pub(crate) struct Plant {
    // a call from another thread waits until the command that is waited for has come
    end: Mutex<End>,
}

impl Plant {
    fn with<T: Send>(&self, py: Python<'_>, act: impl FnOnce(&mut End) -> T + Send) -> T {
        py.detach(|| act(&mut self.end.lock().unwrap_or_else(PoisonError::into_inner)))
    }
}

#[pymethods]
impl Plant {
    #[new]
    fn new(address: &str) -> PyResult<Self> {
        let end = Mutex::new(End::connect(address)?);
        Ok(Self { end })
    }

    /// The newest command, which is waited for so long, s, 0 to 10; None if none came. Releases the GIL; other calls of this plant
    /// wait as well.
    fn command(&self, py: Python<'_>, wait_s: f64) -> PyResult<Option<Command>> {
        if !(0.0..=WAIT_MAX_S).contains(&wait_s) {
            let what = format!("wait_s is {wait_s}; it must be 0 to {WAIT_MAX_S} s");
            return Err(PyValueError::new_err(what));
        }
        let wait = Duration::from_secs_f64(wait_s);
        Ok(self.with(py, |end| newest(end, wait)))
    }

    /// Sends what was measured, at the latest 20 ms after the last.
    ///
    /// tool, velocity: where the tool is and how fast, (x, y), m and m/s, world. force: of the tool on the object, (x, y), N.
    /// pose: (x, y, angle) of the object, m, m, rad, where it was seen since the last answer. image_age_s: how old that is, s.
    /// Raises ValueError where a number is not finite.
    #[pyo3(signature = (tool, velocity, force, pose=None, image_age_s=0.0))]
    fn answer(
        &self,
        py: Python<'_>,
        tool: [f64; 2],
        velocity: [f64; 2],
        force: [f64; 2],
        pose: Option<[f64; 3]>,
        image_age_s: f64,
    ) -> PyResult<()> {
        let flags = if pose.is_some() { OBJECT_SEEN } else { 0 };
        let tool = finite(tool, "tool")?;
        let velocity = finite(velocity, "velocity")?;
        let force = finite(force, "force")?;
        let pose = finite(pose.unwrap_or_default(), "pose")?;
        let age = finite([image_age_s], "image_age_s")?;
        let numbers = [&tool[..], &velocity, &force, &pose, &age].concat();
        let numbers = numbers.into_iter().map(f64::to_le_bytes);
        let stamp_ns = monotonic_ns(py)?;
        self.with(py, |end| {
            end.send::<PLANT_BYTES, 8>(PlugKind::Answer, flags, stamp_ns, numbers);
        });
        Ok(())
    }

    /// Commands that came.
    #[getter]
    fn received(&self, py: Python<'_>) -> u64 {
        self.with(py, |end| end.received)
    }

    /// Commands that never came.
    #[getter]
    fn lost(&self, py: Python<'_>) -> u64 {
        self.with(py, |end| end.lost)
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        self.with(py, |end| {
            let End {
                sequence, received, ..
            } = end;
            format!("<mmt.Plant: {received} received, {sequence} sent>")
        })
    }
}

/// The first is waited for; then those that wait already. One that came late or twice is answered, and not computed again.
fn newest(end: &mut End, wait: Duration) -> Option<Command> {
    let mut newest: Option<Command> = None;
    let mut wait = wait;
    while let Some((ahead, flags, numbers)) = end.receive(PlugKind::Tool, PLANT_BYTES, wait) {
        if flags & SESSION == 0 {
            continue;
        }
        wait = Duration::ZERO;
        let before = newest.map_or(0, |before| before.periods);
        let [x, y, v_x, v_y, stiffness, damping, force_max] = doubles(&numbers);
        newest = Some(Command {
            tool: (x, y),
            velocity: (v_x, v_y),
            stiffness,
            damping,
            force_max,
            begins: flags & BEGINS != 0,
            held: flags & HELD != 0,
            periods: ahead.saturating_add(before),
        });
    }
    newest
}
