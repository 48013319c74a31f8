//! The report as a table for people. A row without any number is left out.

use std::fmt;

use super::{
    Counts, EmulationReport, EstimateReport, LoopReport, MessagesReport, Number, QuantilesReport,
    RunReport, WireReport,
};
use crate::clean::clean;

/// Width of the first column.
const LABEL: usize = 26;
/// Width of every other column.
const CELL: usize = 19;

/// What stands in one place of a row; nothing if there is no number.
pub(super) type Cell = Option<String>;
/// A label and its cells.
pub(super) type Row = (String, Vec<Cell>);

pub(super) fn row(label: &str, cells: impl Into<Vec<Cell>>) -> Row {
    (label.replace('_', " "), cells.into())
}

pub(super) fn number(number: impl Into<Number>, decimals: usize, unit: &str) -> Cell {
    let number: Number = number.into();
    number
        .get()
        .map(|value| format!("{value:.decimals$}{unit}"))
}

pub(super) fn share(value: impl Into<Number>) -> Cell {
    number(value.into().times(100.0), 1, " %")
}

pub(super) fn count(value: Option<u64>, of: &str) -> Cell {
    value.map(|n| format!("{n}{of}"))
}

pub(super) fn after(word: &str, cell: Cell) -> Cell {
    cell.map(|text| format!("{word} {text}"))
}

/// One row per name, after a word.
fn counts(word: &str, counts: Option<&Counts>) -> impl Iterator<Item = Row> {
    let counts = counts.into_iter().flatten();
    counts.map(move |(name, n)| row(&format!("{word}{name}"), [count(Some(*n), "")]))
}

/// The same without the names that never happened.
pub(super) fn happened(word: &str, of: Option<&Counts>) -> impl Iterator<Item = Row> {
    let never = [count(Some(0), "")];
    counts(word, of).filter(move |(_, cells)| *cells != never)
}

/// Rows under a title; no title without a row. A peer may have made up what stands in them.
pub(super) fn section(out: &mut fmt::Formatter<'_>, title: &str, rows: Vec<Row>) -> fmt::Result {
    let mut title = Some(title);
    let known = |(_, cells): &Row| cells.iter().any(Option::is_some);
    for (label, cells) in rows.into_iter().filter(known) {
        if let Some(title) = title.take() {
            writeln!(out, "\n{title}")?;
        }
        // a label or a cell that is full still ends with a space
        let mut line = format!("  {:width$} ", clean(&label), width = LABEL - 1);
        for cell in cells {
            let text = cell.as_deref().map_or("-".to_owned(), clean);
            line.push_str(&format!("{text:width$} ", width = CELL - 1));
        }
        writeln!(out, "{}", line.trim_end())?;
    }
    Ok(())
}

impl<C> fmt::Display for RunReport<C> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.head())?;
        section(f, "Pushes", self.pushes())?;
        section(f, "Felt", self.felt())?;
        section(f, "Updates", self.updates())?;
        section(f, "Force", self.force())?;
        section(f, "Model", self.model())?;
        section(f, "Tool", self.tool())?;
        section(f, "Energy at the hand", self.passivity())?;
        section(f, "Network (up: master to slave)", self.network())?;
        section(f, "Emulated network: released late", self.emulation())?;
        section(f, "Haptic loop", timing(&self.haptic_loop))?;
        section(f, "Slave loop", timing(&self.slave_loop))?;
        // only what happened: there are dozens of names, and in a sound run all counts are 0
        let drops = happened("", self.drops.as_ref());
        section(f, "Dropped or refused", drops.collect())
    }
}

// A row a line, as in the table.
#[rustfmt::skip]
impl<C> RunReport<C> {
    /// What ran, for how long, and how it ended.
    pub(super) fn head(&self) -> String {
        let parts = [
            Some(format!("mmt {} {}", self.command, self.version)),
            after("seed", count(self.seed, "")),
            number(self.duration_s, 1, " s"),
            self.ending.map(str::to_owned),
        ];
        parts.into_iter().flatten().collect::<Vec<_>>().join(", ")
    }

