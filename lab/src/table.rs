//! A table of results: one shape for CSV files, for the terminal and for JSON.
//!
//! A number that does not exist is empty in CSV, a dash on the terminal and null in JSON, never a zero. CSV and
//! JSON hold every digit; the terminal rounds to the column's decimals.

use std::fmt;

use serde::{Serialize, Serializer};

/// What one field holds; in JSON a word, a number or null.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Cell {
    /// A word.
    Text(String),
    /// A whole number.
    Count(u64),
    /// A measured number.
    Number(f64),
    /// Nothing could be measured.
    Absent,
}

impl Cell {
    /// As a field of CSV, with every digit.
    #[must_use]
    pub fn csv(&self) -> String {
        match self {
            Self::Text(text) => text.clone(),
            Self::Count(count) => count.to_string(),
            Self::Number(number) => number.to_string(),
            Self::Absent => String::new(),
        }
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

impl From<u64> for Cell {
    fn from(count: u64) -> Self {
        Self::Count(count)
    }
}

impl From<f64> for Cell {
    fn from(number: f64) -> Self {
        if number.is_finite() {
            Self::Number(number)
        } else {
            Self::Absent
        }
    }
}

impl<T: Into<Cell>> From<Option<T>> for Cell {
    fn from(value: Option<T>) -> Self {
        value.map_or(Self::Absent, Into::into)
    }
}

/// A column of a table whose rows are made of `Row`s.
pub struct Column<'a, Row> {
    /// Its name in files and on the terminal.
    pub key: &'static str,
    /// Its unit; empty for words, counts and shares.
    pub unit: &'static str,
    /// Decimals on the terminal.
    pub decimals: usize,
    of: Box<dyn Fn(&Row) -> Cell + 'a>,
}

impl<'a, Row: 'a> Column<'a, Row> {
    /// A column that shows `of` of each row.
    pub fn new(
        key: &'static str,
        unit: &'static str,
        decimals: usize,
        of: impl Fn(&Row) -> Cell + 'a,
    ) -> Self {
        Self {
            key,
            unit,
            decimals,
            of: Box::new(of),
        }
    }

    /// What it shows of a row.
    #[must_use]
    pub fn cell(&self, row: &Row) -> Cell {
        (self.of)(row)
    }

    /// The same of rows that hold such a row.
    pub fn of<Outer: 'a>(self, inner: fn(&Outer) -> &Row) -> Column<'a, Outer> {
        let of = move |outer: &Outer| (self.of)(inner(outer));
        Column::new(self.key, self.unit, self.decimals, of)
    }
}

/// A column: key, unit, decimals on the terminal, and what it shows of a row.
pub fn column<'a, Row: 'a, T: Into<Cell> + 'a>(
    key: &'static str,
    unit: &'static str,
    decimals: usize,
    of: fn(&Row) -> T,
) -> Column<'a, Row> {
    Column::new(key, unit, decimals, move |row: &Row| of(row).into())
}

/// What stands above a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Heading {
    key: &'static str,
    decimals: usize,
}

/// Rows under columns.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// What the table shows, for people.
    pub title: String,
    columns: Vec<Heading>,
    rows: Vec<Vec<Cell>>,
}

impl Table {
    /// What the columns show of the rows.
    #[must_use]
    pub fn of<'a, Row: 'a>(
        title: impl Into<String>,
        rows: impl IntoIterator<Item = &'a Row>,
        columns: &[Column<Row>],
    ) -> Self {
        let heading = |column: &Column<Row>| Heading {
            key: column.key,
            decimals: column.decimals,
        };
        let cells = |row| columns.iter().map(|column| column.cell(row)).collect();
        Self {
            title: title.into(),
            columns: columns.iter().map(heading).collect(),
            rows: rows.into_iter().map(cells).collect(),
        }
    }

