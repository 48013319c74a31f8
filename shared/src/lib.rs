//! What both sides of mmt run or agree on.
//!
//! The master feels with this code and the slave shadows with it: time, geometry, contact, parameters,
//! the local model, metrics, statistics, wire messages. The crate is pure; clocks, threads and sockets live in `io`
//! behind the feature of that name.

pub mod channel;
pub mod clean;
#[cfg(any(test, feature = "fixtures"))]
pub mod fixtures;
#[cfg(feature = "io")]
pub mod io;
pub mod metrics;
pub mod model;
pub mod network;
pub mod pairing;
pub mod passivity;
pub mod plug;
pub mod range;
pub mod record;
pub mod recording;
pub mod report;
pub mod rng;
pub mod spelling;
pub mod stats;
pub mod time;
pub mod wire;
