//! The report as a table for people. A row without any number is left out.

use std::fmt;

use super::{
    Counts, EmulationReport, EstimateReport, LoopReport, MessagesReport, Number, QuantilesReport,
    RunReport, WireReport,
};

/// Width of the first column.
const LABEL: usize = 26;
/// Width of every other column.
const CELL: usize = 19;

/// What stands in one place of a row; nothing if there is no number.
type Cell = Option<String>;

fn number(number: Number, decimals: usize, unit: &str) -> Cell {
    number
        .get()
        .map(|value| format!("{value:.decimals$}{unit}"))
}

fn share(value: Number) -> Cell {
    number(value.times(100.0), 1, " %")
}

fn count(value: Option<u64>, of: &str) -> Cell {
    value.map(|n| format!("{n}{of}"))
}

fn after(word: &str, cell: Cell) -> Cell {
    cell.map(|text| format!("{word} {text}"))
}

/// Rows under a title; the title is written with the first row.
struct Section<'a, 'f> {
    out: &'a mut fmt::Formatter<'f>,
    title: Option<&'static str>,
}

impl Section<'_, '_> {
    fn row(&mut self, label: &str, cells: &[Cell]) -> fmt::Result {
        if cells.iter().all(Option::is_none) {
            return Ok(());
        }
        if let Some(title) = self.title.take() {
            writeln!(self.out, "\n{title}")?;
        }
        // a label that is full still ends with a space
        let mut line = format!("  {label:width$} ", width = LABEL - 1);
        for cell in cells {
            let text = cell.as_deref().unwrap_or("-");
            // a cell that is full still ends with a space
            line.push_str(&format!("{text:width$} ", width = CELL - 1));
        }
        writeln!(self.out, "{}", line.trim_end())
    }

    /// One row per name, after a word.
    fn counts(&mut self, word: &str, counts: Option<&Counts>) -> fmt::Result {
        for (name, n) in counts.into_iter().flatten() {
            let name = name.replace('_', " ");
            self.row(&format!("{word}{name}"), &[count(Some(*n), "")])?;
        }
        Ok(())
    }
}

impl<C> fmt::Display for RunReport<C> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.head(f)?;
        self.work(f)?;
        self.architecture(f)?;
        self.updates(f)?;
        self.force(f)?;
        self.model(f)?;
        self.tool(f)?;
        self.passivity(f)?;
        self.network(f)?;
        self.emulation(f)?;
        loop_rows(f, "Haptic loop", &self.haptic_loop)?;
        loop_rows(f, "Slave loop", &self.slave_loop)?;
        self.drops(f)
    }
}

fn section<'a, 'f>(out: &'a mut fmt::Formatter<'f>, title: &'static str) -> Section<'a, 'f> {
    Section {
        out,
        title: Some(title),
    }
}

impl<C> RunReport<C> {
    /// Only what happened: there are dozens of names, and in a sound run all counts are 0.
    fn drops(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut rows = section(f, "Dropped or refused");
        let happened = self.drops.iter().flatten().filter(|(_, n)| **n > 0);
        for (name, n) in happened {
            rows.row(&name.replace('_', " "), &[count(Some(*n), "")])?;
        }
        Ok(())
    }

