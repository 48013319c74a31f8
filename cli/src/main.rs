//! The command `mmt`.

use std::process::ExitCode;

fn main() -> ExitCode {
    mmt_cli::run()
}
