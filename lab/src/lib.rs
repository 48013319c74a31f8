//! Experiments in virtual time: everything that is computed about the system rather than by it.

#![cfg_attr(
    not(feature = "io"),
    forbid(
        unsafe_code,
        clippy::disallowed_macros,
        clippy::disallowed_methods,
        clippy::disallowed_types,
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::indexing_slicing,
        clippy::panic,
        clippy::print_stderr,
        clippy::print_stdout
    )
)]

pub mod architecture;
pub mod baselines;
mod digest;
pub mod experiment;
#[cfg(feature = "io")]
pub mod experiments;
pub mod figure;
#[cfg(feature = "io")]
pub mod io;
pub mod overlay;
pub mod physics;
pub mod replay;
pub mod setting;
pub mod statistics;
pub mod sweep;
pub mod table;
pub mod transport;
pub mod trial;
pub mod world;
