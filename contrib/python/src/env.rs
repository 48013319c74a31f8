//! `mmt.Env`: a run that is stepped from Python, in the form of Gymnasium.

use std::time::Duration;

use mmt_client::failsafe::LinkState;
use mmt_lab::trial::{Running, Trial};
use mmt_lab::world::{Given, WorldConfig, WorldTick};
use mmt_server::estimator;
use mmt_server::slave::Substitutes;
use mmt_server::trigger;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::model::update::Cause;
use mmt_shared::time::Time;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::arrays::{column, numbers};
use crate::callbacks::cause;
use crate::config::{configuration, duration};
use crate::run::{metrics, refused};

/// The most milliseconds of a step.
const TICKS_MAX: u32 = 1000;

/// What an observation holds.
const OBSERVATION: [&str; 11] = [
    "hip_x_m",
    "hip_y_m",
    "force_on_hand_x_n",
    "force_on_hand_y_n",
    "model_x_m",
    "model_y_m",
    "model_angle_rad",
    "touching",
    "model_m_kg",
    "model_b_ns_per_m",
    "model_c_n",
];

/// What an agent does in a step.
struct Action {
    /// The HIP of each millisecond, m.
    hips: Vec<Vec2>,
    /// m, b, c in the place of the estimate.
    parameters: Option<[f64; 3]>,
    /// The answer of the update scheme to the first sample; none where the configuration's decides.
    send: Option<Option<Cause>>,
}

/// A run that is stepped from outside, in the form of Gymnasium (which it does not need): for operators, estimators and update
/// schemes of one's own.
///
/// config, start: as those of `run`. duration: of an episode, s. ticks: milliseconds of a step, 1 to 1000.
///
/// An action is the HIP, m: (2,), to which the hand goes evenly over the step, or (ticks, 2), a row a millisecond. Or
/// a dict: "hip", such an array; "parameters", (m, b, c) in kg, N s/m, N, which the slave takes in the place of its
/// estimate in this step, if they are accepted; "send", True, False or a cause ("deadband", "timer", "every_sample"),
/// in the place of the update scheme: once, in the first sample of the step. What a dict leaves out is mmt's own, for
/// "hip" the scripted operator.
///
/// An observation is what the hand feels and sees, float64, (11,), of the names in OBSERVATION: where the hand is, the force on it,
/// the master's model as the hand has it, and its parameters. The reward is always 0.0: what is good the user decides, in a wrapper. Terminated: the
/// link was silent for so long that the hand was released. Truncated: the duration is over.
///
/// info: time, s; from the first sample on that the slave plays, its stamp, s, and the slave's tool, f_s and
/// f_shadow, (2,), m and N, in_contact, and f_m_played, (2,), where the sample was not lost; pose_true, (3,), m and
/// rad; parameters_estimate, parameters_true, (3,); parameters_refused, how often m, b, c were not accepted so far;
/// updates, the causes of those sent in the step; link, "fresh", "late", "stale" or "released"; and at the end
/// metrics, as those of `Run`.
#[pyclass(module = "mmt")]
pub(crate) struct Env {
    config: WorldConfig,
    start: String,
    duration: Duration,
    ticks: u32,
    /// Seed of the next episode if none is given.
    next_seed: Option<u64>,
    running: Option<Running>,
    hip: Vec2,
    last: Option<WorldTick>,
}

#[pymethods]
impl Env {
    #[new]
    #[pyo3(signature = (config=None, *, duration=20.0, ticks=10, start="live"))]
    fn new(
        config: Option<&Bound<'_, PyAny>>,
        duration: f64,
        ticks: u32,
        start: &str,
    ) -> PyResult<Self> {
        if !(1..=TICKS_MAX).contains(&ticks) {
            let what = format!("ticks is {ticks}; it must be 1 to {TICKS_MAX}");
            return Err(PyValueError::new_err(what));
        }
        Ok(Self {
            config: configuration(config, start, None)?,
            start: start.to_owned(),
            duration: self::duration(duration)?,
            ticks,
            next_seed: None,
            running: None,
            hip: Vec2::zeros(),
            last: None,
        })
    }

    /// Names of the numbers of an observation, in their order.
    #[classattr]
    #[pyo3(name = "OBSERVATION")]
    fn observation_names(py: Python<'_>) -> PyResult<Py<PyTuple>> {
        Ok(PyTuple::new(py, OBSERVATION)?.unbind())
    }

