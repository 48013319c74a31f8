//! What tests of this crate run, and whoever else wants to: the fuzz targets.

pub mod fuzz;
