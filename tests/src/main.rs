//! The command `mmt` of this checkout, for the tests of this crate to start. It is built with them, by one cargo.
//!
//! Where [`RECORDS`] names a folder, whatever runs a session records it there under the number of its process, unless its
//! arguments say where, or that it cannot be. The process is `mmt` itself then: it begins anew with the longer command line.

#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "it reads its arguments and starts itself anew"
)]

use std::env::{args_os, var_os};
use std::ffi::OsString;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Command, ExitCode};

/// The folder in which a test wants its sessions recorded.
const RECORDS: &str = "MMT_UNDER_TEST_RECORDS";

fn main() -> ExitCode {
    let name = args_os().next().unwrap_or_default();
    let given: Vec<_> = args_os().skip(1).collect();
    if let Some(folder) = var_os(RECORDS)
        && is_recordable(&given)
    {
        let file = Path::new(&folder).join(format!("{}.mcap", std::process::id()));
        // it comes back only if the system cannot start it again, and then it goes on unrecorded
        let _ = Command::new("/proc/self/exe")
            .arg0(name)
            .args(given)
            .arg("--record")
            .arg(file)
            .env_remove(RECORDS)
            .exec();
    }
    mmt_cli::run()
}

/// Whether these arguments run a session that can be recorded and is not: one who looks on has none, and a blind
/// comparison keeps its own.
fn is_recordable(given: &[OsString]) -> bool {
    let runs = ["demo", "master", "slave"];
    let not = ["--record", "--observe", "--blind"];
    let first = given.first().and_then(|word| word.to_str());
    first.is_some_and(|first| runs.contains(&first))
        && !given.iter().any(|word| not.iter().any(|not| word == not))
}
