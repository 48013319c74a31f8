//! `mmt netem report`: what a record shows, held against the settings it was made with.

use std::fmt;
use std::path::Path;

use mmt_netem::record::summary::Summary;
use mmt_netem::record::{self, End, Entry, Heading};
use mmt_netem::{Direction, Effect};
use mmt_shared::time::Time;
use serde::Serialize;

use super::start::DEGRADED;
use crate::args::{NetemReportArguments, network};
use crate::failure::Failure;
use crate::input::read_bytes;
use crate::output::{print, print_json};

/// The document of a record.
#[derive(Debug, Serialize)]
pub(super) struct RecordReport {
    version: &'static str,
    command: &'static str,
    heading: Heading,
    /// Whether the host was too slow in either direction for this to be about the links.
    degraded: bool,
    up: DirectionReport,
    down: DirectionReport,
}

/// One direction: its settings, and what came of them.
#[derive(Debug, Serialize)]
struct DirectionReport {
    words: String,
    /// What the settings do to the packets of the record, by another seed; none without packets, or where a file that they
    /// name cannot be read any more.
    configured: Option<Effect>,
    achieved: Summary,
}

/// Runs `mmt netem report`.
///
/// # Errors
/// The file cannot be read or is no record.
pub(super) fn run(arguments: &NetemReportArguments) -> Result<(), Failure> {
    let report = RecordReport::of_file(&arguments.file)?;
    if arguments.json {
        print_json(&report)
    } else if arguments.full {
        print(&report)
    } else {
        print(Brief(&report))
    }
}

impl RecordReport {
    fn of_file(path: &Path) -> Result<Self, Failure> {
        let bytes = read_bytes(path, "the record")?;
        let (heading, entries) = record::read(&bytes).map_err(|error| {
            let what = format!("{} is no record: {error}", path.display());
            Failure::usage(what).remedy("give a file made with mmt netem --record")
        })?;
        let direction = |words: &str, direction| {
            let offers = offers(&entries, direction);
            let achieved = Summary::of(&entries, direction);
            let configured = network(words)
                .ok()
                .filter(|_| achieved.rate_hz > 0.0)
                .and_then(|link| link.expected_of(&offers).ok());
            DirectionReport {
                words: words.to_owned(),
                configured,
                achieved,
            }
        };
        let up = direction(&heading.up, Direction::Up);
        let down = direction(&heading.down, Direction::Down);
        Ok(Self {
            version: env!("CARGO_PKG_VERSION"),
            command: "netem report",
            degraded: up.achieved.degraded || down.achieved.degraded,
            heading,
            up,
            down,
        })
    }
}

/// When the packets of a direction were offered, and their lengths.
fn offers(entries: &[Entry], direction: Direction) -> Vec<(Time, usize)> {
    let copy = |entry: &Entry| matches!(entry.end, End::Sent { copy: true, .. });
    let mine = entries.iter().filter(|entry| entry.direction == direction);
    let mut mine: Vec<&Entry> = mine.filter(|entry| !copy(entry)).collect();
    mine.sort_by_key(|entry| entry.number);
    let offer = |entry: &&Entry| (entry.offered, entry.bytes as usize);
    mine.iter().map(offer).collect()
}

/// A report in a sentence and ten lines, without what is zero.
struct Brief<'a>(&'a RecordReport);

impl fmt::Display for Brief<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let report = self.0;
        let ways = [("up", &report.up), ("down", &report.down)];
        writeln!(f, "{}", report.head())?;
        for (name, way) in ways {
            writeln!(f, "{name:4} {}", way.words)?;
        }
        writeln!(f)?;
        if report.degraded {
            writeln!(f, "{DEGRADED}")?;
        }
        writeln!(f, "{}\n", report.verdict())?;
        let columns = ["up, set", "up", "down, set", "down"].map(|name| format!("{name:>12}"));
        writeln!(f, "  {:22}{}", "", columns.concat())?;
        let [up, down] = ways.map(|(_, way)| way.rows());
        for ((label, decimals, up), (_, _, down)) in up.into_iter().zip(down) {
            let cell = |value: Option<f64>| {
                value.map_or_else(|| "-".to_owned(), |value| format!("{value:.decimals$}"))
            };
            let cells = [up, down].concat().into_iter().map(cell);
            let cells: Vec<String> = cells.collect();
            let has_number = |cell: &String| cell.chars().any(|digit| ('1'..='9').contains(&digit));
            if cells.iter().any(has_number) {
                let cells: String = cells.iter().map(|cell| format!("{cell:>12}")).collect();
                writeln!(f, "  {label:22}{cells}")?;
            }
        }
        Ok(())
    }
}

impl RecordReport {
    fn head(&self) -> String {
        let (command, version, seed) = (self.command, self.version, self.heading.seed);
        format!("mmt {command} {version}, seed {seed}")
    }

    /// What came of the settings, in a sentence.
    fn verdict(&self) -> String {
        let ways = [("Up", &self.up), ("down", &self.down)].map(|(name, way)| {
            let seen = &way.achieved;
            if seen.offered.packets == 0 {
                return format!("{name} nothing came");
            }
            let (ms, percent) = (seen.mean_ms, 100.0 * seen.loss);
            let set = way.configured.as_ref().map_or_else(String::new, |set| {
                let dropped = 100.0 * (set.loss + set.queue_drops + set.over_limit);
                format!(
                    " ({:.1} ms and {dropped:.1} % by the settings)",
                    set.mean_ms
                )
            });
            format!("{name} a packet took {ms:.1} ms and {percent:.1} % were dropped{set}")
        });
        format!("{}.", ways.join("; "))
    }
}

