//! The wire: messages and how they are written and read (`docs/protocol.md`).
//!
//! Every message is a fixed 8-byte header and a postcard body. Reading demands the exact length, the one
//! canonical form, the right road and direction, and finite numbers. What a model or a device would take
//! comes out raw and passes by `accept` only. Nothing here allocates, and no bytes panic.

mod body;
mod datagram;
mod error;
mod flags;
mod header;
mod kind;
mod label;
mod samples;
mod session;
mod state;
#[cfg(test)]
mod tests;

pub use datagram::{Command, Datagram, Echo, Envelope, Message};
pub use error::{DecodeError, EncodeError, FieldError};
pub use flags::{Flags, ToolState};
pub use kind::{
    ALPN, Channel, DATAGRAM_MAX, HEADER_BYTES, Kind, MAGIC, PROTOCOL_VERSION, STREAM_MESSAGE_MAX,
    Side,
};
pub use label::{LABEL_MAX, Label};
pub use samples::{PushError, SAMPLES_MAX, SampleBlock};
pub use session::{
    Claim, Ending, Farewell, Hello, HelloError, Refusal, Role, SCENE_HZ_MAX, StreamMessage,
    Welcome, WelcomeError,
};
pub use state::RawState;
