//! Statistics: means and quantiles of values at hand, and what fills while the system runs: histograms, values of the last
//! seconds, the queue in round trips, and what a session counts.
//!
//! Pure: time comes as an argument. What fills is of fixed size, and nothing of it allocates once it is made.

pub mod histogram;
pub mod queue;
pub mod recent;
pub mod session;
pub mod values;
