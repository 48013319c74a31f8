//! A table of results: one shape for CSV files, for the terminal and for JSON.
//!
//! A number that does not exist is empty in CSV, a dash on the terminal and null in JSON, never a zero. CSV and
//! JSON hold every digit; the terminal rounds as the column says.

use std::fmt;

use serde::ser::{Serialize, SerializeMap, SerializeSeq, Serializer};

/// What one field holds.
#[derive(Clone, Debug, PartialEq)]
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

impl Serialize for Cell {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Text(text) => serializer.serialize_str(text),
            Self::Count(count) => serializer.serialize_u64(*count),
            Self::Number(number) => serializer.serialize_f64(*number),
            Self::Absent => serializer.serialize_none(),
        }
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
        let places = keys
            .iter()
            .filter_map(|key| self.columns.iter().position(|column| column.key == *key));
        let places: Vec<usize> = places.collect();
        let rows = self.rows.iter().map(|row| {
            let cells = places.iter().filter_map(|place| row.get(*place).cloned());
            cells.collect()
        });
        Self {
            title: self.title.clone(),
            columns: places
                .iter()
                .filter_map(|place| self.columns.get(*place).copied())
                .collect(),
            rows: rows.collect(),
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

    fn texts(&self) -> Vec<Vec<String>> {
        let keys = self.columns.iter().map(|column| column.key.to_owned());
        let shown = |row: &Vec<Cell>| {
            let cells = row.iter().zip(&self.columns);
            cells
                .map(|(cell, column)| shown(cell, column.decimals))
                .collect()
        };
        std::iter::once(keys.collect())
            .chain(self.rows.iter().map(shown))
            .collect()
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

fn shown(cell: &Cell, decimals: usize) -> String {
    match cell {
        Cell::Text(text) => text.clone(),
        Cell::Count(count) => count.to_string(),
        Cell::Number(number) => format!("{number:.decimals$}"),
        Cell::Absent => "-".to_owned(),
    }
}

impl fmt::Display for Table {
    /// The title and the rows, words to the left and numbers to the right.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.title)?;
        let texts = self.texts();
        let width = |k: usize| {
            let fields = texts.iter().filter_map(|row| row.get(k));
            fields.map(|text| text.chars().count()).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..self.columns.len()).map(width).collect();
        for (n, texts) in texts.iter().enumerate() {
            let cells = n.checked_sub(1).and_then(|n| self.rows.get(n));
            let mut line = String::new();
            for (k, (text, width)) in texts.iter().zip(&widths).enumerate() {
                let sample = cells.or(self.rows.first()).and_then(|row| row.get(k));
                let word = matches!(sample, Some(Cell::Text(_)));
                let gap = if k == 0 { "  " } else { "   " };
                line += gap;
                let pad = " ".repeat(width.saturating_sub(text.chars().count()));
                line += &if word {
                    format!("{text}{pad}")
                } else {
                    format!("{pad}{text}")
                };
            }
            writeln!(f, "{}", line.trim_end())?;
        }
        Ok(())
    }
}

/// A row as a map from keys to cells.
struct Record<'a>(&'a [Heading], &'a [Cell]);

impl Serialize for Record<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.1.len()))?;
        for (column, cell) in self.0.iter().zip(self.1) {
            map.serialize_entry(column.key, cell)?;
        }
        map.end()
    }
}

impl Serialize for Table {
    /// A list of records.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut list = serializer.serialize_seq(Some(self.rows.len()))?;
        for row in &self.rows {
            list.serialize_element(&Record(&self.columns, row))?;
        }
        list.end()
    }
}

#[cfg(test)]
mod tests;
