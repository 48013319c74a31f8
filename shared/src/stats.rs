//! Statistics that fill while the system runs: quantiles, values of the last seconds, the queue in round trips, and what
//! a session counts.
//!
//! Pure and of fixed size: time comes as an argument, and nothing allocates once it is made.

pub mod histogram;
pub mod queue;
pub mod recent;
pub mod session;
