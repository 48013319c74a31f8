//! What both live shells need from the operating system and from QUIC: a clock, the 1 kHz deadline loop,
//! real-time scheduling, a wake from that loop to tokio, an identity, endpoints, framed streams.
//!
//! Everything here may read a clock, start a wait or open a file or socket; nothing here depends on a model, a
//! message or a session, but for the farewell. The haptic thread uses `clock`, `ticker`, `realtime` and `wake` only.

#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "the shell: clocks, files and sockets are its business"
)]

pub mod alarm;
pub mod clock;
pub mod congestion;
pub mod connect;
pub mod emergency;
pub mod farewell;
pub mod identity;
pub mod identity_file;
pub mod loop_thread;
pub mod network_task;
pub mod output_file;
pub mod plug_socket;
pub mod quic;
pub mod raw_udp;
pub mod realtime;
pub mod record;
pub mod schedule;
pub mod secret;
pub mod socket;
pub mod stream;
pub mod ticker;
pub mod tls;
pub mod transport;
pub mod truth;
pub mod wake;
pub mod watchdog;
pub mod wish;

#[cfg(test)]
mod tests;