    /// The same with some of its columns, in their order; keys that it does not have are passed over.
    #[must_use]
    pub fn selected(&self, keys: &[&str]) -> Self {
        let place = |key: &&str| self.columns.iter().position(|column| column.key == *key);
        let places: Vec<usize> = keys.iter().filter_map(place).collect();
        fn at<T: Clone>(places: &[usize], all: &[T]) -> Vec<T> {
            let picked = places.iter().filter_map(|place| all.get(*place));
            picked.cloned().collect()
        }
        Self {
            title: self.title.clone(),
            columns: at(&places, &self.columns),
            rows: self.rows.iter().map(|row| at(&places, row)).collect(),
        }
    }

    /// The same without some of its columns.
    #[must_use]
    pub fn without(&self, keys: &[&str]) -> Self {
        let all = self.columns.iter().map(|column| column.key);
        self.selected(&all.filter(|key| !keys.contains(key)).collect::<Vec<_>>())
    }

    /// The rows, each as long as the columns.
    pub fn rows(&self) -> impl Iterator<Item = &[Cell]> {
        self.rows.iter().map(Vec::as_slice)
    }

    /// The table as CSV (RFC 4180, lines end with LF): a header of keys, then the rows.
    #[must_use]
    pub fn to_csv(&self) -> Vec<u8> {
        let keys = self.columns.iter().map(|column| column.key.to_owned());
        let rows = self.rows.iter();
        let rows = rows.map(|row| row.iter().map(Cell::csv).collect());
        csv_of(std::iter::once(keys.collect::<Vec<_>>()).chain(rows))
    }
}

/// Records of equal length as CSV (RFC 4180, lines end with LF).
pub(crate) fn csv_of<T: AsRef<[u8]>>(
    records: impl IntoIterator<Item = impl IntoIterator<Item = T>>,
) -> Vec<u8> {
    let mut csv = csv::Writer::from_writer(Vec::new());
    for record in records {
        // writing to memory cannot fail
        let _ = csv.write_record(record);
    }
    csv.into_inner().unwrap_or_default()
}

impl Heading {
    /// A field of the column as the terminal shows it.
    fn shown(&self, cell: &Cell) -> String {
        match cell {
            Cell::Number(number) => format!("{number:.*}", self.decimals),
            Cell::Absent => "-".to_owned(),
            word_or_count => word_or_count.csv(),
        }
    }
}

impl fmt::Display for Table {
    /// The title and the rows, words to the left and numbers to the right.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.title)?;
        let mut lines = vec![String::new(); self.rows.len() + 1];
        for (k, column) in self.columns.iter().enumerate() {
            let cells: Vec<&Cell> = self.rows.iter().filter_map(|row| row.get(k)).collect();
            let texts = cells.iter().map(|cell| column.shown(cell));
            let texts: Vec<String> = std::iter::once(column.key.to_owned())
                .chain(texts)
                .collect();
            let width = texts.iter().map(|text| text.chars().count()).max();
            // a heading stands as the first field below it
            let samples = cells.iter().take(1).chain(&cells);
            let words = samples.map(|cell| matches!(cell, Cell::Text(_)));
            let words = words.chain(std::iter::repeat(false));
            for ((line, text), word) in lines.iter_mut().zip(texts).zip(words) {
                let (gap, width) = (if k == 0 { "  " } else { "   " }, width.unwrap_or(0));
                *line += &if word {
                    format!("{gap}{text:<width$}")
                } else {
                    format!("{gap}{text:>width$}")
                };
            }
        }
        for line in lines {
            writeln!(f, "{}", line.trim_end())?;
        }
        Ok(())
    }
}

/// A row as a map from keys to cells.
struct Record<'a>(&'a [Heading], &'a [Cell]);

impl Serialize for Record<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let keys = self.0.iter().map(|column| column.key);
        serializer.collect_map(keys.zip(self.1))
    }
}

impl Serialize for Table {
    /// A list of records.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.rows.iter().map(|row| Record(&self.columns, row)))
    }
}

#[cfg(test)]
mod tests;
