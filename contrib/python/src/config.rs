//! A configuration or a plan as Python gives it: a text in TOML, a path to one, or a dict of the same keys.

use std::fmt::Display;
use std::path::PathBuf;
use std::time::Duration;

use mmt_lab::layers::{Layers, Program, template};
use mmt_lab::sweep::Start;
use mmt_lab::world::WorldConfig;
use mmt_shared::model::settings::Mode;
use pyo3::exceptions::{PyOSError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};

/// Accepted length of a run, s: one tick to a week.
const DURATION_S: (f64, f64) = (0.001, 604_800.0);

/// A text in TOML, and the file that it is of.
pub(crate) struct Source {
    pub(crate) text: String,
    path: Option<PathBuf>,
}

impl Source {
    /// What was given. A str with `=` or a line's end in it is a text, any other str that is not empty a path.
    ///
    /// # Errors
    /// `OSError` of a file that cannot be read; `TypeError` of what is none of these; `ValueError` of a key or value of a dict
    /// that TOML does not have.
    pub(crate) fn of(given: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let text = |text| Ok(Self { text, path: None });
        let Some(given) = given else {
            return text(String::new());
        };
        if let Ok(dict) = given.cast::<PyDict>() {
            let mut lines = String::new();
            lines_of(dict, "", &mut lines)?;
            return text(lines);
        }
        if let Ok(words) = given.cast::<PyString>() {
            let words = words.to_cow()?;
            if words.trim().is_empty() || words.contains(['=', '\n']) {
                return text(words.into_owned());
            }
        }
        let path: PathBuf = given.extract().map_err(|_| {
            PyTypeError::new_err("a text in TOML, a path to a file or a dict is expected")
        })?;
        let read = std::fs::read_to_string(&path);
        let read = read.map_err(|error| match error.raw_os_error() {
            Some(number) => PyOSError::new_err((number, error.to_string(), path.clone())),
            None => PyOSError::new_err(format!("{}: {error}", path.display())),
        });
        read.map(|text| Self {
            text,
            path: Some(path),
        })
    }

    /// What is wrong with it.
    pub(crate) fn refused(&self, error: impl Display) -> PyErr {
        PyValueError::new_err(match &self.path {
            Some(path) => format!("{}: {error}", path.display()),
            None => error.to_string(),
        })
    }
}

/// Writes a dict as lines `a.b.c = value`, so that an error shows the whole key.
fn lines_of(dict: &Bound<'_, PyDict>, path: &str, lines: &mut String) -> PyResult<()> {
    for (key, value) in dict {
        let key = format!("{path}{}", bare(&key)?);
        match value.cast::<PyDict>() {
            Ok(inner) if !inner.is_empty() => lines_of(inner, &format!("{key}."), lines)?,
            _ => {
                let value = toml_of(&value).map_err(|error| {
                    PyValueError::new_err(format!("{key}: {}", error.value(value.py())))
                })?;
                lines.push_str(&format!("{key} = {value}\n"));
            }
        }
    }
    Ok(())
}

/// A key as it may stand in a text; one with other characters in quotes.
fn bare(key: &Bound<'_, PyAny>) -> PyResult<String> {
    let key: String = key.extract()?;
    let plain = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
    if !key.is_empty() && key.chars().all(plain) {
        return Ok(key);
    }
    Ok(toml::Value::String(key).to_string())
}

/// A value of Python or numpy in TOML.
fn toml_of(value: &Bound<'_, PyAny>) -> PyResult<toml::Value> {
    if let Ok(truth) = value.extract::<bool>() {
        return Ok(toml::Value::Boolean(truth));
    }
    if let Ok(whole) = value.extract::<i64>() {
        return Ok(toml::Value::Integer(whole));
    }
    if let Ok(text) = value.extract::<String>() {
        return Ok(toml::Value::String(text));
    }
    if let Ok(number) = value.extract::<f64>() {
        return Ok(toml::Value::Float(number));
    }
    if let Ok(dict) = value.cast::<PyDict>() {
        let mut table = toml::Table::new();
        for (key, value) in dict {
            table.insert(key.extract()?, toml_of(&value)?);
        }
        return Ok(toml::Value::Table(table));
    }
    let Ok(items) = value.try_iter() else {
        let kind = value.get_type().name()?;
        let what = format!("a value of type {kind} has no place in a configuration");
        return Err(PyTypeError::new_err(what));
    };
    let items: PyResult<Vec<toml::Value>> = items.map(|item| toml_of(&item?)).collect();
    Ok(toml::Value::Array(items?))
}

/// The configuration of a run in virtual time, as `mmt sweep` reads it.
///
/// # Errors
/// `ValueError` with key, line and range; as [`Source::of`].
pub(crate) fn configuration(
    given: Option<&Bound<'_, PyAny>>,
    start: &str,
    seed: Option<u64>,
) -> PyResult<WorldConfig> {
    let source = Source::of(given)?;
    let start = match start {
        "live" => Start::Live,
        "paper-experiment" => Start::PaperExperiment,
        _ => {
            let what = format!("start is '{start}'; it must be 'live' or 'paper-experiment'");
            return Err(PyValueError::new_err(what));
        }
    };
    let layers = Layers {
        program: Program::Sweep,
        file: &source.text,
        flags: &[],
        seed,
    };
    let config = layers.config_from(start);
    config.map_err(|error| source.refused(error))
}

/// How long a run is to be.
///
/// # Errors
/// `ValueError` of one that no run can have.
pub(crate) fn duration(seconds: f64) -> PyResult<Duration> {
    let (least, most) = DURATION_S;
    if (least..=most).contains(&seconds) {
        return Ok(Duration::from_secs_f64(seconds));
    }
    let what = format!("duration is {seconds}; it must be {least} to {most} s");
    Err(PyValueError::new_err(what))
}

/// Every key of a configuration with its default, its unit and what is accepted: a text in TOML, to be changed and given to
/// `run`, `sweep` or `Env`. The same as `mmt config default` prints.
///
/// mode: "recommended" or "paper".
#[pyfunction]
#[pyo3(signature = (mode="recommended"))]
pub(crate) fn default_config(mode: &str) -> PyResult<String> {
    let mode = match mode {
        "recommended" => Mode::Recommended,
        "paper" => Mode::Paper,
        _ => {
            let what = format!("mode is '{mode}'; it must be 'recommended' or 'paper'");
            return Err(PyValueError::new_err(what));
        }
    };
    template(mode).map_err(|error| PyValueError::new_err(error.to_string()))
}
