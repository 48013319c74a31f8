//! What a record of a session holds: messages, their schemas and their bytes (`docs/records.md`).
//!
//! A record is an MCAP file in the encoding that ROS 2, Foxglove, Lichtblick and PlotJuggler share: CDR with `ros2msg`
//! schemas. It holds every input of an end, so that a session runs again, and what its ticks gave, so that this can be
//! checked. Pure: files and threads are the business of `io::record`. No secret is ever in a message.

pub mod again;
pub mod cdr;
pub mod digest;
mod field;
pub mod messages;
pub mod packet;
pub mod ros;
pub mod table;

/// Name and version of the program that makes a record, and that alone can run it again.
pub const PROGRAM: &str = concat!("mmt ", env!("CARGO_PKG_VERSION"));
