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

use super::records::RECORDS;
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
        return Err(Failure::usage("there is no session in this record").remedy(RECORDS));
    }
    name_lone_hand(&mut sheets, &arguments.out)?;
    let hands = hands_there(&arguments.out);
    let known = topics().map(sheet_name).chain([HAND.to_owned()]);
    for name in known.chain(hands) {
        if !sheets.contains_key(&name) {
            take_away(&table(&arguments.out, &name))?;
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
            put(sheets, out, &hand_name(tick.session), &hand.row(&tick))?;
        }
        Ok(())
    })
}

/// The table of a topic.
fn sheet_name(topic: impl AsRef<str>) -> String {
    topic.as_ref().trim_start_matches('/').replace('/', "-")
}

/// The file of a table.
fn table(out: &Path, name: &str) -> PathBuf {
    out.join(format!("{name}.csv"))
}

/// The table of what the device read in a record with one session: a trace for `mmt master --operator`.
const HAND: &str = "hand";

/// The same of a session among several.
fn hand_name(session: u32) -> String {
    format!("{HAND}-{session}")
}

/// Whether a table is the hand of a session among several.
fn is_hand(name: &str) -> bool {
    let number = name.strip_prefix(HAND).and_then(|of| of.strip_prefix('-'));
    number.is_some_and(|number| number.parse::<u32>().is_ok())
}

/// Gives the hand of a lone session its name.
fn name_lone_hand(sheets: &mut BTreeMap<String, Sheet>, out: &Path) -> Result<(), Failure> {
    let hands = sheets.keys().filter(|name| is_hand(name));
    let hands: Vec<String> = hands.cloned().collect();
    if let [lone] = hands.as_slice()
        && let Some(mut sheet) = sheets.remove(lone)
    {
        let path = table(out, HAND);
        let renamed = std::fs::rename(&sheet.path, &path);
        renamed.map_err(|source| output::unwritten(out, unwritten(&path, source)))?;
        sheet.path = path;
        sheets.insert(HAND.to_owned(), sheet);
    }
    Ok(())
}

/// The hands of sessions that are in the folder, also those of an earlier export.
fn hands_there(out: &Path) -> Vec<String> {
    let found = std::fs::read_dir(out).into_iter().flatten().flatten();
    let names = found.filter_map(|entry| {
        let name = entry.file_name().into_string().ok()?;
        Some(name.strip_suffix(".csv")?.to_owned())
    });
    names.filter(|name| is_hand(name)).collect()
}

/// Where the hand was, from the first tick of its session on: each session has a clock of its own.
#[derive(Debug, Default)]
struct Hand {
    /// The session, and when it began.
    began: Option<(u32, u64)>,
}

impl Hand {
    fn row(&mut self, tick: &MasterTick) -> Row {
        let of_session = self.began.filter(|(session, _)| *session == tick.session);
        let (_, began_ns) = of_session.unwrap_or((tick.session, tick.deadline_ns));
        self.began = Some((tick.session, began_ns));
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
            let path = table(out, name);
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
            Failure::usage(what).remedy(RECORDS)
        }
        error @ Error::Table { .. } => output::unwritten(&arguments.out, error),
    }
}

#[cfg(test)]
mod tests {
    use mmt_client::operator::trace::Trace;
    use mmt_shared::io::record::RecordWriter;
    use mmt_shared::record::messages::Stamp;

    use super::*;

    fn tick(session: u32, deadline_ns: u64) -> MasterTick {
        MasterTick {
            stamp: Stamp(deadline_ns),
            session,
            index: 0,
            deadline_ns,
            lateness_ns: 0,
            skipped: 0,
            reading_x_m: f64::from(session),
            reading_y_m: 0.0,
            engaged: true,
            releases: false,
            stops: false,
            sent_ns: deadline_ns,
            hip_x_m: 0.0,
            hip_y_m: 0.0,
            f_m_x_n: 0.0,
            f_m_y_n: 0.0,
            hand_x_n: 0.0,
            hand_y_n: 0.0,
            in_contact: false,
            link: "fresh".to_owned(),
            digest: 0,
        }
    }

    /// The tables of a record with so many sessions, each with a clock of its own, in `folder`.
    fn exported(folder: &Path, sessions: u32) {
        let record = folder.join("run.mcap");
        let mut writer = RecordWriter::create(File::create(&record).unwrap());
        for session in 1..=sessions {
            for number in 0..3 {
                let tick = tick(session, 1_000_000 * (number + 1));
                writer.put("/master/ticks", tick.stamp, &tick);
            }
        }
        assert_eq!(writer.finish(), None);
        let (file, out) = (record, folder.to_owned());
        run(&ExportArguments { file, out }).unwrap();
    }

    /// Where the hand of a table is at first.
    fn hand(path: &Path) -> Option<f64> {
        let text = std::fs::read_to_string(path).ok()?;
        let trace = Trace::from_csv(&text).unwrap();
        let (_, first) = trace.samples()[0];
        Some(first.x)
    }

    #[test]
    fn each_session_has_a_hand_of_its_own_that_an_operator_takes() {
        let home = tempfile::tempdir().unwrap();
        let hands = || {
            let names = ["hand.csv", "hand-1.csv", "hand-2.csv", "hand-3.csv"];
            names.map(|name| hand(&home.path().join(name)))
        };
        exported(home.path(), 1);
        assert_eq!(hands(), [Some(1.0), None, None, None]);
        exported(home.path(), 3);
        assert_eq!(hands(), [None, Some(1.0), Some(2.0), Some(3.0)]);
        // nothing of an export before is left
        exported(home.path(), 2);
        assert_eq!(hands(), [None, Some(1.0), Some(2.0), None]);
        exported(home.path(), 1);
        assert_eq!(hands(), [Some(1.0), None, None, None]);
    }
}
