//! What `mmt sweep` prints on stdout: what a plan asks for, and how much of it is there. It never decides what runs.

use std::fmt;
use std::path::Path;

use mmt_lab::sweep::{Plan, Results, Row, Shard};
use serde::{Serialize, Serializer};

use crate::args::SweepArguments;

/// Missing rows that are named; the others are counted.
const NAMED: usize = 10;

/// What a plan asks for.
#[derive(Debug, Serialize)]
pub(super) struct Preview {
    command: &'static str,
    version: &'static str,
    rows: u64,
    shard: String,
    shard_rows: u64,
    first: Option<Point>,
    last: Option<Point>,
}

/// A row of the plan, for people.
#[derive(Debug, Serialize)]
struct Point {
    row: u64,
    #[serde(serialize_with = "as_map")]
    values: Vec<(String, String)>,
    seed: u64,
}

impl Preview {
    /// Of a share of a plan.
    pub(super) fn new(plan: &Plan, shard: Shard) -> Self {
        let mut rows = (1..=plan.rows()).filter(|row| shard.has(*row));
        let shard_rows = rows.clone().count() as u64;
        let point = |number: u64| plan.row(number).map(|row| Point::new(plan, row));
        let first = rows.clone().next().and_then(point);
        Self {
            command: "sweep",
            version: env!("CARGO_PKG_VERSION"),
            rows: plan.rows(),
            shard: shard.to_string(),
            shard_rows,
            first,
            last: rows.next_back().and_then(point),
        }
    }
}

impl Point {
    fn new(plan: &Plan, row: Row) -> Self {
        Self {
            row: row.number,
            values: plan.keys().map(str::to_owned).zip(row.values).collect(),
            seed: row.seed,
        }
    }
}

/// Keys with their values, in the order of the plan.
fn as_map<S: Serializer>(values: &[(String, String)], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(values.iter().map(|(key, value)| (key, value)))
}

impl fmt::Display for Point {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "row {}:", self.row)?;
        for (key, value) in &self.values {
            write!(f, " {key} = {value},")?;
        }
        write!(f, " seed = {}", self.seed)
    }
}

impl fmt::Display for Preview {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} rows, {} in shard {}",
            self.rows, self.shard_rows, self.shard
        )?;
        for (name, point) in [("first", &self.first), ("last", &self.last)] {
            if let Some(point) = point {
                write!(f, "\n{name}: {point}")?;
            }
        }
        Ok(())
    }
}

/// How much of a plan is there.
#[derive(Debug, Serialize)]
pub(super) struct Summary {
    command: &'static str,
    version: &'static str,
    rows: u64,
    shard: String,
    /// Rows that were not there before this run.
    ran: u64,
    done: u64,
    missing: u64,
    /// Missing rows of this shard.
    shard_missing: u64,
    /// The first of them.
    first_missing: Vec<u64>,
    /// The table; none while rows are missing.
    results: Option<String>,
}

impl Summary {
    /// Of a plan with what was there before and what is there now.
    pub(super) fn new(
        plan: &Plan,
        arguments: &SweepArguments,
        before: &Results,
        now: &Results,
        table: Option<&Path>,
    ) -> Self {
        let mine = |results: &Results| {
            let missing = results.missing(plan);
            missing.filter(|row| arguments.shard.has(*row)).count() as u64
        };
        let missing = now.missing(plan).filter(|row| arguments.shard.has(*row));
        Self {
            command: "sweep",
            version: env!("CARGO_PKG_VERSION"),
            rows: plan.rows(),
            shard: arguments.shard.to_string(),
            // other shards may have worked in the same folder meanwhile
            ran: mine(before).saturating_sub(mine(now)),
            done: now.done(),
            missing: plan.rows().saturating_sub(now.done()),
            shard_missing: mine(now),
            first_missing: missing.take(NAMED).collect(),
            results: table.map(|path| path.display().to_string()),
        }
    }

    /// Which rows are missing that should be there; none if all are there.
    pub(super) fn missing_here(&self) -> Option<String> {
        let (count, named) = (self.shard_missing, self.first_missing.len() as u64);
        if count == 0 {
            return None;
        }
        let names: Vec<String> = self.first_missing.iter().map(u64::to_string).collect();
        let more = if count > named {
            format!(" and {} more", count - named)
        } else {
            String::new()
        };
        let (rows, shard) = (self.rows, &self.shard);
        Some(format!(
            "{count} rows of shard {shard} are missing (the plan has {rows}): {}{more}",
            names.join(", ")
        ))
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (ran, done, rows) = (self.ran, self.done, self.rows);
        write!(f, "{ran} rows run, {done} of {rows} done")?;
        match &self.results {
            Some(path) => write!(f, "\nresults: {path}"),
            None => write!(f, ", {} missing", self.missing),
        }
    }
}
