//! `mmt.sweep`: the rows of a plan on threads, in a folder as `mmt sweep` keeps it.

use std::num::NonZero;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use mmt_lab::io::{SweepDir, SweepError};
use mmt_lab::layers::{Layers, Program};
use mmt_lab::sweep::{Plan, Results, Shard};
use pyo3::exceptions::{PyOSError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{column, words};
use crate::config::Source;

/// How often somebody looks whether the end is wanted.
const LOOK: Duration = Duration::from_millis(50);

fn failed(error: SweepError) -> PyErr {
    match error {
        SweepError::File { path, why } => match why.raw_os_error() {
            Some(number) => PyOSError::new_err((number, why.to_string(), path)),
            None => PyOSError::new_err(format!("{}: {why}", path.display())),
        },
        SweepError::Part(_) | SweepError::Trial { .. } => PyValueError::new_err(error.to_string()),
        SweepError::Interrupted => PyRuntimeError::new_err(error.to_string()),
    }
}

/// Runs the rows of a plan (docs/sweep.md) that the folder does not hold yet, and returns those that it holds then.
///
/// plan: a text in TOML, a path to a file, or a dict of the same keys. out: the folder; it is left as `mmt sweep`
/// leaves it, byte by byte, and a sweep that was begun by the one goes on with the other. config: the configuration
/// below the plan, as that of `run`. jobs: threads; all cores if None. shard: "I/N" runs every N-th row from the I-th
/// on.
///
/// Returns a dict of columns, a row a row of the plan that is done: "row", a column per key of the axes, "seed", the
/// measured columns. Numbers are float64, NaN where a measure has no meaning; "row" and "seed" are uint64; "digest"
/// and the keys of axes that are not numbers are words.
///
/// Releases the GIL. Ctrl-C ends it at once; the rows that are done stay, and the same call goes on. Raises
/// ValueError with line and caret of what is wrong with the plan, and where the folder holds another plan's rows;
/// OSError where it cannot be written.
#[pyfunction]
#[pyo3(signature = (plan, out, *, config=None, jobs=None, shard=None))]
pub(crate) fn sweep<'py>(
    py: Python<'py>,
    plan: &Bound<'py, PyAny>,
    out: PathBuf,
    config: Option<&Bound<'py, PyAny>>,
    jobs: Option<usize>,
    shard: Option<&str>,
) -> PyResult<Bound<'py, PyDict>> {
    let (source, below) = (Source::of(Some(plan))?, Source::of(config)?);
    let layers = Layers {
        program: Program::Sweep,
        file: &below.text,
        flags: &[],
        seed: None,
    };
    layers.config().map_err(|error| below.refused(error))?;
    let plan = Plan::parse_over(&source.text, &below.text);
    let plan = plan.map_err(|error| source.refused(error))?;
    let jobs = match jobs {
        None => None,
        Some(jobs) => Some(
            NonZero::new(jobs)
                .ok_or_else(|| PyValueError::new_err("jobs is 0; it must be 1 or more"))?,
        ),
    };
    let shard: Shard = match shard {
        None => Shard::WHOLE,
        Some(words) => words
            .parse()
            .map_err(|error| PyValueError::new_err(format!("shard: {error}")))?,
    };
    let dir = SweepDir::open(&out).map_err(failed)?;
    let before = py.detach(|| dir.results(&plan)).map_err(failed)?;
    // only now: the plan of a folder that holds another plan's rows stays
    dir.keep_plan(&source.text).map_err(failed)?;
    let rows = before.missing(&plan).filter(|row| shard.has(*row));
    let rows: Vec<u64> = rows.collect();
    run_rows(py, &dir, &plan, (shard, &rows, jobs))?;
    let results = py.detach(|| dir.results(&plan)).map_err(failed)?;
    if let Some(csv) = results.to_csv(&plan) {
        dir.keep_results(&csv).map_err(failed)?;
    }
    table(py, &plan, &results)
}

/// Runs the rows on threads of their own, while this one looks for signals.
fn run_rows(
    py: Python<'_>,
    dir: &SweepDir,
    plan: &Plan,
    (shard, rows, jobs): (Shard, &[u64], Option<NonZero<usize>>),
) -> PyResult<()> {
    let wish = AtomicBool::new(false);
    let ended = || wish.load(Ordering::Relaxed);
    let work = || dir.run(plan, shard, rows, jobs, ended, |_| {});
    py.detach(|| {
        std::thread::scope(|scope| {
            let (done, wait) = channel();
            scope.spawn(move || done.send(work()));
            loop {
                match wait.recv_timeout(LOOK) {
                    Ok(ran) => return ran.map_err(failed),
                    Err(RecvTimeoutError::Disconnected) => {
                        return Err(PyRuntimeError::new_err("a row failed without a word"));
                    }
                    Err(RecvTimeoutError::Timeout) => {}
                }
                let signal = Python::attach(|py| py.check_signals());
                if signal.is_err() {
                    wish.store(true, Ordering::Relaxed);
                    return signal;
                }
            }
        })
    })
}

/// The rows as columns.
fn table<'py>(py: Python<'py>, plan: &Plan, results: &Results) -> PyResult<Bound<'py, PyDict>> {
    let (names, rows) = results.table(plan);
    let axes: Vec<&str> = plan.keys().collect();
    let columns = PyDict::new(py);
    for (n, name) in names.iter().enumerate() {
        let cell = |row: &Vec<String>| row.get(n).cloned().unwrap_or_default();
        let cells: Vec<String> = rows.iter().map(cell).collect();
        let array = match name.as_str() {
            "row" | "seed" => {
                let wholes = cells.iter().map(|cell| cell.parse().unwrap_or_default());
                column::<u64>(py, wholes.collect())
            }
            "digest" => words(py, &cells)?,
            _ => {
                let numbers: Option<Vec<f64>> = cells.iter().map(|cell| number(cell)).collect();
                match numbers {
                    Some(numbers) => column(py, numbers),
                    None if axes.contains(&name.as_str()) => words(py, &cells)?,
                    None => return Err(PyValueError::new_err(format!("{name} is no number"))),
                }
            }
        };
        columns.set_item(name, array)?;
    }
    Ok(columns)
}

/// A number; NaN of an empty cell.
fn number(cell: &str) -> Option<f64> {
    if cell.is_empty() {
        return Some(f64::NAN);
    }
    cell.parse().ok()
}
