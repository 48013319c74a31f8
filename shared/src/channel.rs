//! The datagram channel: numbers, echoes, loss, round trip and rate control. Pure.

pub mod datagram_channel;
pub mod peer;
pub mod rate_control;
