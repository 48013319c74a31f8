//! placeholder

pub mod estimator;
pub mod trigger;