    /// Begins an episode: (observation, info).
    ///
    /// seed: of everything random; if None that of the configuration in the first episode, and one more in each that follows.
    /// options: {"config": ...} goes on with another configuration.
    #[pyo3(signature = (*, seed=None, options=None))]
    fn reset<'py>(
        &mut self,
        py: Python<'py>,
        seed: Option<u64>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyDict>)> {
        if let Some(options) = options
            && let Some(config) = options.get_item("config")?
        {
            self.config = configuration(Some(&config), &self.start, None)?;
        }
        let mut config = self.config.clone();
        if let Some(seed) = seed.or(self.next_seed) {
            config = config.seeded(seed);
        }
        self.next_seed = Some(config.seed.wrapping_add(1));
        let trial = Trial::new(config, self.duration);
        let running = Running::try_new(&trial).map_err(|error| refused(&error))?;
        self.hip = running.world().operator().start();
        self.last = None;
        let running = self.running.insert(running);
        let seen = observation(py, running, None, self.hip);
        let info = info(py, running, None, &[])?;
        Ok((seen, info))
    }

    /// Goes on by a step: (observation, reward, terminated, truncated, info). Releases the GIL.
    #[allow(
        clippy::type_complexity,
        reason = "the form of Gymnasium: five things, in this order"
    )]
    fn step<'py>(
        &mut self,
        py: Python<'py>,
        action: &Bound<'py, PyAny>,
    ) -> PyResult<(Bound<'py, PyAny>, f64, bool, bool, Bound<'py, PyDict>)> {
        let action = self.action(action)?;
        let (ticks, last) = (self.ticks, &mut self.last);
        let running = self.running.as_mut();
        let running = running.ok_or_else(|| PyRuntimeError::new_err("call reset() first"))?;
        if running.is_over() {
            return Err(PyRuntimeError::new_err("the episode is over: call reset()"));
        }
        let updates = py.detach(|| go_on(running, ticks, &action, last));
        let updates = updates.map_err(|error| refused(&error))?;
        let last = last.as_ref();
        self.hip = last.map_or(self.hip, |_| running.world().master().reading());
        let released = last.is_some_and(|tick| tick.master.link == LinkState::Released);
        let (seen, over) = (observation(py, running, last, self.hip), running.is_over());
        let info = info(py, running, last, &updates)?;
        if over || released {
            info.set_item("metrics", metrics(py, &running.measured())?)?;
        }
        Ok((seen, 0.0, released, over, info))
    }

    /// Ends: there is nothing to be closed.
    fn close(&mut self) {
        (self.running, self.last) = (None, None);
    }
}

impl Env {
    fn action(&self, given: &Bound<'_, PyAny>) -> PyResult<Action> {
        let Ok(dict) = given.cast::<PyDict>() else {
            let hips = self.hips(given)?;
            return Ok(Action {
                hips,
                parameters: None,
                send: None,
            });
        };
        for key in dict.keys() {
            let key: String = key.extract()?;
            if !["hip", "parameters", "send"].contains(&key.as_str()) {
                let what = format!("an action has no '{key}', only 'hip', 'parameters' and 'send'");
                return Err(PyValueError::new_err(what));
            }
        }
        let hip = dict.get_item("hip")?;
        let parameters = dict.get_item("parameters")?;
        let send = dict.get_item("send")?;
        Ok(Action {
            hips: hip.map_or(Ok(Vec::new()), |hip| self.hips(&hip))?,
            parameters: parameters.map(|three| three.extract()).transpose()?,
            send: send.map(|answer| cause(&answer)).transpose()?,
        })
    }

    /// The HIP of each millisecond of a step.
    fn hips(&self, given: &Bound<'_, PyAny>) -> PyResult<Vec<Vec2>> {
        let (numbers, shape) = numbers(given)?;
        let wrong = || {
            let what = format!(
                "a HIP must be finite numbers, m, of shape (2,) or ({}, 2)",
                self.ticks
            );
            PyValueError::new_err(what)
        };
        if numbers.iter().any(|number| !number.is_finite()) {
            return Err(wrong());
        }
        match (shape.as_slice(), numbers.as_slice()) {
            ([2], [x, y]) => {
                let (from, way) = (self.hip, Vec2::new(*x, *y) - self.hip);
                let share = |n: u32| f64::from(n) / f64::from(self.ticks);
                Ok((1..=self.ticks).map(|n| from + way * share(n)).collect())
            }
            ([rows, 2], _) if *rows == self.ticks as usize => {
                let (pairs, _) = numbers.as_chunks::<2>();
                Ok(pairs.iter().map(|[x, y]| Vec2::new(*x, *y)).collect())
            }
            _ => Err(wrong()),
        }
    }
}

