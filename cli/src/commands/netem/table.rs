//! The counters of a relay as a table.

use std::fmt;

use mmt_netem::counters::Tally;
use mmt_netem::io::driver::DirectionCounters;

use super::document::NetemReport;
use super::start::DEGRADED;

/// What a row counts in a direction.
pub(super) type Count = fn(&DirectionCounters) -> Tally;

/// The rows; those below the first two are left out while they are zero.
pub(super) const ROWS: [(&str, Count); 16] = [
    ("offered", |direction| direction.link.offered),
    ("sent on", |direction| direction.sent),
    ("lost on the link", |direction| direction.link.dropped.loss),
    ("lost in an outage", |direction| {
        direction.link.dropped.outage
    }),
    ("too large", |direction| direction.link.dropped.mtu),
    ("queue full", |direction| direction.link.dropped.queue),
    ("dropped by CoDel", |direction| direction.link.dropped.codel),
    ("copies made", |direction| direction.link.duplicated),
    ("corrupted", |direction| direction.link.corrupted),
    ("marked (ECN)", |direction| direction.link.marked),
    ("over the limit", |direction| direction.link.dropped.limit),
    ("socket full", |direction| direction.blocked),
    ("socket error", |direction| direction.failed),
    ("client forgotten", |direction| direction.abandoned),
    ("cross, sent", |direction| direction.link.cross.sent),
    ("cross, dropped", |direction| direction.link.cross.dropped),
];
/// Rows that are always there.
pub(super) const ALWAYS: usize = 2;

impl fmt::Display for NetemReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let counters = &self.counters;
        writeln!(
            f,
            "mmt {} {}, seed {}, {:.1} s, {}",
            self.command, self.version, self.seed, self.duration_s, self.ending
        )?;
        writeln!(
            f,
            "\n{:20} {:>12} {:>12} {:>12} {:>12}",
            "", "up", "bytes", "down", "bytes"
        )?;
        for (number, (label, count)) in ROWS.into_iter().enumerate() {
            let (up, down) = (count(&counters.up), count(&counters.down));
            if number < ALWAYS || up.packets > 0 || down.packets > 0 {
                writeln!(
                    f,
                    "{label:20} {:>12} {:>12} {:>12} {:>12}",
                    up.packets, up.bytes, down.packets, down.bytes
                )?;
            }
        }
        self.rest(f)
    }
}

impl NetemReport {
    fn rest(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let counters = &self.counters;
        let (up, down) = (counters.up.in_flight, counters.down.in_flight);
        if up > 0 || down > 0 {
            writeln!(f, "{:20} {up:>12} {:>12} {down:>12}", "in flight", "")?;
        }
        writeln!(f, "\nclients met          {:>12}", counters.clients_met)?;
        for (label, count) in [
            ("clients displaced", counters.clients_displaced),
            ("refused", counters.refused.packets),
            ("not read in time, up", counters.overflows_up),
            ("not read in time, down", counters.overflows_down),
            ("target unreachable", counters.unreachable),
            ("receive errors", counters.receive_errors),
            ("new ports (NAT)", counters.rebinds),
            ("not on record", counters.unrecorded),
            ("not captured", counters.uncaptured),
        ] {
            if count > 0 {
                writeln!(f, "{label:20} {count:>12}")?;
            }
        }
        let late = &counters.lateness;
        write!(
            f,
            "released late        p50 {:.0} us, p99 {:.0} us, max {:.0} us",
            late.p50_us, late.p99_us, late.max_us
        )?;
        if self.refused_clients {
            write!(
                f,
                "\nmasters were turned away: --clients sets how many there can be"
            )?;
        }
        if self.displaced_clients {
            write!(
                f,
                "\nmasters that did not talk with the slave made room for newer ones: --clients sets how many there can be"
            )?;
        }
        if late.degraded() {
            write!(f, "\n{DEGRADED}")?;
        }
        Ok(())
    }
}
