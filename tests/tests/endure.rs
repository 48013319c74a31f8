//! What goes wrong with real processes, hosts and networks, done by `.ci/endure`: here a few of its rows, in seconds;
//! `.ci/long` does them all.
//!
//! Needs root, `python3`, `ip`, `nft` and `prlimit`: without, it says so, and with `CI` set it fails.

#![allow(clippy::unwrap_used, reason = "a test may panic")]
#![allow(clippy::disallowed_methods, reason = "starts processes")]

use std::process::Command;

use crate::harness::process::{PROGRAM, did_not_run};
use crate::harness::{in_real_time, root};

/// Parts of the names of the rows.
const ROWS: [&str; 8] = [
    "killed",
    "master stopped",
    "slave with 16",
    "full disk",
    "flapping",
    "address changes",
    "master's cable",
    "a fifth",
];

#[test]
fn what_befalls_processes_hosts_and_networks_breaks_no_promise() {
    let test = "endure";
    if !rustix::process::geteuid().is_root() {
        return did_not_run(test, "it needs root to make network namespaces");
    }
    in_real_time(|| {
        let mut command = Command::new("python3");
        command
            .arg(root().join(".ci/endure"))
            .args([PROGRAM, "--short"]);
        let output = command.args(ROWS).output();
        let Ok(output) = output else {
            return did_not_run(test, "there is no python3");
        };
        let printed = String::from_utf8_lossy(&output.stderr);
        if printed.contains("this host cannot") {
            return did_not_run(test, &printed);
        }
        assert!(output.status.success(), "{printed}");
        let table = String::from_utf8_lossy(&output.stdout);
        // two rows are called killed
        assert_eq!(table.matches("holds").count(), ROWS.len() + 1, "{table}");
    });
}
