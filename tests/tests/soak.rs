//! A soak of a few cycles: it keeps its promises, says what it did, ends when asked to, and leaves nothing behind.

#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a test may panic"
)]
#![allow(
    clippy::disallowed_methods,
    reason = "looks after what a process leaves"
)]

use std::time::Duration;

use serde_json::Value;

use crate::harness::in_real_time;
use crate::harness::process::{Ended, Running, number};

/// Four cycles and their proofs; the host may be busy.
const GENEROUS: Duration = Duration::from_secs(600);

fn soak(hours: &str, ends: impl FnOnce(&Running)) -> (Ended, Value, tempfile::TempDir) {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("soak");
    let words = ["soak", "--hours", hours, "--seed", "3", "--json", "--out"];
    let running = Running::mmt(&[&words[..], &[out.to_str().unwrap()]].concat()).unwrap();
    ends(&running);
    let ended = running.end(GENEROUS).unwrap();
    let document = ended.document(0).unwrap();
    (ended, document, folder)
}

#[test]
fn a_short_soak_keeps_its_promises_counts_what_it_did_and_leaves_nothing() {
    in_real_time(|| {
        let (ended, document, folder) = soak("0.0056", |_| {});
        assert_eq!(document["holds"], true, "{document:#}");
        assert_eq!(ended.status.code(), Some(0), "{}", ended.err);
        assert_eq!(document["ending"], "finished");
        // each cycle ends with a session that came about; how many fit in is the host's affair
        let cycles = number(&document, "/cycles").unwrap();
        assert!(number(&document, "/masters/ended well").unwrap() >= cycles);
        assert!(number(&document, "/sessions").unwrap() >= cycles);
        assert!(document["invariants"].as_array().unwrap().len() > 20);
        let processes = document["processes"].as_array().unwrap();
        let most = processes.iter().map(|of| number(of, "/most/descriptors"));
        assert!(
            most.into_iter().all(|most| most > Some(5.0)),
            "{document:#}"
        );
        assert!(!folder.path().join("soak").exists());
    });
}

#[test]
fn a_soak_that_is_interrupted_ends_with_its_table_and_its_processes() {
    in_real_time(|| {
        let (ended, document, folder) = soak("1", |running| {
            std::thread::sleep(Duration::from_secs(3));
            running.interrupt().unwrap();
        });
        assert_eq!(ended.status.code(), Some(0), "{}", ended.err);
        assert_eq!(document["ending"], "interrupted");
        assert_eq!(document["cycles"], 1, "{document:#}");
        assert!(!folder.path().join("soak").exists());
    });
}
