//! What the tests of this crate share with the fuzzers of `tests/fuzz`: the fuzz targets.

pub mod fuzz;
