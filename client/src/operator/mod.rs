//! Operators: what moves the HIP when no hand does.

pub mod trace;
