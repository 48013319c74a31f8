//! The rows that are done: lines of part files, put together to the table of results.
//!
//! A line carries the key of its row, so that rows of another plan or program are never taken for this one's. A
//! line without its end was torn by an interruption and counts as not there.

use std::collections::BTreeMap;

use super::measures::{MEASURES, measured_line};
use super::plan::{Plan, Row};
use crate::trial::Measured;

/// The first line of a part file, with its end.
#[must_use]
pub fn part_header() -> String {
    format!("row,key,{}\n", MEASURES.join(","))
}

/// A row that is done.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Line {
    row: u64,
    key: String,
    measured: String,
}

impl Line {
    /// What was measured of a row.
    #[must_use]
    pub fn of(row: &Row, measured: &Measured) -> Self {
        Self {
            row: row.number,
            key: row.key(),
            measured: measured_line(measured),
        }
    }

    /// As it stands in a part file, with its end.
    #[must_use]
    pub fn text(&self) -> String {
        format!("{},{},{}\n", self.row, self.key, self.measured)
    }

    fn parse(text: &str) -> Option<Self> {
        let (row, rest) = text.split_once(',')?;
        let (key, measured) = rest.split_once(',')?;
        let whole = measured.split(',').count() == MEASURES.len();
        whole.then_some(Self {
            row: row.parse().ok()?,
            key: key.to_owned(),
            measured: measured.to_owned(),
        })
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
        line: usize,
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
    lines: BTreeMap<u64, Line>,
}

impl Results {
    /// Adds what a part file holds; `part` is its name.
    ///
    /// # Errors
    /// The file belongs to another plan or version, or contradicts what was added before.
    pub fn add_part(&mut self, plan: &Plan, part: &str, text: &str) -> Result<(), PartError> {
        let part = || part.to_owned();
        // what follows the last line end is torn
        let (whole, _) = text.rsplit_once('\n').unwrap_or_default();
        let mut lines = whole.lines().enumerate();
        match lines.next() {
            None => return Ok(()),
            Some((_, header)) if header == part_header().trim_end() => {}
            Some(_) => return Err(PartError::Columns { part: part() }),
        }
        for (n, text) in lines {
            let line = n + 1;
            let found =
                Line::parse(text).ok_or_else(|| PartError::Malformed { part: part(), line })?;
            let row = found.row;
            match self.lines.get(&row) {
                Some(known) if *known == found => continue,
                Some(known) if known.key == found.key => {
                    return Err(PartError::Disagree { part: part(), row });
                }
                _ => {}
            }
            if plan.row(row).is_none_or(|row| row.key() != found.key) {
                return Err(PartError::OtherPlan { part: part(), row });
            }
            self.lines.insert(row, found);
        }
        Ok(())
    }

    /// Number of rows done.
    #[must_use]
    pub fn done(&self) -> u64 {
        self.lines.len() as u64
    }

    /// Whether a row is done.
    #[must_use]
    pub fn has(&self, row: u64) -> bool {
        self.lines.contains_key(&row)
    }

    /// The numbers of the plan's rows that are not done.
    pub fn missing(&self, plan: &Plan) -> impl Iterator<Item = u64> {
        (1..=plan.rows()).filter(|row| !self.has(*row))
    }

    /// The table of results as CSV (RFC 4180, lines end with LF): `row`, a column per key of the axes, `seed`, what
    /// was measured; none while rows are missing.
    #[must_use]
    pub fn to_csv(&self, plan: &Plan) -> Option<Vec<u8>> {
        let mut csv = csv::Writer::from_writer(Vec::new());
        let header = std::iter::once("row").chain(plan.keys());
        // writing to memory cannot fail, and every row has as many fields as there are columns
        let _ = csv.write_record(header.chain(["seed"]).chain(MEASURES));
        for number in 1..=plan.rows() {
            let (row, line) = (plan.row(number)?, self.lines.get(&number)?);
            let (number, seed) = (number.to_string(), row.seed.to_string());
            let place =
                std::iter::once(number.as_str()).chain(row.values.iter().map(String::as_str));
            let _ = csv.write_record(place.chain([seed.as_str()]).chain(line.measured.split(',')));
        }
        csv.into_inner().ok()
    }
}
