//! The master of mmt: the haptic tick around the shared local model, operators, force limits.
//!
//! The crate is pure; its QUIC endpoint and its haptic thread live in `io` behind the feature of that name.

pub mod failsafe;
pub mod link;
//! The master of mmt: devices, operators, force limits.
//!
//! The crate is pure; the haptic thread and the QUIC endpoint live in `io` behind the feature of that
//! name.

pub mod device;
pub mod limiter;
pub mod operator;
