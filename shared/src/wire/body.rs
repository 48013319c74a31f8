//! How any message is written and read: header, then a postcard body.
//!
//! Must never allocate, and never accept bytes that it would not have written itself.

use postcard::ser_flavors::Flavor;
use serde::{Deserialize, Serialize};

use super::error::{DecodeError, EncodeError, reason};
use super::flags::Flags;
use super::header::header;
use super::kind::{HEADER_BYTES, Kind};

/// Writes header and body to the front of `out`; returns how many bytes that took.
pub(super) fn write(
    kind: Kind,
    flags: Flags,
    body: &impl Serialize,
    out: &mut [u8],
) -> Result<usize, EncodeError> {
    let length = out.len();
    let too_small = EncodeError::BufferTooSmall { kind, length };
    let (head, rest) = out.split_at_mut_checked(HEADER_BYTES).ok_or(too_small)?;
    head.copy_from_slice(&header(kind, flags));
    let used = postcard::to_slice(body, rest).map_err(|_| too_small)?;
    Ok(HEADER_BYTES + used.len())
}

/// Reads a body that must fill `bytes` exactly, in its one canonical form.
pub(super) fn read<'a, B: Serialize + Deserialize<'a>>(
    kind: Kind,
    bytes: &'a [u8],
) -> Result<B, DecodeError> {
    let (body, rest) =
        postcard::take_from_bytes::<B>(bytes).map_err(|error| DecodeError::Malformed {
            kind,
            reason: reason(&error),
        })?;
    if !rest.is_empty() {
        let extra = rest.len();
        return Err(DecodeError::Trailing { kind, extra });
    }
    let left = postcard::serialize_with_flavor(&body, Compare { expected: bytes });
    if left != Ok(0) {
        return Err(DecodeError::NotCanonical { kind });
    }
    Ok(body)
}

/// Compares what is written with what is expected instead of storing it; yields what was not reached.
struct Compare<'a> {
    expected: &'a [u8],
}

impl Flavor for Compare<'_> {
    type Output = usize;

    fn try_push(&mut self, byte: u8) -> postcard::Result<()> {
        match self.expected.split_first() {
            Some((&expected, rest)) if expected == byte => {
                self.expected = rest;
                Ok(())
            }
            _ => Err(postcard::Error::DeserializeBadEncoding),
        }
    }

    fn finalize(self) -> postcard::Result<usize> {
        Ok(self.expected.len())
    }
}
