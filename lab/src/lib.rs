//! Experiments in virtual time: everything that is computed about the system rather than by it.

pub mod figure;
#[cfg(feature = "io")]
#[allow(
    clippy::disallowed_methods,
    reason = "the shell of the lab: threads and files are its business"
)]
pub mod io;
pub mod replay;
pub mod reproduce;
pub mod statistics;
pub mod sweep;
pub mod table;
pub mod trial;
pub mod world;
