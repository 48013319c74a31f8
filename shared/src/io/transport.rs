//! What carries a session: QUIC, or QUIC with the datagrams beside it as raw UDP for measurement.
//!
//! Datagrams that may be lost, one stream of framed messages in each direction, an end with a reason. A session must
//! not ask which one carries it.

mod choice;
mod connection;
mod endpoint;
mod listen;
#[cfg(test)]
mod tests;

pub use choice::{Insecure, Transport};
pub use connection::{
    CLOSE_FINISHED, CLOSE_NO_HELLO, CLOSE_NOT_A_HELLO, CLOSE_REVOKED, CLOSE_TAKEN_OVER, Connection,
    DatagramCounts,
};
pub use endpoint::Endpoint;
pub use listen::{AcceptError, Handshake, Listener};
pub use quinn::{
    ConnectionError, ReadError, RecvStream, SendDatagramError, SendStream, VarInt, WriteError,
};
