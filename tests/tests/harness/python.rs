//! A Python that has what a test needs.

use std::process::{Command, Stdio};

use super::process::did_not_run;
use super::root;

/// A Python that has `module`: the checks' own, or the system's. Prints a warning if there is none, and fails with `CI` set.
pub(crate) fn python(test: &str, module: &str) -> Option<String> {
    let own = root().join("target/python/bin/python");
    let pythons = [own.to_string_lossy().into_owned(), "python3".to_owned()];
    let import = format!("import {module}");
    let mut pythons = pythons.into_iter();
    let found = pythons.find(|python| {
        let mut command = Command::new(python);
        command.args(["-c", &import]).stderr(Stdio::null());
        command.status().is_ok_and(|status| status.success())
    });
    if found.is_none() {
        let how = format!(
            "no Python has {module}: make one with `python3 -m venv target/python` and \
             `target/python/bin/pip install -r tests/protocol/requirements.txt -r contrib/requirements.txt`"
        );
        did_not_run(test, &how);
    }
    found
}
