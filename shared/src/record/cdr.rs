//! Common Data Representation, little endian, as ROS 2 writes and reads it (OMG DDSI-RTPS 2.3, 10.2; XCDR1).
//!
//! Four bytes name the encoding; behind them each number stands at a multiple of its own length.

/// The name of this encoding in front of every message.
const LITTLE_ENDIAN: [u8; 4] = [0, 1, 0, 0];
/// No text or sequence of ours is longer, bytes or elements.
const LENGTH_MAX: usize = 1 << 24;

/// Why bytes are not the message that they should be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CdrError {
    /// Another encoding than ours.
    #[error("it is not written in little-endian CDR")]
    OtherEncoding,
    /// The bytes end before the message does.
    #[error("it ends after {length} bytes, before its last field")]
    Short {
        /// How many bytes there are.
        length: usize,
    },
    /// A text that is none, or a length beyond reason.
    #[error("the text or sequence at byte {at} is malformed")]
    Malformed {
        /// Where it begins.
        at: usize,
    },
}

/// Writes a message; the same room serves for the next one.
#[derive(Clone, Debug, Default)]
pub struct CdrWriter {
    bytes: Vec<u8>,
}

impl CdrWriter {
    /// Begins a new message.
    pub fn begin(&mut self) -> &mut Self {
        self.bytes.clear();
        self.bytes.extend_from_slice(&LITTLE_ENDIAN);
        self
    }

    /// The message so far.
    pub fn message(&self) -> &[u8] {
        &self.bytes
    }

    /// A number of `N` bytes, at a multiple of `N`.
    pub fn number<const N: usize>(&mut self, bytes: [u8; N]) -> &mut Self {
        let body = self.bytes.len() - LITTLE_ENDIAN.len();
        let at = LITTLE_ENDIAN.len() + body.next_multiple_of(N);
        self.bytes.resize(at, 0);
        self.bytes.extend_from_slice(&bytes);
        self
    }

    /// A double.
    pub fn f64(&mut self, value: f64) -> &mut Self {
        self.number(value.to_le_bytes())
    }

    /// A float.
    pub fn f32(&mut self, value: f32) -> &mut Self {
        self.number(value.to_le_bytes())
    }

    /// An `int32`.
    pub fn i32(&mut self, value: i32) -> &mut Self {
        self.number(value.to_le_bytes())
    }

    /// A `uint32`; also the length of the sequence whose elements follow.
    pub fn u32(&mut self, value: u32) -> &mut Self {
        self.number(value.to_le_bytes())
    }

    /// A `bool`.
    pub fn bool(&mut self, value: bool) -> &mut Self {
        self.number([value.into()])
    }

    /// A sequence of bytes.
    pub fn bytes(&mut self, bytes: &[u8]) -> &mut Self {
        self.u32(bytes.len() as u32);
        self.bytes.extend_from_slice(bytes);
        self
    }

    /// A text; it ends with a zero byte, which counts.
    pub fn text(&mut self, text: &str) -> &mut Self {
        self.u32(text.len() as u32 + 1);
        self.bytes.extend_from_slice(text.as_bytes());
        self.bytes.push(0);
        self
    }
}

/// Reads a message.
#[derive(Clone, Copy, Debug)]
pub struct CdrReader<'a> {
    body: &'a [u8],
    at: usize,
}

impl<'a> CdrReader<'a> {
    /// A reader of one message.
    ///
    /// # Errors
    /// It is in another encoding.
    pub fn new(message: &'a [u8]) -> Result<Self, CdrError> {
        let body = message.strip_prefix(&LITTLE_ENDIAN);
        let body = body.ok_or(CdrError::OtherEncoding)?;
        Ok(Self { body, at: 0 })
    }

    fn take(&mut self, length: usize) -> Result<&'a [u8], CdrError> {
        let end = self.at.saturating_add(length);
        let taken = self.body.get(self.at..end).ok_or(CdrError::Short {
            length: self.body.len(),
        })?;
        self.at = end;
        Ok(taken)
    }

    /// A number of `N` bytes.
    ///
    /// # Errors
    /// The message ends before.
    pub fn number<const N: usize>(&mut self) -> Result<[u8; N], CdrError> {
        self.at = self.at.next_multiple_of(N);
        let mut bytes = [0; N];
        bytes.copy_from_slice(self.take(N)?);
        Ok(bytes)
    }

    /// A sequence of bytes.
    ///
    /// # Errors
    /// The message ends before, or the length is beyond reason.
    pub fn bytes(&mut self) -> Result<&'a [u8], CdrError> {
        let length = u32::from_le_bytes(self.number()?) as usize;
        if length > LENGTH_MAX {
            return Err(CdrError::Malformed { at: self.at });
        }
        self.take(length)
    }

    /// A text.
    ///
    /// # Errors
    /// The message ends before, or it is no text.
    pub fn text(&mut self) -> Result<&'a str, CdrError> {
        let at = self.at;
        let malformed = CdrError::Malformed { at };
        let bytes = self.bytes()?.strip_suffix(&[0]).ok_or(malformed)?;
        std::str::from_utf8(bytes).map_err(|_| malformed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_number_stands_at_a_multiple_of_its_length_behind_the_name_of_the_encoding() {
        let mut out = CdrWriter::default();
        out.begin()
            .bool(true)
            .f64(1.0)
            .u32(7)
            .text("ab")
            .bytes(&[9]);
        let expected = [
            &[0, 1, 0, 0][..],
            &[1, 0, 0, 0, 0, 0, 0, 0],
            &1.0_f64.to_le_bytes(),
            &[7, 0, 0, 0],
            &[3, 0, 0, 0, b'a', b'b', 0, 0],
            &[1, 0, 0, 0, 9],
        ];
        assert_eq!(out.message(), expected.concat());
        let mut read = CdrReader::new(out.message()).unwrap();
        assert_eq!(read.number(), Ok([1]));
        assert_eq!(read.number().map(f64::from_le_bytes), Ok(1.0));
        assert_eq!(read.number().map(u32::from_le_bytes), Ok(7));
        assert_eq!(read.text(), Ok("ab"));
        assert_eq!(read.bytes(), Ok(&[9][..]));
        assert!(matches!(read.number::<1>(), Err(CdrError::Short { .. })));
    }

    #[test]
    fn no_bytes_panic() {
        for length in 0..24 {
            for fill in [0, 1, 0x7f, 0xff] {
                let mut bytes = vec![fill; length];
                bytes.splice(0..length.min(4), LITTLE_ENDIAN);
                if let Ok(mut read) = CdrReader::new(&bytes) {
                    let _ = (read.text(), read.bytes(), read.number::<8>());
                }
            }
        }
        assert_eq!(CdrReader::new(b"no").unwrap_err(), CdrError::OtherEncoding);
    }
}
