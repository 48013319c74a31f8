//! Columns of numbers and words as arrays of numpy.

use std::collections::BTreeMap;

use numpy::{Element, PyArray1, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyList;

/// Numbers as Python gives them, whatever their type and layout: in the order of rows, and their shape.
///
/// # Errors
/// What numpy raises of what are no numbers.
pub(crate) fn numbers(given: &Bound<'_, PyAny>) -> PyResult<(Vec<f64>, Vec<usize>)> {
    let numpy = given.py().import("numpy")?;
    // a field of a structured array need not be aligned
    let array = numpy.call_method1("require", (given, "float64", ["C", "ALIGNED"]))?;
    let array: PyReadonlyArrayDyn<'_, f64> = array.extract()?;
    Ok((array.as_slice()?.to_vec(), array.shape().to_vec()))
}

/// An array of one number a row.
pub(crate) fn column<'py, T: Element>(py: Python<'py>, values: Vec<T>) -> Bound<'py, PyAny> {
    PyArray1::from_vec(py, values).into_any()
}

/// An array of `width` numbers a row.
pub(crate) fn rows(py: Python<'_>, values: Vec<f64>, width: usize) -> PyResult<Bound<'_, PyAny>> {
    let shape = [values.len() / width, width];
    Ok(PyArray1::from_vec(py, values).reshape(shape)?.into_any())
}

/// An array of words, of which few are different: each is a place in `known`.
pub(crate) fn of_known<'py>(
    py: Python<'py>,
    known: &[&str],
    places: Vec<u8>,
) -> PyResult<Bound<'py, PyAny>> {
    let known = py
        .import("numpy")?
        .call_method1("array", (known.to_vec(),))?;
    known.call_method1("take", (column(py, places),))
}

/// An array of words.
pub(crate) fn words<'py>(py: Python<'py>, words: &[String]) -> PyResult<Bound<'py, PyAny>> {
    let mut places: BTreeMap<&str, i64> = BTreeMap::new();
    for word in words {
        let next = places.len() as i64;
        places.entry(word).or_insert(next);
    }
    let of = |word: &String| places.get(word.as_str()).copied().unwrap_or_default();
    let taken = words.iter().map(of).collect();
    let mut known: Vec<(&str, i64)> = places.iter().map(|(word, at)| (*word, *at)).collect();
    known.sort_by_key(|(_, at)| *at);
    let known: Vec<&str> = known.into_iter().map(|(word, _)| word).collect();
    // an array of no words still is one of words
    let dtype = [("dtype", "U")];
    let numpy = py.import("numpy")?;
    let known = numpy.call_method(
        "array",
        (PyList::new(py, known)?,),
        Some(&keywords(py, dtype)?),
    )?;
    known.call_method1("take", (column(py, taken),))
}

/// Keywords of a call.
fn keywords<'py, const N: usize>(
    py: Python<'py>,
    pairs: [(&str, &str); N],
) -> PyResult<Bound<'py, pyo3::types::PyDict>> {
    let dict = pyo3::types::PyDict::new(py);
    for (key, value) in pairs {
        dict.set_item(key, value)?;
    }
    Ok(dict)
}

/// One structured array of columns of equal length.
pub(crate) fn structured<'py>(
    py: Python<'py>,
    length: usize,
    columns: &[(&str, Bound<'py, PyAny>)],
) -> PyResult<Bound<'py, PyAny>> {
    let mut fields = Vec::new();
    for (name, column) in columns {
        fields.push((*name, column.getattr("dtype")?));
    }
    let table = py
        .import("numpy")?
        .call_method1("empty", (length, fields))?;
    for (name, column) in columns {
        table.set_item(*name, column)?;
    }
    Ok(table)
}