impl fmt::Display for RecordReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.head())?;
        for (name, direction) in [("up", &self.up), ("down", &self.down)] {
            writeln!(f, "\n{name}: {}", direction.words)?;
            direction.fmt(f)?;
        }
        if self.degraded {
            write!(f, "\n{DEGRADED}")?;
        }
        Ok(())
    }
}

/// Label, decimals; what the settings make, and what came of them.
type Row = (&'static str, usize, [Option<f64>; 2]);

impl DirectionReport {
    /// What a network does to packets.
    fn effects(&self) -> Vec<Row> {
        let seen = &self.achieved;
        let there = seen.offered.packets > 0;
        let row = |label, set: fn(&Effect) -> Option<f64>, achieved: f64| {
            let set = self.configured.as_ref().and_then(set);
            (label, 3, [set, there.then_some(achieved)])
        };
        // what a full queue drops has runs that the effect does not count
        let burst = |e: &Effect| (e.queue_drops + e.over_limit == 0.0).then_some(e.burst_packets);
        vec![
            row("mean delay, ms", |e| Some(e.mean_ms), seen.mean_ms),
            row("standard deviation, ms", |e| Some(e.sd_ms), seen.sd_ms),
            row("p99, ms", |e| Some(e.p99_ms), seen.p99_ms),
            row(
                "dropped, %",
                |e| Some(100.0 * (e.loss + e.queue_drops + e.over_limit)),
                100.0 * seen.loss,
            ),
            row("burst, packets", burst, seen.burst_packets),
            row(
                "reordered, %",
                |e| Some(100.0 * e.reordered),
                100.0 * seen.reordered,
            ),
        ]
    }

    /// The rows that most people want.
    fn rows(&self) -> Vec<Row> {
        let seen = &self.achieved;
        let [_, p99, _] = seen.lateness_us;
        let most = seen.queue.iter().map(|(_, most)| *most).max();
        let counted = |label, decimals, value| (label, decimals, [None, Some(value)]);
        let mut rows = vec![
            counted("packets offered", 0, seen.offered.packets as f64),
            counted("packets a second", 1, seen.rate_hz),
        ];
        rows.extend(self.effects());
        rows.push(counted("most in flight", 0, f64::from(most.unwrap_or(0))));
        rows.push(counted("released late p99, us", 0, p99));
        rows
    }
}

impl fmt::Display for DirectionReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let seen = &self.achieved;
        if seen.offered.packets == 0 {
            return writeln!(f, "  no packet");
        }
        writeln!(
            f,
            "  {} packets offered at {:.1} /s, {} sent ({} copies, {} corrupted)",
            seen.offered.packets, seen.rate_hz, seen.sent.packets, seen.copies, seen.corrupted
        )?;
        for (cause, packets) in &seen.dropped {
            writeln!(f, "  dropped ({cause}) {packets}")?;
        }
        writeln!(f, "  {:22} {:>12} {:>12}", "", "configured", "achieved")?;
        for (label, _, [configured, achieved]) in self.effects() {
            let shown = |value: Option<f64>| {
                value.map_or_else(|| "-".to_owned(), |value| format!("{value:.3}"))
            };
            let (configured, achieved) = (shown(configured), shown(achieved));
            writeln!(f, "  {label:22} {configured:>12} {achieved:>12}")?;
        }
        let [p50, p99, max] = seen.lateness_us;
        writeln!(
            f,
            "  released late: p50 {p50:.0} us, p99 {p99:.0} us, max {max:.0} us"
        )?;
        bars(f, "  delay, ms from", &seen.delay_histogram, 2)?;
        let bursts = seen.loss_bursts.iter();
        let bursts: Vec<(f64, u64)> = bursts.map(|(length, n)| (*length as f64, *n)).collect();
        bars(f, "  lost in a row", &bursts, 0)?;
        bars(f, "  in flight at, s", &thinned(&seen.queue), 2)?;
        let most = seen.queue.iter().map(|(_, most)| *most).max();
        writeln!(f, "  most in flight: {} packets", most.unwrap_or(0))
    }
}

/// The most in flight within each twentieth of the run.
fn thinned(queue: &[(f64, u32)]) -> Vec<(f64, u64)> {
    const ROWS: usize = 20;
    let most = |part: &[(f64, u32)]| {
        let (at, _) = part.first()?;
        let most = part.iter().map(|(_, packets)| *packets).max()?;
        Some((*at, u64::from(most)))
    };
    let length = queue.len().div_ceil(ROWS).max(1);
    queue.chunks(length).filter_map(most).collect()
}

/// A bar for each row that is not empty, at most 40 rows.
fn bars(
    f: &mut fmt::Formatter<'_>,
    label: &str,
    rows: &[(f64, u64)],
    decimals: usize,
) -> fmt::Result {
    const WIDTH: f64 = 40.0;
    const ROWS: usize = 40;
    let most = rows.iter().map(|(_, n)| *n).max().unwrap_or(0).max(1) as f64;
    let filled = rows.iter().filter(|(_, n)| *n > 0).take(ROWS);
    for (at, (value, n)) in filled.enumerate() {
        let label = if at == 0 { label } else { "" };
        let bar = "#".repeat((*n as f64 / most * WIDTH).ceil() as usize);
        writeln!(f, "{label:16} {value:>10.decimals$} {n:>8} {bar}")?;
    }
    Ok(())
}
