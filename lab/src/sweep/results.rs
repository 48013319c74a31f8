//! The rows that are done: the records of part files, put together to the table of results.
//!
//! A record carries the key of its row, so that rows of another plan or program are never taken for this one's. A
//! line without its end was torn by an interruption and counts as not there.

use std::collections::BTreeMap;

use super::measures::columns;
use super::plan::{Plan, Row};
use crate::table::csv_of;
use crate::trial::Measured;

/// The keys of the measured columns.
fn measured_keys() -> impl Iterator<Item = &'static str> {
    columns().into_iter().map(|column| column.key)
}

/// The first line of a part file, with its end.
#[must_use]
pub fn part_header() -> Vec<u8> {
    csv_of([["row", "key"].into_iter().chain(measured_keys())])
}

/// A row that is done.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RowResult {
    row: u64,
    key: String,
    measured: Vec<String>,
}

impl RowResult {
    /// What was measured of a row.
    #[must_use]
    pub fn of(row: &Row, measured: &Measured) -> Self {
        let columns = columns().into_iter();
        Self {
            row: row.number,
            key: row.key(),
            measured: columns.map(|column| column.cell(measured).csv()).collect(),
        }
    }

    /// As it stands in a part file, with the end of the line.
    #[must_use]
    pub fn line(&self) -> Vec<u8> {
        let head = [self.row.to_string(), self.key.clone()].into_iter();
        csv_of([head.chain(self.measured.iter().cloned())])
    }

    fn of_record(record: &csv::StringRecord) -> Option<Self> {
        let mut fields = record.iter().map(str::to_owned);
        let (row, key) = (fields.next()?.parse().ok()?, fields.next()?);
        let measured: Vec<String> = fields.collect();
        let whole = measured.len() == measured_keys().count();
        whole.then_some(Self { row, key, measured })
    }
}

/// Why a part file does not belong to the plan.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PartError {
    /// Its columns are others.
    #[error("{part} has other columns than this version of mmt writes")]
    Columns {
        /// The file.
        part: String,
    },
    /// A line is no row.
    #[error("{part}, line {line}: this is no row of results")]
    Malformed {
        /// The file.
        part: String,
        /// The line, from 1.
        line: u64,
    },
    /// A row has another configuration or was made by another version.
    #[error("{part}: row {row} belongs to another plan or another version of mmt")]
    OtherPlan {
        /// The file.
        part: String,
        /// The row.
        row: u64,
    },
    /// The same row came out in two ways.
    #[error("{part}: row {row} differs from the same row in another part")]
    Disagree {
        /// The file.
        part: String,
        /// The row.
        row: u64,
    },
}

/// The rows of a plan that are done.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Results {
    rows: BTreeMap<u64, RowResult>,
}

impl Results {
    /// Adds what a part file holds; `part` is its name.
    ///
    /// # Errors
    /// The file belongs to another plan or version, or contradicts what was added before.
    pub fn add_part(&mut self, plan: &Plan, part: &str, bytes: &[u8]) -> Result<(), PartError> {
        let part = || part.to_owned();
        // what follows the last line end is torn
        let end = bytes.iter().rposition(|byte| *byte == b'\n');
        let whole = end.and_then(|end| bytes.get(..=end)).unwrap_or_default();
        let Some(records) = whole.strip_prefix(part_header().as_slice()) else {
            let empty = whole.is_empty();
            return if empty {
                Ok(())
            } else {
                Err(PartError::Columns { part: part() })
            };
        };
        let reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .from_reader(records);
        for (record, line) in reader.into_records().zip(2..) {
            let found = record.ok().and_then(|record| RowResult::of_record(&record));
            let found = found.ok_or_else(|| PartError::Malformed { part: part(), line })?;
            let row = found.row;
            match self.rows.get(&row) {
                Some(known) if *known == found => continue,
                Some(known) if known.key == found.key => {
                    return Err(PartError::Disagree { part: part(), row });
                }
                _ => {}
            }
            if plan.row(row).is_none_or(|row| row.key() != found.key) {
                return Err(PartError::OtherPlan { part: part(), row });
            }
            self.rows.insert(row, found);
        }
        Ok(())
    }

    /// Number of rows done.
    #[must_use]
    pub fn done(&self) -> u64 {
        self.rows.len() as u64
    }

    /// The numbers of the plan's rows that are not done.
    pub fn missing(&self, plan: &Plan) -> impl Iterator<Item = u64> {
        (1..=plan.rows()).filter(|row| !self.rows.contains_key(row))
    }

    /// The rows that are done, in their order, below the names of their columns: `row`, a column per key of the axes, `seed`,
    /// what was measured.
    #[must_use]
    pub fn table(&self, plan: &Plan) -> (Vec<String>, Vec<Vec<String>>) {
        let head = std::iter::once("row").chain(plan.keys()).chain(["seed"]);
        let head = head.map(str::to_owned);
        let header = head.chain(measured_keys().map(str::to_owned)).collect();
        let record = |(number, result): (&u64, &RowResult)| {
            let row = plan.row(*number)?;
            let place = std::iter::once(number.to_string()).chain(row.values);
            let place = place.chain([row.seed.to_string()]);
            Some(place.chain(result.measured.iter().cloned()).collect())
        };
        (header, self.rows.iter().filter_map(record).collect())
    }

    /// The same as CSV (RFC 4180, lines end with LF); none while rows are missing.
    #[must_use]
    pub fn to_csv(&self, plan: &Plan) -> Option<Vec<u8>> {
        if self.missing(plan).next().is_some() {
            return None;
        }
        let (header, records) = self.table(plan);
        Some(csv_of(std::iter::once(header).chain(records)))
    }
}
