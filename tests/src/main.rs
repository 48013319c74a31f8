//! The command `mmt` of this checkout, for the tests of this crate to start. It is built with them, by one cargo.

use std::process::ExitCode;

fn main() -> ExitCode {
    mmt_cli::run()
}
