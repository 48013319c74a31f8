//! The emulated link of mmt: one pure state machine and the three ways to drive it.
//!
//! [`link::Link`] decides what becomes of a packet; it never sleeps, reads no clock and touches no
//! socket. [`pipe::Pipe`] adds the packets in flight. The drivers: *sim* is a pipe stepped in virtual
//! time ([`pipe::SimPath`]); *wrap* decorates a QUIC socket and *relay* stands between two hosts, both
//! in `io` behind the feature of that name.

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

pub mod config;
pub mod counters;
mod direction;
pub mod distribution;
pub mod effect;
pub mod fate;
#[cfg(feature = "io")]
pub mod io;
pub mod link;
pub mod pipe;
pub mod presets;
mod quantile;
pub mod record;
pub mod trace;
pub mod words;

pub use config::{Delay, LinkConfig, Loss, Order, Probability};
pub use effect::{Effect, effect};
pub use fate::{DropCause, Fate};
pub use link::{Direction, Link, LinkId, PacketMeta};
pub use pipe::{Pipe, SimPath};
