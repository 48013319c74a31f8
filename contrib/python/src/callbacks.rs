//! Functions of Python in the place of the operator, the estimator and the update scheme.

use std::cell::RefCell;

use mmt_lab::trial::Running;
use mmt_lab::world::{Given, WorldTick};
use mmt_server::estimator;
use mmt_server::slave::Substitutes;
use mmt_server::trigger;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::model::update::Cause;
use mmt_shared::time::{TICK_S, Time};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// What a scheme may give as the cause of an update.
const CAUSES: [Cause; 3] = [Cause::Deadband, Cause::Timer, Cause::EverySample];

/// x and y.
type Pair = (f64, f64);

fn pair(v: Vec2) -> Pair {
    (v.x, v.y)
}

/// A vector as Python gives it: any sequence of two numbers.
///
/// # Errors
/// `TypeError` or `ValueError` of anything else, of NaN and of infinities too.
pub(crate) fn vector(given: &Bound<'_, PyAny>, what: &str) -> PyResult<Vec2> {
    let [x, y]: [f64; 2] = given.extract()?;
    if x.is_finite() && y.is_finite() {
        return Ok(Vec2::new(x, y));
    }
    Err(PyValueError::new_err(format!(
        "{what} is ({x}, {y}): it must be finite"
    )))
}

/// The inputs of the update scheme in one sample.
///
/// time: stamp of the HIP sample, s. f_s: measured force on the object, (x, y), N. f_m: force of the master's model, as the
/// slave knows it, (x, y), N. noise_n: standard deviation of f_s per axis where it is more than the default sensor's, else 0, N.
/// slave_in_contact, shadow_in_contact: whether the tool touches the object, and the HIP the master's model. hip_stands:
/// whether the HIP is where it was a sample before. sticking: whether the object stands although it is pushed. speed,
/// acceleration: of the object along the push, m/s and m/s^2. force_deviation: standard deviation of the force that
/// the estimate predicts, N. parameters: (m, b, c) that an update would carry, kg, N s/m, N. only_friction_holds:
/// whether the tool is in front of another face than it touched last, of an object that has been moved. shift: by how much it
/// would move the master's object, (x, y), m. shift_deviation: its standard deviation per axis while nobody touches
/// the object, else 0, m. turn: by how much it would turn the object, rad. turn_deviation: its standard deviation, rad.
#[pyclass(frozen, get_all, module = "mmt")]
pub(crate) struct TriggerInput {
    time: f64,
    f_s: Pair,
    f_m: Pair,
    noise_n: f64,
    slave_in_contact: bool,
    shadow_in_contact: bool,
    hip_stands: bool,
    sticking: bool,
    speed: f64,
    acceleration: f64,
    force_deviation: f64,
    parameters: (f64, f64, f64),
    only_friction_holds: bool,
    shift: Pair,
    shift_deviation: f64,
    turn: f64,
    turn_deviation: f64,
}

impl TriggerInput {
    fn of(stamp: Time, input: &trigger::TriggerInput) -> Self {
        let params = &input.params;
        Self {
            time: stamp.as_secs_f64(),
            f_s: pair(input.f_s),
            f_m: pair(input.f_m),
            noise_n: input.noise_n,
            slave_in_contact: input.slave_in_contact,
            shadow_in_contact: input.shadow_in_contact,
            hip_stands: input.hip_stands,
            sticking: input.sticking,
            speed: input.speed,
            acceleration: input.acceleration,
            force_deviation: input.force_deviation,
            parameters: (params.m(), params.b(), params.c()),
            only_friction_holds: input.only_friction_holds,
            shift: pair(input.shift),
            shift_deviation: input.shift_deviation,
            turn: input.turn,
            turn_deviation: input.turn_deviation,
        }
    }
}

/// What the slave measured in one sample, for an estimator.
///
/// time: stamp of the HIP sample, s. tool: (x, y), m. back: how far the tool stands back from there by a spring of its own,
/// (x, y), m. force: f_s on the object, (x, y), N. force_noise_n: its noise per axis where it is more than the default
/// sensor's, else 0, N. held_back: whether the limit of the tool's force keeps it from the HIP. normal: inward unit normal of
/// the touched face, (x, y), or None without contact. centre: of the object as it is seen, (x, y), m, or None. side: of the
/// object as the model has it, m, or None. turning: rate of the touched face, rad/s, or None.
#[pyclass(frozen, get_all, module = "mmt")]
pub(crate) struct Measured {
    time: f64,
    tool: Pair,
    back: Pair,
    force: Pair,
    force_noise_n: f64,
    held_back: bool,
    normal: Option<Pair>,
    centre: Option<Pair>,
    side: Option<f64>,
    turning: Option<f64>,
}