    fn pushes(&self) -> Vec<Row> {
        vec![
            row("completed", [count(self.pushes.completed, "")]),
            row("contact breaks per push", [number(self.pushes.contact_breaks_per_push, 2, "")]),
        ]
    }

    /// Only where the hand felt the tool.
    fn felt(&self) -> Vec<Row> {
        let of = &self.architecture;
        if of.round_trip_ms.get().is_none() {
            return Vec::new();
        }
        vec![
            row("architecture", [of.name.clone()]),
            row("round trip as felt", [number(of.round_trip_ms, 1, " ms")]),
        ]
    }

    fn updates(&self) -> Vec<Row> {
        let (sent, received) = (&self.updates.sent, &self.updates.received);
        let contact = number(sent.contact_rate_hz, 2, " /s of contact");
        let mut rows = vec![
            row("sent", [count(sent.sent, "")]),
            row("rate", [number(sent.rate_hz, 2, " /s"), contact]),
        ];
        rows.extend(counts("for ", sent.by_cause.as_ref()));
        rows.push(row("repeats", [count(sent.repeated, "")]));
        // only what happened: the causes stand above already
        rows.extend(happened("repeats, ", sent.repeated_by_cause.as_ref()));
        rows.push(row("applied", [count(received.applied, "")]));
        rows.extend(counts("dropped, ", received.dropped.as_ref()));
        let (mean, max) = (number(received.age_ms.mean, 0, " ms"), number(received.age_ms.max, 0, " ms"));
        rows.push(row("age of information", [after("mean", mean), after("max", max)]));
        rows
    }

    fn force(&self) -> Vec<Row> {
        let (of, hand) = (&self.force.errors, &self.force.hand);
        let rms = after("r.m.s.", number(of.error_rms_n, 3, " N"));
        let (x, y) = (after("x", number(of.pmse_x, 4, "")), after("y", number(of.pmse_y, 4, "")));
        let jnd = [after("7 %:", share(of.jnd7_share)), after("10 %:", share(of.jnd10_share))];
        let truth = &self.force.truth;
        let against = [
            after("relative", number(truth.relative_error_true, 4, "")),
            after("PMSE", number(truth.pmse_true, 4, "")),
        ];
        let step = number(hand.largest_step_n, 2, " N in a tick");
        vec![
            row("relative error", [number(of.relative_error, 4, ""), rms]),
            row("PMSE", [number(of.pmse, 4, ""), x, y]),
            row("PMSE of |f|", [number(of.pmse_magnitude, 4, "")]),
            row("contact outside the JND", jnd),
            row("against the true force", against),
            row("largest on the hand", [number(hand.largest_n, 2, " N"), step]),
        ]
    }

    fn model(&self) -> Vec<Row> {
        let (model, pose) = (&self.model, &self.pose);
        let thousandths = |rms: Number, max: Number, unit| {
            let of = |of: Number| number(of.times(1e3), 1, unit);
            [after("r.m.s.", of(rms)), after("max", of(max))]
        };
        vec![
            row("mass m", estimate(&model.mass_kg, " kg")),
            row("damping b", estimate(&model.damping_ns_per_m, " N s/m")),
            row("friction c", estimate(&model.friction_n, " N")),
            row("position error", thousandths(pose.position_rms_m, pose.position_max_m, " mm")),
            row("orientation error", thousandths(pose.angle_rms_rad, pose.angle_max_rad, " mrad")),
        ]
    }

    fn tool(&self) -> Vec<Row> {
        vec![
            row("largest force", [number(self.tool.force_peak_n, 2, " N")]),
            row("held back for", [number(self.tool.held_s, 3, " s"), after("by its energy", number(self.tool.energy_held_s, 3, " s"))]),
            row("work on the object", [number(self.tool.work_j, 3, " J"), after("hand", number(self.tool.hand_work_j, 3, " J"))]),
            row("gain of its sensor", [number(self.tool.sensor_gain, 3, "")]),
        ]
    }

