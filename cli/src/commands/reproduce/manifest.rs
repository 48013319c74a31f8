//! `manifest.json`: what was run, with what, and what came of it. Nothing in it depends on the machine or the hour.

use std::collections::BTreeMap;

use mmt_lab::reproduce::Findings;
use serde::Serialize;

/// The document.
#[derive(Debug, Serialize)]
pub(super) struct Manifest<'a> {
    program: &'static str,
    version: &'static str,
    experiments: &'a [Findings],
    files: BTreeMap<String, String>,
}

impl<'a> Manifest<'a> {
    /// Of what was found and the files that were kept.
    pub(super) fn new(experiments: &'a [Findings], files: BTreeMap<String, String>) -> Self {
        Self {
            program: "mmt",
            version: env!("CARGO_PKG_VERSION"),
            experiments,
            files,
        }
    }
}