impl Measured {
    fn of(stamp: Time, measured: &estimator::Measured) -> Self {
        Self {
            time: stamp.as_secs_f64(),
            tool: pair(measured.tool),
            back: pair(measured.back),
            force: pair(measured.force),
            force_noise_n: measured.force_noise_n,
            held_back: measured.held_back,
            normal: measured.normal.map(pair),
            centre: measured.seen.map(|seen| pair(seen.centre)),
            side: measured.seen.map(|seen| seen.side),
            turning: measured.seen.map(|seen| seen.turning),
        }
    }
}

/// Whether an update is to be sent, and as what: True, False, None or a cause's name.
///
/// # Errors
/// `ValueError` of anything else.
pub(crate) fn cause(answer: &Bound<'_, PyAny>) -> PyResult<Option<Cause>> {
    if answer.is_none() {
        return Ok(None);
    }
    if let Ok(sends) = answer.extract::<bool>() {
        return Ok(sends.then_some(Cause::Deadband));
    }
    let name: String = answer.extract().unwrap_or_default();
    let known = CAUSES.into_iter().find(|cause| cause.name() == name);
    known.map(Some).ok_or_else(|| {
        let names = CAUSES.map(Cause::name).join(", ");
        let what =
            format!("{answer} is no answer of a scheme: True, False, None or one of {names}");
        PyValueError::new_err(what)
    })
}

/// The functions of a run.
pub(crate) struct Callbacks {
    pub(crate) operator: Option<Py<PyAny>>,
    pub(crate) trigger: Option<Py<PyAny>>,
    pub(crate) estimator: Option<Py<PyAny>>,
}

impl Callbacks {
    /// Whether there is none.
    pub(crate) fn are_none(&self) -> bool {
        self.operator.is_none() && self.trigger.is_none() && self.estimator.is_none()
    }

    /// Where the operator has the hand after the tick before. All that it is given is as the hand has it: the HIP may have been
    /// carried to elsewhere than the device.
    fn hip(
        &self,
        py: Python<'_>,
        running: &Running,
        before: Option<&WorldTick>,
    ) -> PyResult<Option<Vec2>> {
        let Some(operator) = &self.operator else {
            return Ok(None);
        };
        let view = running.world().master().view();
        let start = running.world().operator().start();
        let (time, hip, force) = before.map_or((0.0, start, Vec2::zeros()), |tick| {
            let hip = running.world().master().reading();
            (tick.now.as_secs_f64(), hip, tick.master.hand_force)
        });
        let pose = (view.pose.position.x, view.pose.position.y, view.pose.angle);
        let answer = operator.call1(py, (time + TICK_S, pair(hip), pair(force), pose))?;
        vector(answer.bind(py), "the HIP of the operator").map(Some)
    }

    /// One millisecond.
    ///
    /// # Errors
    /// What a function raises, or why its answer cannot be used.
    pub(crate) fn step(
        &self,
        py: Python<'_>,
        running: &mut Running,
        before: Option<&WorldTick>,
    ) -> PyResult<WorldTick> {
        let hip = self.hip(py, running, before)?;
        let failed: RefCell<Option<PyErr>> = RefCell::new(None);
        let mut scheme = |stamp: Time, input: &trigger::TriggerInput| {
            let answer = self.trigger.as_ref()?;
            let answer = answer.call1(py, (TriggerInput::of(stamp, input),));
            let answer = answer.and_then(|answer| cause(answer.bind(py)));
            answer
                .map_err(|error| *failed.borrow_mut() = Some(error))
                .ok()?
        };
        let mut estimator = |stamp: Time, measured: &estimator::Measured| {
            let answer = self.estimator.as_ref()?;
            let answer = answer.call1(py, (Measured::of(stamp, measured),));
            let answer = answer.and_then(|answer| answer.extract::<Option<[f64; 3]>>(py));
            answer
                .map_err(|error| *failed.borrow_mut() = Some(error))
                .ok()?
        };
        let slave = Substitutes {
            estimator: self.estimator.is_some().then_some(&mut estimator as _),
            scheme: self.trigger.is_some().then_some(&mut scheme as _),
        };
        let tick = running.step(Given { hip, slave });
        if let Some(error) = failed.into_inner() {
            return Err(error);
        }
        tick.map_err(|error| PyValueError::new_err(error.to_string()))
    }
}
