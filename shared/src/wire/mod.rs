//! The wire: messages and how they are written and read (`docs/protocol.md`).
//!
//! Every message is a fixed 8-byte header and a postcard body. Reading demands the exact length, the one
//! canonical form, the right road and direction, and finite numbers. What a model or a device would feel
//! comes out raw and becomes a message by `accept` only. Nothing here allocates, and no bytes panic.

mod body;
mod datagram;
mod error;
mod header;
mod label;
pub mod message;
mod raw;
mod samples;
mod stream;
#[cfg(test)]
mod tests;
mod totals;

pub use datagram::{
    Datagram, Matter, decode_datagram, encode_command, encode_heartbeat, encode_scene, encode_tool,
    encode_update,
};
pub use error::{DecodeError, EncodeError, FieldError};
pub use header::{
    ALPN, Channel, DATAGRAM_MAX, HEADER_BYTES, Kind, MAGIC, PROTOCOL_VERSION, STREAM_MESSAGE_MAX,
    Side,
};
pub use label::{LABEL_MAX, Label};
pub use message::{
    Architecture, Command, Echo, Ending, Envelope, Farewell, Hello, Refusal, Role, SCENE_HZ_MAX,
    Welcome,
};
pub use raw::{HelloError, RawHello, RawUpdate, RawWelcome, WelcomeError};
pub use samples::{PushError, SAMPLES_MAX, SampleBlock};
pub use stream::{
    StreamMessage, decode_stream_message, encode_hello, encode_master_farewell, encode_refused,
    encode_slave_farewell, encode_welcome,
};
pub use totals::{
    ForceTotals, Identified, KindCounts, LoopTotals, MasterTotals, Quantiles, SlaveTotals, Traffic,
    UpdateDrops,
};
