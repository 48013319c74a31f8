//! Experiments in virtual time: everything that is computed about the system rather than by it.

pub mod replay;
pub mod world;
