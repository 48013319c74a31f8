//! `mmt.run`: a run in virtual time as arrays.

use mmt_client::operator::trace::Trace;
use mmt_lab::sweep::columns;
use mmt_lab::table::Cell;
use mmt_lab::trial::{Measured, Running, Trial, TrialError};
use mmt_lab::world::{Given, WorldPackets, WorldTick};
use mmt_shared::model::geometry::Vec2;
use mmt_shared::time::TICK;
use pyo3::exceptions::{PyAttributeError, PyValueError};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyDict;

use crate::arrays::{column, numbers, of_known};
use crate::callbacks::Callbacks;
use crate::config::{configuration, duration};
use crate::packets::{causes, table};
use crate::ticks::{Arrays, Ticks};

/// Milliseconds between two looks at whether somebody wants the end.
const BLOCK: u32 = 1000;
/// Milliseconds that there is room for from the start: ten minutes.
const ROOM_MAX: usize = 600_000;

/// A run in virtual time as arrays of numpy, a row a millisecond (N rows).
///
/// At the master: time (N,), s; hip (N, 2), m; f_m (N, 2), the force on the object that is felt, N; hand_force (N, 2), what the
/// device gives, N; touching (N,), whether the HIP touches the model; pose_model (N, 3), x, y, m, and angle, rad;
/// parameters_model (N, 3), m, b, c in kg, N s/m, N.
///
/// At the slave, NaN before it plays the first sample: stamp (N,), the time of the sample that it plays, s; tool (N, 2), m;
/// f_s (N, 2), the measured force on the object, N; f_s_true (N, 2), the same as it is, N; f_shadow (N, 2), f_m as the slave
/// knows it, N; f_m_played (N, 2), f_m as it was rendered for the sample that is played, NaN where that was lost, N: f_s is to be
/// compared with this one; in_contact (N,); pose_true (N, 3), m and rad; parameters_estimate (N, 3) of mmt's own estimator;
/// update (N,), the cause of the update of this sample, "" for none.
///
/// Of the whole run: parameters_true (3,); packets; metrics; digest; config.
#[pyclass(frozen, module = "mmt")]
pub(crate) struct Run {
    arrays: Vec<(&'static str, Py<PyAny>)>,
    updates: Vec<u8>,
    update: PyOnceLock<Py<PyAny>>,
    packets: WorldPackets,
    table: PyOnceLock<Py<PyAny>>,
    measured: Measured,
    parameters_true: [f64; 3],
    config: String,
}

impl Run {
    fn array(&self, py: Python<'_>, name: &'static str) -> PyResult<Py<PyAny>> {
        let found = self.arrays.iter().find(|(known, _)| *known == name);
        let found = found.map(|(_, array)| array.clone_ref(py));
        found.ok_or_else(|| PyAttributeError::new_err(name))
    }
}

macro_rules! arrays {
    ($($(#[$doc:meta])* $name:ident,)*) => {
        #[pymethods]
        impl Run {
            $($(#[$doc])*
            #[getter]
            fn $name(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
                self.array(py, stringify!($name))
            })*

            /// The cause of the update that the slave decided on in this sample, "" for none; (N,), words.
            #[getter]
            fn update(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
                let made = || Ok::<_, PyErr>(of_known(py, &causes(), self.updates.clone())?.unbind());
                Ok(self.update.get_or_try_init(py, made)?.clone_ref(py))
            }

            /// m, b, c of the object at the end, kg, N s/m, N; (3,).
            #[getter]
            fn parameters_true<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
                column(py, self.parameters_true.to_vec())
            }

            /// Every datagram in the order of sending, a structured array with the fields direction ("up": master to slave,
            /// "down"), number (from 1, of its direction), kind ("command", "update", "scene", "tool", "heartbeat"), update (its
            /// number, else 0), cause (of an update), repeat (whether it repeats an earlier one), bytes, sent (s),
            /// arrived (s, NaN if it did not), fate ("delivered", "corrupted", "loss", "outage", "mtu", "queue",
            /// "codel", "limit", "under_way").
            #[getter]
            fn packets(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
                let made = || Ok::<_, PyErr>(table(py, &self.packets.read())?.unbind());
                Ok(self.table.get_or_try_init(py, made)?.clone_ref(py))
            }

            /// What the run came to, the measured columns of a sweep (docs/sweep.md); None where a measure has no meaning.
            #[getter]
            fn metrics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
                metrics(py, &self.measured)
            }

            /// SHA-256 of everything that happened, 64 hexadecimal digits: equal for equal configurations.
            #[getter]
            fn digest(&self) -> &str {
                &self.measured.digest
            }

            /// The whole configuration, TOML: given back it makes the same run.
            #[getter]
            fn config(&self) -> &str {
                &self.config
            }

            fn __repr__(&self) -> String {
                let Measured { duration_s, contact_s, updates, .. } = &self.measured;
                let packets = updates.total();
                format!("<mmt.Run of {duration_s:.3} s, {contact_s:.3} s in contact, {packets} updates>")
            }
        }
    };
}

arrays! {
    /// Time since the start by the master's clock, s; (N,).
    time,
    /// HIP as it is used and sent, m; (N, 2).
    hip,
    /// Force on the object that is felt, before the limiter, N; (N, 2).
    f_m,
    /// Force on the hand, limited, N; (N, 2).
    hand_force,
    /// Whether the HIP touches the master's model; (N,), bool.
    touching,
    /// Pose of the master's model, m, m, rad; (N, 3).
    pose_model,
    /// m, b, c of the master's model, kg, N s/m, N; (N, 3).
    parameters_model,
    /// Time of the HIP sample that the slave plays, s; (N,), NaN before the first.
    stamp,
    /// The slave's tool, m; (N, 2).
    tool,
    /// Measured force of the tool on the object, N; (N, 2).
    f_s,
    /// The same as it is, N; (N, 2).
    f_s_true,
    /// The force of the master's model as the slave knows it, N; (N, 2).
    f_shadow,
    /// f_m as the master rendered it for the sample that is played, N; (N, 2), NaN where that was lost.
    f_m_played,
    /// Whether the tool touches the object; (N,), bool.
    in_contact,
    /// The object's true pose, m, m, rad; (N, 3).
    pose_true,
    /// m, b, c as mmt's own estimator has them, kg, N s/m, N; (N, 3).
    parameters_estimate,
}

/// The measured columns of a sweep as a dict.
pub(crate) fn metrics<'py>(py: Python<'py>, measured: &Measured) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for column in columns() {
        match column.cell(measured) {
            Cell::Text(text) => dict.set_item(column.key, text)?,
            Cell::Count(count) => dict.set_item(column.key, count)?,
            Cell::Number(number) => dict.set_item(column.key, number)?,
            Cell::Absent => dict.set_item(column.key, py.None())?,
        }
    }
    Ok(dict)
}

