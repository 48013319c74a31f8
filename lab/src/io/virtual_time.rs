//! quinn in exact virtual time: one message flow over one emulated path, counted in nanoseconds.
//!
//! quinn itself runs here, unmodified, with its handshake, its cryptography and its timers; only its clock, its
//! sockets and its scheduler are ours. Nothing costs time but the path, so that what a message needs beyond it is
//! what the protocol adds. A run must never read the host's clock or wait for anything.
//!
//! An executor drives quinn, and not a loop of ours over quinn-proto's endpoints: that loop would have to repeat
//! quinn's own driver (rounds of at most 20 transmits, timers, events between endpoint and connection, in which order),
//! and its packets would leave at other times than those of the program that runs on robots.

mod ends;
mod executor;
mod path;
mod run;

pub use run::run;

#[cfg(test)]
mod tests;
