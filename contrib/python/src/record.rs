//! `mmt.read`: a recorded session as columns.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use mmt_shared::io::record::{Ended, RecordError, read as read_record};
use mmt_shared::record::messages::Value;
use mmt_shared::record::table::values;
use pyo3::exceptions::{PyKeyError, PyOSError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyList};

use crate::arrays::{column, rows, words};

/// The field of every message that holds its time.
const STAMP: &str = "stamp";

/// A column that is being filled.
enum Column {
    Number(Vec<f64>),
    Whole(Vec<u64>),
    Truth(Vec<bool>),
    Text(Vec<String>),
    Bytes(Vec<Vec<u8>>),
    Matrix(Vec<f64>),
}

impl Column {
    fn of(value: &Value) -> Self {
        match value {
            Value::Number(_) => Self::Number(Vec::new()),
            Value::Whole(_) => Self::Whole(Vec::new()),
            Value::Truth(_) => Self::Truth(Vec::new()),
            Value::Text(_) => Self::Text(Vec::new()),
            Value::Bytes(_) => Self::Bytes(Vec::new()),
            Value::Matrix(_) => Self::Matrix(Vec::new()),
        }
    }

    /// A field has one type.
    fn push(&mut self, value: Value) {
        match (self, value) {
            (Self::Number(column), Value::Number(value)) => column.push(value),
            (Self::Whole(column), Value::Whole(value)) => column.push(value),
            (Self::Truth(column), Value::Truth(value)) => column.push(value),
            (Self::Text(column), Value::Text(value)) => column.push(value),
            (Self::Bytes(column), Value::Bytes(value)) => column.push(value),
            (Self::Matrix(column), Value::Matrix(value)) => column.extend(value),
            _ => {}
        }
    }

    fn array(self, py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
        match self {
            Self::Number(values) => Ok(column(py, values)),
            Self::Whole(values) => Ok(column(py, values)),
            Self::Truth(values) => Ok(column(py, values)),
            Self::Text(values) => words(py, &values),
            Self::Matrix(values) => rows(py, values, 9),
            Self::Bytes(values) => {
                let values = values.iter().map(|bytes| PyBytes::new(py, bytes));
                Ok(PyList::new(py, values.collect::<Vec<_>>())?.into_any())
            }
        }
    }
}

/// The columns of a topic.
type Topic = Vec<(&'static str, Column)>;

/// What was read.
struct Read {
    topics: BTreeMap<String, Topic>,
    /// The first stamp, ns.
    began: u64,
    ended: Ended,
}

fn read_all(path: &Path) -> Result<Read, RecordError> {
    let (mut topics, mut began) = (BTreeMap::<String, Topic>::new(), u64::MAX);
    let ended = read_record(path, |name, message| -> Result<(), RecordError> {
        let Some(fields) = values(name, message) else {
            return Ok(());
        };
        let fields = fields.map_err(|why| RecordError::Message {
            topic: name.to_owned(),
            why,
        })?;
        if !topics.contains_key(name) {
            let begin = |(name, value): &(&'static str, Value)| (*name, Column::of(value));
            topics.insert(name.to_owned(), fields.iter().map(begin).collect());
        }
        if let Some(topic) = topics.get_mut(name) {
            for ((_, column), (name, value)) in topic.iter_mut().zip(fields) {
                if let (STAMP, Value::Whole(stamp)) = (name, &value) {
                    began = began.min(*stamp);
                }
                column.push(value);
            }
        }
        Ok(())
    })?;
    Ok(Read {
        topics,
        began,
        ended,
    })
}

/// A recorded session.
///
/// topics: a dict of the topics with flat messages (docs/records.md), each a dict of columns, a row a message in the order of the
/// file: "/master/ticks", "/slave/ticks", "/master/packets", "/slave/packets", "/master/arrivals", ... A column has the name of
/// its field, which ends with its unit, and shape (N,): float64 (NaN where nothing is known), uint64, bool or words; a matrix is
/// (N, 9), bytes are a list. "stamp" is ns since 1970, "time" the same as s since the first message of the record.
/// cut_off: whether the file ends in the middle; what was written until then is there. record[topic] is record.topics[topic].
#[pyclass(frozen, module = "mmt")]
pub(crate) struct Record {
    #[pyo3(get)]
    topics: Py<PyDict>,
    #[pyo3(get)]
    cut_off: bool,
}

#[pymethods]
impl Record {
    fn __getitem__<'py>(&self, py: Python<'py>, topic: &str) -> PyResult<Bound<'py, PyAny>> {
        let found = self.topics.bind(py).get_item(topic)?;
        found.ok_or_else(|| PyKeyError::new_err(topic.to_owned()))
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        let cut = if self.cut_off { ", cut off" } else { "" };
        format!("<mmt.Record of {} topics{cut}>", self.topics.bind(py).len())
    }
}

/// Reads a record that `mmt demo`, `mmt slave` or `mmt master` made with --record; one whose session ended in the
/// middle up to there.
///
/// record: a path. Raises OSError if it cannot be read, ValueError if it is no sound record. Releases the GIL.
#[pyfunction]
pub(crate) fn read(py: Python<'_>, record: PathBuf) -> PyResult<Record> {
    let read = py.detach(|| read_all(&record));
    let read = read.map_err(|error| match error {
        RecordError::Io(why) => match why.raw_os_error() {
            Some(number) => PyOSError::new_err((number, why.to_string(), record.clone())),
            None => PyOSError::new_err(why.to_string()),
        },
        other => PyValueError::new_err(format!("{}: {other}", record.display())),
    })?;
    let topics = PyDict::new(py);
    for (name, columns) in read.topics {
        let topic = PyDict::new(py);
        for (name, column) in columns {
            if let (STAMP, Column::Whole(stamps)) = (name, &column) {
                let since = |stamp: &u64| (stamp - read.began) as f64 * 1e-9;
                topic.set_item("time", self::column(py, stamps.iter().map(since).collect()))?;
            }
            topic.set_item(name, column.array(py)?)?;
        }
        topics.set_item(name, topic)?;
    }
    Ok(Record {
        topics: topics.unbind(),
        cut_off: read.ended == Ended::CutOff,
    })
}
