//! `mmt report`: the table and the figures of a recorded run.

use std::path::Path;

use mmt_lab::io::Folder;
use mmt_lab::record_report::{FORCES, Findings, RecordReport};
use mmt_shared::io::record::{Ended, RecordError};
use serde::Serialize;
use serde_json::{Map, Value};

use super::records::{RECORDS, read_run};
use crate::args::ReportArguments;
use crate::failure::Failure;
use crate::output::{make_folder, note, print, print_json, take_away, unwritten};

/// The report as one document.
#[derive(Serialize)]
struct Document<'a> {
    version: &'static str,
    command: &'static str,
    files: Vec<String>,
    run: &'a mmt_lab::table::Table,
    #[serde(flatten)]
    tables: Map<String, Value>,
}

/// Runs `mmt report`.
///
/// # Errors
/// A record cannot be read or has no session, the records are not of one run, or a file cannot be written.
pub(crate) fn run(arguments: &ReportArguments) -> Result<(), Failure> {
    let mut report = RecordReport::default();
    let read = read_run(
        &arguments.files,
        |topic, message| take(&mut report, topic, message),
        |path, error: RecordError| {
            Failure::usage(format!("the record {}: {error}", path.display())).remedy(RECORDS)
        },
    )?;
    for (path, ended) in arguments.files.iter().zip(read.with_sessions()?) {
        if ended == Ended::CutOff {
            let path = path.display();
            note(format_args!(
                "{path} is cut off: the report ends where it does"
            ));
        }
    }
    let names: Vec<String> = arguments
        .files
        .iter()
        .map(|path| path.display().to_string())
        .collect();
    let findings = report.findings(&names.join(", "));
    keep(&findings, &arguments.out)?;
    if arguments.json {
        return print_json(&Document {
            version: env!("CARGO_PKG_VERSION"),
            command: "report",
            files: names,
            run: &findings.summary,
            tables: documents(&findings)?,
        });
    }
    print(&findings.summary)?;
    findings
        .tables
        .iter()
        .try_for_each(|(_, table)| print(table))?;
    note(format_args!(
        "figures and tables: {}",
        arguments.out.display()
    ));
    Ok(())
}

fn take(report: &mut RecordReport, topic: &str, message: &[u8]) -> Result<(), RecordError> {
    report.take(topic, message).map_err(|why| {
        let topic = topic.to_owned();
        RecordError::Message { topic, why }
    })
}

/// Writes every table and figure.
fn keep(findings: &Findings, out: &Path) -> Result<(), Failure> {
    make_folder(out)?;
    let failed = |error: std::io::Error| unwritten(out, format!("cannot write: {error}"));
    let folder = Folder::open(out).map_err(failed)?;
    for (name, table) in findings.tables.iter().chain(&findings.forces) {
        folder.keep(name, &table.to_csv()).map_err(failed)?;
    }
    if findings.forces.is_none() {
        FORCES
            .iter()
            .try_for_each(|name| take_away(&out.join(name)))?;
    }
    for (name, figure) in &findings.figures {
        let drawn = figure.draw();
        let svg = drawn.map_err(|why| Failure::failed(format!("cannot draw {name}: {why}")))?;
        folder.keep(name, svg.as_bytes()).map_err(failed)?;
    }
    Ok(())
}

/// The tables by the names of their files, without the ending.
fn documents(findings: &Findings) -> Result<Map<String, Value>, Failure> {
    let mut tables = Map::new();
    for (name, table) in &findings.tables {
        let value = serde_json::to_value(table);
        let value = value.map_err(|error| Failure::failed(format!("no JSON: {error}")))?;
        tables.insert(name.trim_end_matches(".csv").to_owned(), value);
    }
    Ok(tables)
}