/// What is wrong with a trial.
pub(crate) fn refused(error: &TrialError) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// Runs a world in exact virtual time: slave, emulated network and master, the code that runs live.
///
/// config: a text in TOML as `default_config` makes it, a path to a file, or a dict of the same keys, nested or with dots:
/// {"up": "delay 50ms", "slave.trigger.scheme": "hybrid 10% 150ms"}. What it leaves out is the mode's own; without "up" and "down"
/// the network is perfect.
/// duration: s of virtual time, 0.001 to 604800.
/// start: what lies below the configuration: "live", the live system's defaults, or "paper-experiment", the paper's.
/// seed: of everything random; the configuration's if None.
/// hip: (K, 2), m: the way of the hand, a row a millisecond, whatever it feels; after the last it stands. None: the
/// scripted operator. operator: called each millisecond as operator(time, hip, force_on_hand, pose) with the time of
/// the sample to come, s, and the HIP (x, y), m, the force on the hand (x, y), N, and the pose of the master's model
/// (x, y, angle), m and rad, of the millisecond before; returns the HIP (x, y), m. trigger: called as trigger(input:
/// TriggerInput) in each sample in the place of the update scheme; returns True to send an update, or the cause that
/// it is to have: "deadband", "timer" or "every_sample". Updates of contact and loss are sent all the same.
/// estimator: called as estimator(measured: Measured) in each sample; returns (m, b, c), kg, N s/m, N, or None where
/// mmt's own stands.
///
/// Releases the GIL where none of these functions is given. Raises ValueError with key, line and range of what is wrong with the
/// configuration, OSError of a file that cannot be read, and whatever a function raises.
#[pyfunction]
#[pyo3(signature = (config=None, *, duration=20.0, start="live", seed=None, hip=None, operator=None, trigger=None, estimator=None))]
#[allow(
    clippy::too_many_arguments,
    reason = "they are keywords for whoever calls it from Python"
)]
pub(crate) fn run(
    py: Python<'_>,
    config: Option<&Bound<'_, PyAny>>,
    duration: f64,
    start: &str,
    seed: Option<u64>,
    hip: Option<&Bound<'_, PyAny>>,
    operator: Option<Py<PyAny>>,
    trigger: Option<Py<PyAny>>,
    estimator: Option<Py<PyAny>>,
) -> PyResult<Run> {
    let config = configuration(config, start, seed)?;
    let trial = Trial::new(config, self::duration(duration)?);
    let callbacks = Callbacks {
        operator,
        trigger,
        estimator,
    };
    let running = match hip {
        None => Running::try_new(&trial),
        Some(hip) if callbacks.operator.is_none() => Running::along(&trial, way(hip)?),
        Some(_) => return Err(PyValueError::new_err("give hip or operator, not both")),
    };
    let mut running = running.map_err(|error| refused(&error))?.with_packets();
    let room = usize::try_from(trial.duration.as_millis()).unwrap_or(ROOM_MAX);
    let mut ticks = Ticks::with_room(room.min(ROOM_MAX));
    if callbacks.are_none() {
        while !running.is_over() {
            let block = || block(&mut running, &mut ticks);
            py.detach(block).map_err(|error| refused(&error))?;
            py.check_signals()?;
        }
    } else {
        called(py, &callbacks, &mut running, &mut ticks)?;
    }
    let packets = running.take_packets();
    finished(py, &trial, &running, (ticks, packets))
}

