//! The Python package `mmt`: Python's values become the lab's types, and what the lab computes becomes arrays; and a client of both
//! plugs of the live programs.
//!
//! Nothing is computed here. Long calls let other threads of Python run; runs and sweeps end at Ctrl-C. Times are seconds of the model's
//! clock, lengths metres, forces newtons, angles radians.
//!
//! The macros of pyo3 make `unsafe` code; nothing that is written here has any.
#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "the shell of the lab towards Python: threads, files and locks are its business"
)]

mod arrays;
mod callbacks;
mod config;
mod env;
mod link;
mod packets;
mod plug;
mod record;
mod run;
mod sweep;
mod ticks;

/// Model-mediated teleoperation: runs in exact virtual time as arrays, sweeps, records, the emulated link by itself, an
/// environment for operators, estimators and update schemes of one's own, and a device or a plant at a live session.
///
/// Times are seconds of the model's clock, lengths metres, forces newtons, angles radians. A configuration is the text of a
/// file in TOML as `default_config` makes it, a path to such a file, or a dict of the same keys, nested or with dots.
#[pyo3::pymodule]
mod mmt {
    #[pymodule_export]
    use crate::callbacks::{Measured, TriggerInput};
    #[pymodule_export]
    use crate::config::default_config;
    #[pymodule_export]
    use crate::env::Env;
    #[pymodule_export]
    use crate::link::{Departure, Link};
    #[pymodule_export]
    use crate::plug::{Command, Device, Plant};
    #[pymodule_export]
    use crate::record::{Record, read};
    #[pymodule_export]
    use crate::run::{Run, run};
    #[pymodule_export]
    use crate::sweep::sweep;

    #[pymodule_export]
    #[allow(non_upper_case_globals, reason = "Python's name for it")]
    const __version__: &str = env!("CARGO_PKG_VERSION");
}