    fn head(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "mmt {} {}", self.command, self.version)?;
        let parts = [
            after("seed", count(self.seed, "")),
            number(self.duration_s, 1, " s"),
            self.ending.clone(),
        ];
        for part in parts.into_iter().flatten() {
            write!(f, ", {part}")?;
        }
        writeln!(f)
    }

    fn work(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut rows = section(f, "Pushes");
        rows.row("completed", &[count(self.pushes.completed, "")])?;
        rows.row(
            "contact breaks per push",
            &[number(self.pushes.contact_breaks_per_push, 2, "")],
        )
    }

    /// Only where the hand felt the tool.
    fn architecture(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let of = &self.architecture;
        let (Some(name), Some(_)) = (&of.name, of.round_trip_ms.get()) else {
            return Ok(());
        };
        let mut rows = section(f, "Felt");
        rows.row("architecture", &[Some(name.clone())])?;
        let round_trip = number(of.round_trip_ms, 1, " ms");
        rows.row("round trip as felt", &[round_trip])
    }

    fn updates(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let updates = &self.updates;
        let mut rows = section(f, "Updates");
        rows.row("sent", &[count(updates.sent, "")])?;
        rows.row(
            "rate",
            &[
                number(updates.rate_hz, 2, " /s"),
                number(updates.contact_rate_hz, 2, " /s of contact"),
            ],
        )?;
        rows.counts("for ", updates.by_cause.as_ref())?;
        rows.row("repeats", &[count(updates.repeated, "")])?;
        // only what happened: the causes stand above already
        let repeated = updates.repeated_by_cause.iter().flatten();
        for (name, n) in repeated.filter(|(_, n)| **n > 0) {
            let name = name.replace('_', " ");
            rows.row(&format!("repeats, {name}"), &[count(Some(*n), "")])?;
        }
        rows.row("applied", &[count(updates.applied, "")])?;
        rows.counts("dropped, ", updates.dropped.as_ref())?;
        rows.row(
            "age of information",
            &[
                after("mean", number(updates.age_ms.mean, 0, " ms")),
                after("max", number(updates.age_ms.max, 0, " ms")),
            ],
        )
    }

    fn force(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let force = &self.force;
        let mut rows = section(f, "Force");
        rows.row(
            "relative error",
            &[
                number(force.relative_error, 4, ""),
                after("r.m.s.", number(force.error_rms_n, 3, " N")),
            ],
        )?;
        rows.row(
            "PMSE",
            &[
                number(force.pmse, 4, ""),
                after("x", number(force.pmse_x, 4, "")),
                after("y", number(force.pmse_y, 4, "")),
            ],
        )?;
        rows.row("PMSE of |f|", &[number(force.pmse_magnitude, 4, "")])?;
        rows.row(
            "contact outside the JND",
            &[
                after("7 %:", share(force.jnd7_share)),
                after("10 %:", share(force.jnd10_share)),
            ],
        )?;
        rows.row(
            "largest on the hand",
            &[
                number(force.largest_n, 2, " N"),
                number(force.largest_step_n, 2, " N in a tick"),
            ],
        )
    }

    fn model(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (model, pose) = (&self.model, &self.pose);
        let mut rows = section(f, "Model");
        for (label, unit, estimate) in [
            ("mass m", " kg", &model.mass_kg),
            ("damping b", " N s/m", &model.damping_ns_per_m),
            ("friction c", " N", &model.friction_n),
        ] {
            rows.row(label, &estimate_cells(estimate, unit))?;
        }
        let mm = |number: Number| number.times(1e3);
        rows.row(
            "position error",
            &[
                after("r.m.s.", number(mm(pose.position_rms_m), 1, " mm")),
                after("max", number(mm(pose.position_max_m), 1, " mm")),
            ],
        )?;
        rows.row(
            "orientation error",
            &[
                after("r.m.s.", number(mm(pose.angle_rms_rad), 1, " mrad")),
                after("max", number(mm(pose.angle_max_rad), 1, " mrad")),
            ],
        )
    }

    fn tool(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut rows = section(f, "Tool");
        let largest = number(self.tool.force_peak_n, 2, " N");
        rows.row("largest force", &[largest])?;
        let held = number(self.tool.held_s, 3, " s");
        rows.row("held back for", &[held])
    }

    fn passivity(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut rows = section(f, "Energy at the hand");
        let mj = |number: Number| number.times(1e3);
        let injected = number(mj(self.passivity.energy_injected_j), 3, " mJ");
        rows.row("injected by updates", &[injected])?;
        let least = number(mj(self.passivity.observer_min_j), 3, " mJ");
        rows.row("observer, least", &[least])
    }

    fn network(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (link, wire, messages) = (&self.link, &self.wire, &self.messages);
        let mut rows = section(f, "Network (up: master to slave)");
        rows.row(
            "round trip",
            &[
                after("p50", number(link.rtt_ms.p50, 1, " ms")),
                after("p99", number(link.rtt_ms.p99, 1, " ms")),
            ],
        )?;
        rows.row(
            "loss",
            &[
                after("up", share(link.loss_up)),
                after("down", share(link.loss_down)),
            ],
        )?;
        let playout = &link.playout_delay_ms;
        rows.row(
            "play-out delay",
            &[
                after("p50", number(playout.p50, 1, " ms")),
                after("p99", number(playout.p99, 1, " ms")),
            ],
        )?;
        for (way, of) in [("up", &messages.up), ("down", &messages.down)] {
            rows.row(&format!("messages {way}"), &message_cells(of))?;
        }
        rows.row("datagrams up", &wire_cells(&wire.up))?;
        rows.row("datagrams down", &wire_cells(&wire.down))
    }

    fn emulation(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let directions = [&self.emulation.up, &self.emulation.down];
        let mut rows = section(f, "Emulated network: released late");
        for (label, emulation) in ["up", "down"].into_iter().zip(directions) {
            let [p50, p99, max, degraded] = emulation_cells(emulation);
            let mut cells = vec![p50, p99, max];
            // a dash in this place would ask to be read
            cells.extend(degraded.map(Some));
            rows.row(label, &cells)?;
        }
        if directions.iter().any(|one| one.degraded == Some(true)) {
            writeln!(
                f,
                "  This host was too slow for the emulation: delays and force errors are partly the host's."
            )?;
        }
        Ok(())
    }
}

fn emulation_cells(emulation: &EmulationReport) -> [Cell; 4] {
    let late = &emulation.late_us;
    [
        after("p50", number(late.p50, 0, " us")),
        after("p99", number(late.p99, 0, " us")),
        after("max", number(late.max, 0, " us")),
        emulation
            .degraded
            .unwrap_or(false)
            .then(|| "degraded".to_owned()),
    ]
}

fn estimate_cells(estimate: &EstimateReport, unit: &str) -> [Cell; 3] {
    [
        number(estimate.estimate, 3, unit),
        after("truth", number(estimate.truth, 3, unit)),
        after("error", share(estimate.relative_error())),
    ]
}

/// The rate, and only the kinds that go this way; scenes only if there were any.
fn message_cells(messages: &MessagesReport) -> Vec<Cell> {
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

fn wire_cells(wire: &WireReport) -> [Cell; 4] {
    [
        count(wire.datagrams, ""),
        number(wire.rate_hz, 1, " /s"),
        count(wire.bytes, " B"),
        number(wire.bits_per_s.times(1e-3), 1, " kbit/s"),
    ]
}

fn loop_rows(f: &mut fmt::Formatter<'_>, title: &'static str, loop_: &LoopReport) -> fmt::Result {
    let mut rows = section(f, title);
    rows.row(
        "ticks",
        &[count(loop_.ticks, ""), count(loop_.skipped, " skipped")],
    )?;
    rows.row("computing", &quantile_cells(&loop_.cpu_us))?;
    rows.row("late", &quantile_cells(&loop_.lateness_us))
}

fn quantile_cells(quantiles: &QuantilesReport) -> [Cell; 3] {
    [
        after("p50", number(quantiles.p50, 1, " us")),
        after("p99", number(quantiles.p99, 1, " us")),
        after("p99.9", number(quantiles.p999, 1, " us")),
    ]
}
