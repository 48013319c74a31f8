//! The master of mmt: the haptic tick around the shared local model, operators, force limits.
//!
//! The crate is pure; its QUIC endpoint and its haptic thread live in `io` behind the feature of that name.

pub mod failsafe;
pub mod link;
pub mod operator;