/// The way of these samples.
fn way(hip: &Bound<'_, PyAny>) -> PyResult<Trace> {
    let (hip, shape) = numbers(hip)?;
    let wrong =
        || PyValueError::new_err("hip must be finite numbers of shape (K, 2), K at least 1");
    if shape.get(1..) != Some(&[2]) || hip.iter().any(|value| !value.is_finite()) {
        return Err(wrong());
    }
    let (rows, _) = hip.as_chunks::<2>();
    let samples = rows.iter().zip(0_u32..);
    let samples = samples.map(|([x, y], n)| (TICK * n, Vec2::new(*x, *y)));
    Trace::of_samples(samples).ok_or_else(wrong)
}

/// The next milliseconds.
fn block(running: &mut Running, ticks: &mut Ticks) -> Result<(), TrialError> {
    for _ in 0..BLOCK {
        if running.is_over() {
            break;
        }
        let tick = running.step(Given::default())?;
        ticks.push(running.world(), &tick);
    }
    Ok(())
}

/// The whole run with functions of Python in it.
fn called(
    py: Python<'_>,
    callbacks: &Callbacks,
    running: &mut Running,
    ticks: &mut Ticks,
) -> PyResult<()> {
    let mut before: Option<WorldTick> = None;
    while !running.is_over() {
        let tick = callbacks.step(py, running, before.as_ref())?;
        ticks.push(running.world(), &tick);
        before = Some(tick);
    }
    Ok(())
}

/// What it came to.
fn finished(
    py: Python<'_>,
    trial: &Trial,
    running: &Running,
    (ticks, packets): (Ticks, WorldPackets),
) -> PyResult<Run> {
    let world = running.world();
    let truth = world.slave().environment().truth();
    let Arrays { named, updates } = ticks.arrays(py)?;
    let config = toml::to_string(&trial.config);
    Ok(Run {
        arrays: named,
        updates,
        update: PyOnceLock::new(),
        packets,
        table: PyOnceLock::new(),
        measured: running.measured(),
        parameters_true: [truth.m(), truth.b(), truth.c()],
        config: config.map_err(|error| PyValueError::new_err(error.to_string()))?,
    })
}
