//! The command `mmt` in a home of its own, so that no test meets what another one, or the user, has kept.

use std::process::{Command, Stdio};

/// `mmt` with these arguments, nothing on stdin; it keeps and finds its files in `home`.
pub(crate) fn mmt(home: &tempfile::TempDir, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_mmt"));
    command
        .args(arguments)
        .env("XDG_STATE_HOME", home.path())
        .env_remove("MMT_LOG")
        .current_dir(home.path())
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}
