//! The report of a record: forces over time, packets and what became of them, delays, the loops.
//!
//! Pure: whoever reads the files hands over message by message. The ends of a run may lie in one file or in two; what only
//! both together show, such as losses and one-way delays, is absent where only one is there.

mod delays;
mod packets;

use mmt_shared::metrics::{ForceMetrics, UpdateCounts};
use mmt_shared::model::geometry::Vec2;
use mmt_shared::model::update::Cause;
use mmt_shared::record::cdr::CdrError;
use mmt_shared::record::messages::{Arrival, MasterTick, Message, Packet, SlaveTick, Stamp};
use mmt_shared::stats::histogram::Histogram;
use mmt_shared::wire::Side;

use crate::figure::Figure;
use crate::forces;
use crate::table::{Column, Table, column};
use crate::trial::TraceRow;
use delays::Delays;
use packets::Packets;

/// The files of the forces, which a record without the slave's ticks does not have.
pub const FORCES: [&str; 2] = ["forces.csv", "forces.svg"];

/// A record, as far as it was handed over.
#[derive(Default)]
pub struct RecordReport {
    began: Option<Stamp>,
    trace: Vec<TraceRow>,
    force: ForceMetrics,
    updates: UpdateCounts,
    loops: [LoopTimes; 2],
    packets: Packets,
    delays: Delays,
}

/// How a loop kept its time.
#[derive(Clone, Debug, Default)]
struct LoopTimes {
    ticks: u64,
    skipped: u64,
    lateness: Histogram,
}

impl LoopTimes {
    fn push(&mut self, skipped: u64, lateness_ns: u64) {
        self.ticks += 1;
        // a record of somebody else's has any number
        self.skipped = self.skipped.saturating_add(skipped);
        self.lateness
            .record(std::time::Duration::from_nanos(lateness_ns));
    }
}

/// What a report has: tables for people and files, and the figures.
pub struct Findings {
    /// The run as a whole, for people only.
    pub summary: Table,
    /// Tables with the name of their files.
    pub tables: Vec<(&'static str, Table)>,
    /// The rows behind the figure of the forces, with the name of their file.
    pub forces: Option<(&'static str, Table)>,
    /// Figures with the name of their files.
    pub figures: Vec<(&'static str, Figure)>,
}

impl RecordReport {
    /// Takes the next message of a record.
    ///
    /// # Errors
    /// It is broken.
    pub fn take(&mut self, topic: &str, message: &[u8]) -> Result<(), CdrError> {
        match topic {
            "/master/ticks" => self.master_tick(&MasterTick::read(message)?),
            "/slave/ticks" => self.slave_tick(&SlaveTick::read(message)?),
            "/master/packets" | "/slave/packets" => {
                let packet = Packet::read(message)?;
                let t_s = self.seconds(packet.stamp);
                self.packets.take(t_s, packet);
            }
            "/master/arrivals" => {
                let arrival = Arrival::read(message)?;
                self.delays.arrival(Side::Slave, &arrival);
            }
            "/slave/arrivals" => {
                let arrival = Arrival::read(message)?;
                self.delays.arrival(Side::Master, &arrival);
            }
            _ => {}
        }
        Ok(())
    }

    /// Time since the first message that has one, s.
    fn seconds(&mut self, stamp: Stamp) -> f64 {
        let began = *self.began.get_or_insert(stamp);
        (stamp.0 as i128 - began.0 as i128) as f64 * 1e-9
    }

    fn master_tick(&mut self, tick: &MasterTick) {
        self.seconds(tick.stamp);
        let [master, _] = &mut self.loops;
        master.push(tick.skipped, tick.lateness_ns);
    }

    fn slave_tick(&mut self, tick: &SlaveTick) {
        let t_s = self.seconds(tick.stamp);
        let [_, slave] = &mut self.loops;
        slave.push(tick.skipped, tick.lateness_ns);
        if !tick.plays {
            return;
        }
        let f_s = Vec2::new(tick.f_s_x_n, tick.f_s_y_n);
        let f_m = Vec2::new(tick.f_m_x_n, tick.f_m_y_n);
        let f_m = Some(f_m).filter(|f_m| f_m.x.is_finite());
        let update = Cause::ALL.into_iter().find(|of| of.name() == tick.update);
        if let Some(f_m) = f_m {
            self.force.push(f_s, f_m);
        }
        self.updates.tick(tick.in_contact);
        if let Some(cause) = update {
            self.updates.sent(cause);
        }
        self.trace.push(TraceRow {
            t_s,
            f_s,
            f_m,
            update,
        });
    }

    /// Its tables and figures.
    #[must_use]
    pub fn findings(&self, title: &str) -> Findings {
        let matched = self.packets.matched();
        let mut tables = vec![("packets.csv", matched.table())];
        let mut figures = Vec::new();
        let mut rows = None;
        if !self.trace.is_empty() {
            rows = Some((FORCES[0], forces::forces(&self.trace)));
            figures.push((FORCES[1], forces::figure(title, &self.trace)));
        }
        figures.push(("packets.svg", matched.figure()));
        let delays = self.delays.with(&matched);
        tables.push(("delays.csv", delays.table()));
        figures.push(("delays.svg", delays.figure()));
        tables.push(("loops.csv", self.loops()));
        Findings {
            summary: self.summary(title),
            tables,
            forces: rows,
            figures,
        }
    }

    #[rustfmt::skip]
    fn summary(&self, title: &str) -> Table {
        Table::of(
            title,
            [self],
            &[
                column("slave_s", "s", 1, |of| of.updates.duration_s()),
                column("contact_s", "s", 1, |of| of.updates.contact_s()),
                column("updates", "", 0, |of| of.updates.total()),
                column("contact_updates_per_s", "Hz", 1, |of| of.updates.contact_rate_hz()),
                column("pmse", "", 4, |of| of.force.summary().pmse),
                column("relative_error", "", 3, |of| of.force.summary().relative_error),
                column("error_rms_n", "N", 3, |of| of.force.summary().error_rms_n),
            ],
        )
    }

    #[rustfmt::skip]
    fn loops(&self) -> Table {
        let micros = |of: std::time::Duration| of.as_secs_f64() * 1e6;
        let rows: Vec<_> = ["master", "slave"].into_iter().zip(&self.loops).collect();
        let quantile = |key, q: f64| {
            Column::new(key, "us", 1, move |(_, of): &(&str, &LoopTimes)| of.lateness.quantile(q).map(micros).into())
        };
        Table::of(
            "1 kHz loops",
            rows.iter().filter(|(_, of)| of.ticks > 0),
            &[
                column("side", "", 0, |(side, _): &(&str, &LoopTimes)| *side),
                column("ticks", "", 0, |(_, of): &(&str, &LoopTimes)| of.ticks),
                column("skipped", "", 0, |(_, of): &(&str, &LoopTimes)| of.skipped),
                quantile("lateness_p50_us", 0.5),
                quantile("lateness_p99_us", 0.99),
                quantile("lateness_p999_us", 0.999),
            ],
        )
    }
}

#[cfg(test)]
mod tests;
