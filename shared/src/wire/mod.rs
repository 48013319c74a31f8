//! The wire: messages and, beside them, how they are written and read.

pub mod message;
