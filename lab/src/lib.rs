//! Experiments in virtual time: everything that is computed about the system rather than by it.

pub mod again;
pub mod architecture;
pub mod baselines;
pub mod check;
mod digest;
pub mod experiment;
#[cfg(feature = "io")]
pub mod experiments;
pub mod figure;
pub mod forces;
#[cfg(feature = "io")]
pub mod io;
pub mod layers;
pub mod one_run;
pub mod oracle;
pub mod overlay;
pub mod physics;
pub mod record_report;
pub mod replay;
pub mod setting;
pub mod statistics;
pub mod swarm;
pub mod sweep;
pub mod table;
pub mod text_error;
pub mod transport;
pub mod trial;
#[cfg(feature = "io")]
mod two_ports;
pub mod what_if;
pub mod world;
pub mod worlds;