    fn passivity(&self) -> Vec<Row> {
        let mj = |of: Number| number(of.times(1e3), 3, " mJ");
        vec![
            row("injected by updates", [mj(self.passivity.energy_injected_j)]),
            row("observer, least", [mj(self.passivity.observer_min_j)]),
            row("work of the hand", [number(self.passivity.hand_work_j, 3, " J")]),
        ]
    }

    fn network(&self) -> Vec<Row> {
        let (link, wire, messages) = (&self.link, &self.wire, &self.messages);
        let (rtt, playout) = (&link.rtt_ms, &link.playout_delay_ms);
        let p = |name, of| after(name, number(of, 1, " ms"));
        vec![
            row("round trip", [p("p50", rtt.p50), p("p99", rtt.p99)]),
            row("loss", [after("up", share(link.loss_up)), after("down", share(link.loss_down))]),
            row("unsent", [after("up", count(link.unsent_up, "")), after("down", count(link.unsent_down, ""))]),
            row("play-out delay", [p("p50", playout.p50), p("p99", playout.p99)]),
            row("messages up", kinds(&messages.up)),
            row("messages down", kinds(&messages.down)),
            row("datagrams up", datagrams(&wire.up)),
            row("datagrams down", datagrams(&wire.down)),
        ]
    }

    fn emulation(&self) -> Vec<Row> {
        let (up, down) = (&self.emulation.up, &self.emulation.down);
        let mut rows = vec![row("up", lateness(up)), row("down", lateness(down))];
        if [up, down].iter().any(|one| one.degraded == Some(true)) {
            let note = "This host was too slow for the emulation: delays and force errors are partly the host's.";
            rows.push(row(note, [Some(String::new())]));
        }
        rows
    }
}

fn lateness(emulation: &EmulationReport) -> Vec<Cell> {
    let late = &emulation.late_us;
    let of = [("p50", late.p50), ("p99", late.p99), ("max", late.max)];
    let mut cells = Vec::from(of.map(|(name, of)| after(name, number(of, 0, " us"))));
    // a dash in this place would ask to be read
    cells.extend((emulation.degraded == Some(true)).then(|| Some("degraded".to_owned())));
    cells
}

pub(super) fn estimate(estimate: &EstimateReport, unit: &str) -> [Cell; 3] {
    [
        number(estimate.estimate, 3, unit),
        after("truth", number(estimate.truth, 3, unit)),
        after("error", share(estimate.relative_error())),
    ]
}

/// The rate, and only the kinds that go this way; scenes and the tool's only if there were any.
fn kinds(messages: &MessagesReport) -> Vec<Cell> {
    let kinds = [
        number(messages.rate_hz, 1, " /s"),
        count(messages.commands, " commands"),
        count(messages.updates, " updates"),
        count(messages.scenes.filter(|n| *n > 0), " scenes"),
        count(messages.tools.filter(|n| *n > 0), " of the tool"),
        count(messages.heartbeats, " heartbeats"),
    ];
    kinds.into_iter().filter(Option::is_some).collect()
}

fn datagrams(wire: &WireReport) -> [Cell; 4] {
    [
        count(wire.datagrams, ""),
        number(wire.rate_hz, 1, " /s"),
        count(wire.bytes, " B"),
        number(wire.bits_per_s.times(1e-3), 1, " kbit/s"),
    ]
}

fn timing(of: &LoopReport) -> Vec<Row> {
    let quantiles = |of: &QuantilesReport| {
        let of = [("p50", of.p50), ("p99", of.p99), ("p99.9", of.p999)];
        of.map(|(name, of)| after(name, number(of, 1, " us")))
    };
    vec![
        row(
            "ticks",
            [count(of.ticks, ""), count(of.skipped, " skipped")],
        ),
        row("computing", quantiles(&of.cpu_us)),
        row("late", quantiles(&of.lateness_us)),
    ]
}
