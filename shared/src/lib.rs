//! What both sides of mmt run or agree on.
//!
//! The master feels with this code and the slave shadows with it: time, geometry, contact, parameters,
//! the local model, metrics, wire messages. The crate is pure; clocks, threads and sockets live in `io`
//! behind the feature of that name.

pub mod bilateral;
pub mod contact;
pub mod correction;
pub mod dynamics;
pub mod geometry;
pub mod history;
#[cfg(feature = "io")]
pub mod io;
pub mod link_end;
pub mod local_model;
pub mod metrics;
pub mod pairing;
pub mod params;
pub mod peer;
pub mod range;
pub mod rate_control;
pub mod recording;
pub mod report;
pub mod rng;
pub mod settings;
pub mod time;
pub mod wire;
