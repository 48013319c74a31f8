//! placeholder

pub mod estimator;
