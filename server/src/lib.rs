//! The slave of mmt: remote environment, sensing, estimation, shadow and trigger.
//!
//! The crate is pure; its QUIC endpoint and its 1 kHz thread live in `io` behind the feature of that
//! name. Only `environment` names the physics engine.

pub mod again;
pub mod conditioning;
pub mod contact;
pub mod contact_prediction;
pub mod end;
pub mod environment;
pub mod estimator;
pub mod feed;
mod levenberg_marquardt;
mod motion_limits;
pub mod plant;
pub mod playout;
pub mod pose_observer;
pub mod repeats;
pub mod sensing;
pub mod shadow;
pub mod slave;
pub mod square_friction;
pub mod tool;
pub mod trigger;

#[cfg(feature = "io")]
pub mod io;
