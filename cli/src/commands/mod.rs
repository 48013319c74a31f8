//! The commands, one file each: arguments to configuration to run.

pub(crate) mod bench;
pub(crate) mod check;
mod conclusion;
pub(crate) mod config;
mod console;
pub(crate) mod demo;
pub(crate) mod device;
pub(crate) mod doctor;
pub(crate) mod export;
mod host;
pub(crate) mod identity;
#[cfg(feature = "live")]
pub(crate) mod live;
pub(crate) mod manual;
pub(crate) mod master;
pub(crate) mod netem;
pub(crate) mod observe;
mod record;
mod records;
pub(crate) mod replay;
pub(crate) mod report;
pub(crate) mod reproduce;
pub(crate) mod slave;
pub(crate) mod soak;
pub(crate) mod swarm;
pub(crate) mod sweep;
mod viewer;
