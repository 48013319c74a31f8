//! The slave of mmt: the remote environment, what is measured of it, and the play-out of commands.
//!
//! The modules here are pure; the QUIC endpoint and the 1 kHz thread live behind the feature `io`.

pub mod environment;
pub mod playout;
pub mod sensing;
