//! What both sides of mmt run or agree on.
//!
//! The master feels with this code and the slave shadows with it: time, geometry, contact, parameters,
//! the local model, metrics, wire messages. The crate is pure; clocks, threads and sockets live in `io`
//! behind the feature of that name.

pub mod contact;
pub mod geometry;
#[cfg(feature = "io")]
pub mod io;
pub mod params;
pub mod rng;
pub mod settings;
pub mod time;
pub mod wire;
