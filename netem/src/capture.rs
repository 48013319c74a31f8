//! Captures of packets: what a link did as pcapng, and what two captures of one path show.
//!
//! It opens no file: bytes go in and out.

mod frame;
mod matching;
mod pcapng;
mod read;
#[cfg(test)]
mod tests;

pub use matching::{Match, MatchError, Matched};
pub use pcapng::{Event, Sides, Writer, is_capture};
pub use read::{Frame, read};
