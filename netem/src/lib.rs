//! The emulated link of mmt: one pure state machine and the ways to drive it.
//!
//! [`link::Link`] takes packets in and hands them out when they leave or are dropped; it never sleeps, reads
//! no clock and touches no socket. The drivers: *sim* is a link stepped in virtual time; *wrap* decorates a
//! QUIC socket, *relay* stands between two hosts and *tunnel* between two network interfaces, all in `io` behind the
//! feature of that name.

pub mod capture;
pub mod config;
pub mod counters;
mod direction;
pub mod distribution;
pub mod effect;
#[cfg(feature = "io")]
pub mod io;
pub mod link;
pub mod packet;
pub mod presets;
mod quantile;
pub mod record;
pub mod trace;
pub mod words;

pub use config::{Delay, LinkConfig, Loss, Order, Probability};
pub use direction::{Direction, LinkId};
pub use effect::Effect;
pub use link::Link;
pub use packet::{Departure, DropCause, Fate, Packet};
