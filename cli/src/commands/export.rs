//! `mmt export`: the tables of a record as comma-separated values, one file a topic.

use std::collections::BTreeMap;
use std::fs::{File, create_dir_all};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use mmt_shared::io::record::{Ended, RecordError, read};
use mmt_shared::record::table::row;

use crate::args::ExportArguments;
use crate::failure::Failure;
use crate::output::{note, print};

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
/// The record cannot be read, or a table cannot be written.
pub(crate) fn run(arguments: &ExportArguments) -> Result<(), Failure> {
    let mut sheets = BTreeMap::new();
    let ended = export(&arguments.file, &arguments.out, &mut sheets);
    let finished = sheets.values_mut().try_for_each(|sheet: &mut Sheet| {
        let flushed = sheet.file.flush();
        flushed.map_err(|source| unwritten(&sheet.path, source))
    });
    let ended = ended.and_then(|ended| finished.map(|()| ended));
    let ended = ended.map_err(|error| failure(&arguments.file, error))?;
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
    create_dir_all(out).map_err(|source| unwritten(out, source))?;
    read(record, |topic, message| -> Result<(), Error> {
        let Some(row) = row(topic, message) else {
            return Ok(());
        };
        let row = row.map_err(|why| RecordError::Message {
            topic: topic.to_owned(),
            why,
        })?;
        if !sheets.contains_key(topic) {
            // only known topics have rows: the name is one of ours
            let name = topic.trim_start_matches('/').replace('/', "-");
            let path = out.join(format!("{name}.csv"));
            let begun = begin(&path, &row.columns);
            let file = begun.map_err(|source| unwritten(&path, source))?;
            let sheet = Sheet {
                path,
                file,
                rows: 0,
            };
            sheets.insert(topic.to_owned(), sheet);
        }
        let Some(sheet) = sheets.get_mut(topic) else {
            return Ok(());
        };
        sheet.rows += 1;
        let line = writeln!(sheet.file, "{}", row.cells.join(","));
        line.map_err(|source| unwritten(&sheet.path, source))
    })
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

fn failure(record: &Path, error: Error) -> Failure {
    match error {
        Error::Record(why) => {
            let what = format!("the record {}: {why}", record.display());
            Failure::usage(what).remedy("give a file that mmt made with --record")
        }
        error @ Error::Table { .. } => {
            Failure::failed(error).remedy("give --out a folder that can be written, with room")
        }
    }
}
