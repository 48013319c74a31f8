//! What a field of a flat message can be: how it is written, read and shown in a table.

use super::cdr::{CdrError, CdrReader, CdrWriter};

/// A moment on the wall clock: nanoseconds since 1970.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Stamp(pub u64);

impl Stamp {
    const NANOS: u64 = 1_000_000_000;

    /// The latest that `builtin_interfaces/Time` can hold, in the year 2038.
    const LATEST: Self = Self(i32::MAX as u64 * Self::NANOS + Self::NANOS - 1);

    /// Writes it as `builtin_interfaces/Time`; a later moment than that can hold is written as the latest.
    pub fn write(self, out: &mut CdrWriter) {
        let Self(nanos) = self.min(Self::LATEST);
        out.i32((nanos / Self::NANOS) as i32);
        out.u32((nanos % Self::NANOS) as u32);
    }
}

/// The value of a field, for whoever has columns of their own.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A number; NaN where it is not known.
    Number(f64),
    /// A whole number, or ns since 1970.
    Whole(u64),
    /// Yes or no.
    Truth(bool),
    /// Words.
    Text(String),
    /// Bytes.
    Bytes(Vec<u8>),
    /// A 3 by 3 matrix, row by row.
    Matrix([f64; 9]),
}

/// What a field can be.
pub(super) trait Field: Sized {
    /// Its type in a schema.
    const ROS: &'static str;
    /// Writes it.
    fn write(&self, out: &mut CdrWriter);
    /// Reads it.
    ///
    /// # Errors
    /// The message ends before or is malformed.
    fn read(input: &mut CdrReader<'_>) -> Result<Self, CdrError>;
    /// Its cell in a table of comma-separated values.
    fn cell(&self) -> String;
    /// Its value.
    fn value(self) -> Value;
}

macro_rules! numbers {
    ($($of:ty: $ros:literal),*) => { $(
        impl Field for $of {
            const ROS: &'static str = $ros;

            fn write(&self, out: &mut CdrWriter) {
                out.number(self.to_le_bytes());
            }

            fn read(input: &mut CdrReader<'_>) -> Result<Self, CdrError> {
                input.number().map(Self::from_le_bytes)
            }

            fn cell(&self) -> String {
                self.to_string()
            }

            fn value(self) -> Value {
                Value::Whole(u64::from(self))
            }
        }
    )* };
}

numbers!(u32: "uint32", u64: "uint64");

impl Field for f64 {
    const ROS: &'static str = "float64";

    fn write(&self, out: &mut CdrWriter) {
        out.f64(*self);
    }

    fn read(input: &mut CdrReader<'_>) -> Result<Self, CdrError> {
        input.number().map(Self::from_le_bytes)
    }

    fn cell(&self) -> String {
        if self.is_nan() {
            String::new()
        } else {
            self.to_string()
        }
    }

    fn value(self) -> Value {
        Value::Number(self)
    }
}

impl Field for bool {
    const ROS: &'static str = "bool";

    fn write(&self, out: &mut CdrWriter) {
        out.bool(*self);
    }

    fn read(input: &mut CdrReader<'_>) -> Result<Self, CdrError> {
        input.number().map(|[byte]| byte != 0)
    }

    fn cell(&self) -> String {
        self.to_string()
    }

    fn value(self) -> Value {
        Value::Truth(self)
    }
}

impl Field for String {
    const ROS: &'static str = "string";

    fn write(&self, out: &mut CdrWriter) {
        out.text(self);
    }

    fn read(input: &mut CdrReader<'_>) -> Result<Self, CdrError> {
        input.text().map(str::to_owned)
    }

    fn cell(&self) -> String {
        if self.contains([',', '"', '\n']) {
            format!("\"{}\"", self.replace('"', "\"\""))
        } else {
            self.clone()
        }
    }

    fn value(self) -> Value {
        Value::Text(self)
    }
}

impl Field for Vec<u8> {
    const ROS: &'static str = "uint8[]";

    fn write(&self, out: &mut CdrWriter) {
        out.bytes(self);
    }

    fn read(input: &mut CdrReader<'_>) -> Result<Self, CdrError> {
        input.bytes().map(<[u8]>::to_vec)
    }

    fn cell(&self) -> String {
        hex::encode(self)
    }

    fn value(self) -> Value {
        Value::Bytes(self)
    }
}

impl Field for [f64; 9] {
    const ROS: &'static str = "float64[9]";

    fn write(&self, out: &mut CdrWriter) {
        self.iter().for_each(|value| value.write(out));
    }

    fn read(input: &mut CdrReader<'_>) -> Result<Self, CdrError> {
        let mut values = [0.0; 9];
        for value in &mut values {
            *value = Field::read(input)?;
        }
        Ok(values)
    }

    fn cell(&self) -> String {
        self.map(|value| value.cell()).join(" ").trim().to_owned()
    }

    fn value(self) -> Value {
        Value::Matrix(self)
    }
}

impl Field for Stamp {
    const ROS: &'static str = "builtin_interfaces/Time";

    fn write(&self, out: &mut CdrWriter) {
        (*self).write(out);
    }

    fn read(input: &mut CdrReader<'_>) -> Result<Self, CdrError> {
        let sec = i32::from_le_bytes(input.number()?);
        let nanosec = u32::from_le_bytes(input.number()?);
        let sec = u64::try_from(sec).unwrap_or(0);
        Ok(Self(sec * Self::NANOS + u64::from(nanosec)))
    }

    fn cell(&self) -> String {
        self.0.to_string()
    }

    fn value(self) -> Value {
        Value::Whole(self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_moment_after_the_last_second_of_a_stamp_is_written_as_the_end_of_that() {
        let again = |stamp: Stamp| {
            let mut out = CdrWriter::default();
            stamp.write(out.begin());
            <Stamp as Field>::read(&mut CdrReader::new(out.message()).unwrap()).unwrap()
        };
        let last = Stamp(2_147_483_647_999_999_999);
        assert_eq!(Stamp::LATEST, last);
        assert_eq!((again(last), again(Stamp(u64::MAX))), (last, last));
        assert_eq!(
            again(Stamp(1_700_000_000_000_000_007)).0,
            1_700_000_000_000_000_007
        );
    }

    #[test]
    fn a_cell_with_a_comma_or_a_quote_is_quoted() {
        assert_eq!("a,\"b\"".to_owned().cell(), "\"a,\"\"b\"\"\"");
        assert_eq!(vec![0_u8, 255].cell(), "00ff");
    }
}
