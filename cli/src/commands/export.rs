//! `mmt export`: the tables of a record as comma-separated values, one file a topic.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use mmt_client::operator::trace::CSV_HEADER;
use mmt_shared::io::record::{Ended, RecordError, read};
use mmt_shared::record::messages::{MasterTick, Message};
use mmt_shared::record::table::{Row, row, topics};

use crate::args::ExportArguments;
use crate::failure::Failure;
use crate::output::{self, make_folder, note, print, take_away};

/// A table being written.
struct Sheet {
    path: PathBuf,
    file: BufWriter<File>,
    rows: u64,
}

/// Why a record was not exported.
#[derive(Debug, thiserror::Error)]
enum Error {
    #[error(transparent)]
    Record(#[from] RecordError),
    #[error("cannot write {path}: {source}")]
    Table { path: String, source: io::Error },
}

/// Runs `mmt export`.
///
/// # Errors
/// The record cannot be read or has no session, or a table cannot be written.
pub(crate) fn run(arguments: &ExportArguments) -> Result<(), Failure> {
    make_folder(&arguments.out)?;
    let mut sheets = BTreeMap::new();
    let ended = export(&arguments.file, &arguments.out, &mut sheets);
    let finished = sheets.values_mut().try_for_each(|sheet: &mut Sheet| {
        let flushed = sheet.file.flush();
        flushed.map_err(|source| unwritten(&sheet.path, source))
    });
    let ended = ended.and_then(|ended| finished.map(|()| ended));
    let ended = ended.map_err(|error| failure(arguments, error))?;
    if sheets.is_empty() {
        return Err(Failure::usage("there is no session in this record")
            .remedy("give a file that mmt made with --record"));
    }
    for name in topics().map(sheet_name).chain([HAND.to_owned()]) {
        if !sheets.contains_key(&name) {
            take_away(&arguments.out.join(format!("{name}.csv")))?;
        }
    }
    for sheet in sheets.values() {
        print(format_args!(
            "{}: {} rows",
            sheet.path.display(),
            sheet.rows
        ))?;
    }
    if ended == Ended::CutOff {
        note("the record is cut off: the tables end where it does");
    }
    Ok(())
}

fn export(record: &Path, out: &Path, sheets: &mut BTreeMap<String, Sheet>) -> Result<Ended, Error> {
    let mut hand = Hand::default();
    read(record, |topic, message| -> Result<(), Error> {
        let broken = |why| RecordError::Message {
            topic: topic.to_owned(),
            why,
        };
        let Some(row) = row(topic, message) else {
            return Ok(());
        };
        // only known topics have rows: the name is one of ours
        put(sheets, out, &sheet_name(topic), &row.map_err(broken)?)?;
        if topic == "/master/ticks" {
            let tick = MasterTick::read(message).map_err(broken)?;
            put(sheets, out, HAND, &hand.row(&tick))?;
        }
        Ok(())
    })
}

/// The table of a topic.
fn sheet_name(topic: impl AsRef<str>) -> String {
    topic.as_ref().trim_start_matches('/').replace('/', "-")
}

/// The table of what the device read: a trace for `mmt master --operator`.
const HAND: &str = "hand";

/// Where the hand was, from the first tick on.
#[derive(Debug, Default)]
struct Hand {
    began_ns: Option<u64>,
}

impl Hand {
    fn row(&mut self, tick: &MasterTick) -> Row {
        let began_ns = *self.began_ns.get_or_insert(tick.deadline_ns);
        let t_ns = tick.deadline_ns.saturating_sub(began_ns);
        let t_s = format!("{}.{:09}", t_ns / 1_000_000_000, t_ns % 1_000_000_000);
        Row {
            columns: CSV_HEADER.split(',').collect(),
            cells: vec![
                t_s,
                tick.reading_x_m.to_string(),
                tick.reading_y_m.to_string(),
            ],
        }
    }
}

/// Adds a row to the table of this name, which begins with its first row.
fn put(
    sheets: &mut BTreeMap<String, Sheet>,
    out: &Path,
    name: &str,
    row: &Row,
) -> Result<(), Error> {
    let sheet = match sheets.entry(name.to_owned()) {
        Entry::Occupied(sheet) => sheet.into_mut(),
        Entry::Vacant(place) => {
            let path = out.join(format!("{name}.csv"));
            let begun = begin(&path, &row.columns);
            let file = begun.map_err(|source| unwritten(&path, source))?;
            place.insert(Sheet {
                path,
                file,
                rows: 0,
            })
        }
    };
    sheet.rows += 1;
    let line = writeln!(sheet.file, "{}", row.cells.join(","));
    line.map_err(|source| unwritten(&sheet.path, source))
}

fn begin(path: &Path, columns: &[&str]) -> io::Result<BufWriter<File>> {
    let mut file = BufWriter::new(File::create(path)?);
    writeln!(file, "{}", columns.join(","))?;
    Ok(file)
}

fn unwritten(path: &Path, source: io::Error) -> Error {
    let path = path.display().to_string();
    Error::Table { path, source }
}

fn failure(arguments: &ExportArguments, error: Error) -> Failure {
    match error {
        Error::Record(why) => {
            let what = format!("the record {}: {why}", arguments.file.display());
            Failure::usage(what).remedy("give a file that mmt made with --record")
        }
        error @ Error::Table { .. } => output::unwritten(&arguments.out, error),
    }
}
