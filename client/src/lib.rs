//! The master of mmt: devices, operators, force limits.
//!
//! The crate is pure; the haptic thread and the QUIC endpoint live in `io` behind the feature of that
//! name.

pub mod device;
pub mod limiter;
pub mod operator;
