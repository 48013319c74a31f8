//! The slave of mmt: remote environment, sensing, estimation, shadow and trigger.
//!
//! The crate is pure; its QUIC endpoint and its 1 kHz thread live in `io` behind the feature of that
//! name. Only `environment` names the physics engine.

pub mod environment;
pub mod link;
pub mod trigger;
pub mod playout;
pub mod sensing;
//! placeholder

pub mod estimator;
