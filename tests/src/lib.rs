//! Promises of mmt, checked from outside.
//!
//! The promises themselves are the integration tests of this crate; here is only what they share. Nothing in
//! it may be used by the other crates.

pub mod architecture;
pub mod hosts;
pub mod process;
pub mod tshark;
