//! The master of mmt: the haptic tick around the shared local model, devices, operators, force limits.
//!
//! The crate is pure; its QUIC endpoint and its haptic thread live in `io` behind the feature of that name.

pub mod again;
pub mod commands;
pub mod device;
pub mod end;
pub mod failsafe;
pub mod limiter;
pub mod master;
pub mod observer;
pub mod operator;
pub mod path;
pub mod tdpa;

#[cfg(feature = "io")]
pub mod io;
