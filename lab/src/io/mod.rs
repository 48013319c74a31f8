//! The shell of the lab: threads for the trials, a folder for the files, a clock for what things cost.

#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "the shell of the lab: threads, files and clocks are its business"
)]

mod cost;
mod failure;
mod folder;
mod runner;
mod swarm;
mod sweep_dir;
mod threads;
pub mod transport_bench;
pub mod virtual_time;

pub use cost::estimator_tick_ms;
pub use failure::Failure;
pub use folder::Folder;
pub use runner::{FRESH_SEED, Progress, Runner};
pub use swarm::{Repeated, swarm_of};
pub use sweep_dir::{SweepDir, SweepError};
