//! Experiments in virtual time: everything that is computed about the system rather than by it.

pub mod architecture;
mod digest;
pub mod figure;
#[cfg(feature = "io")]
pub mod io;
pub mod physics;
pub mod replay;
pub mod reproduce;
pub mod statistics;
pub mod sweep;
pub mod table;
pub mod transport;
pub mod trial;
pub mod world;