/// The milliseconds of a step, and the causes of the updates in it.
fn go_on(
    running: &mut Running,
    ticks: u32,
    action: &Action,
    last: &mut Option<WorldTick>,
) -> Result<Vec<&'static str>, mmt_lab::trial::TrialError> {
    let mut updates = Vec::new();
    let (mut hips, mut send) = (action.hips.iter(), action.send.flatten());
    for _ in 0..ticks {
        if running.is_over() {
            break;
        }
        let mut estimator = |_: Time, _: &estimator::Measured| action.parameters;
        let mut scheme = |_: Time, _: &trigger::TriggerInput| send.take();
        let slave = Substitutes {
            estimator: action.parameters.is_some().then_some(&mut estimator as _),
            scheme: action.send.is_some().then_some(&mut scheme as _),
        };
        let hip = hips.next().copied();
        let tick = running.step(Given { hip, slave })?;
        let update = tick.slave.and_then(|slave| slave.update);
        updates.extend(update.map(|update| update.cause.name()));
        *last = Some(tick);
    }
    Ok(updates)
}

fn observation<'py>(
    py: Python<'py>,
    running: &Running,
    last: Option<&WorldTick>,
    hip: Vec2,
) -> Bound<'py, PyAny> {
    let master = running.world().master();
    let force = last.map_or(Vec2::zeros(), |tick| tick.master.hand_force);
    let touching = last.is_some_and(|tick| tick.master.rendered.in_contact());
    // as the hand has it, as the place of the hand is
    let (pose, params) = (master.view().pose, &master.model().state().params);
    let numbers = [
        hip.x,
        hip.y,
        force.x,
        force.y,
        pose.position.x,
        pose.position.y,
        pose.angle,
        f64::from(u8::from(touching)),
        params.m(),
        params.b(),
        params.c(),
    ];
    column(py, numbers.to_vec())
}

fn info<'py>(
    py: Python<'py>,
    running: &Running,
    last: Option<&WorldTick>,
    updates: &[&'static str],
) -> PyResult<Bound<'py, PyDict>> {
    let (world, info) = (running.world(), PyDict::new(py));
    let slave = last.and_then(|tick| tick.slave);
    let vector = |v: Vec2| column(py, vec![v.x, v.y]);
    let link = last.map_or("fresh", |tick| match tick.master.link {
        LinkState::Fresh => "fresh",
        LinkState::Late => "late",
        LinkState::Stale => "stale",
        LinkState::Released => "released",
    });
    let (estimate, environment) = (world.slave().estimate(), world.slave().environment());
    let truth = environment.truth();
    let pose = slave.map_or(environment.pose(), |tick| tick.truth);
    info.set_item("time", last.map_or(0.0, |tick| tick.now.as_secs_f64()))?;
    if let Some(tick) = slave {
        info.set_item("stamp", tick.stamp.as_secs_f64())?;
        info.set_item("tool", vector(tick.tool))?;
        info.set_item("f_s", vector(tick.f_s))?;
        info.set_item("f_shadow", vector(tick.f_shadow))?;
        info.set_item("in_contact", tick.in_contact)?;
        if let Some(f_m) = tick.f_m {
            info.set_item("f_m_played", vector(f_m))?;
        }
    }
    info.set_item(
        "pose_true",
        column(py, vec![pose.position.x, pose.position.y, pose.angle]),
    )?;
    info.set_item(
        "parameters_estimate",
        column(py, vec![estimate.m, estimate.b, estimate.c]),
    )?;
    info.set_item(
        "parameters_true",
        column(py, vec![truth.m(), truth.b(), truth.c()]),
    )?;
    info.set_item("parameters_refused", world.slave().refused_estimates())?;
    info.set_item("updates", updates)?;
    info.set_item("link", link)?;
    Ok(info)
}
