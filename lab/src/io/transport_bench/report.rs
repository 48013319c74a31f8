//! What came out: a row for each carrier and flow, and the targets with what was measured.

use std::collections::BTreeMap;
use std::fmt;
use std::time::Duration;

use mmt_shared::stats::histogram::{Histogram, Quantiles};
use serde::Serialize;

use super::config::{BenchConfig, Carrier, Cores};
use super::slice::{Flow, SliceResult};
use crate::table::{Column, Table, column};

/// IPv4 and UDP headers, bytes (RFC 791, RFC 768).
const HEADERS: u64 = 28;
/// QUIC's median one way at most, in those of raw UDP.
const RATIO_MAX: f64 = 2.0;
/// QUIC's median one way at most, us.
const MEDIAN_MAX_US: f64 = 40.0;
/// Packets of QUIC's own for each message at most, at the rate of [`OWN_PACKETS_HZ`].
const OWN_PACKETS_MAX: f64 = 0.15;
/// The rate for which that is promised, messages a second.
const OWN_PACKETS_HZ: u32 = 1000;

/// All slices of a carrier in a flow.
#[derive(Debug, Default)]
struct Summary {
    /// Messages that set out.
    messages: u64,
    /// Messages that were sent by either side: an answer is one.
    sent: u64,
    took: Histogram,
    cpu: Duration,
    packets: u64,
    bytes: u64,
}

impl Summary {
    fn add(&mut self, result: &SliceResult) {
        self.messages += result.near.sent;
        for side in [&result.near, &result.far] {
            self.sent += side.sent;
            side.took.iter().for_each(|took| self.took.record(*took));
            self.cpu += side.cpu;
            self.packets += side.packets;
            self.bytes += side.bytes;
        }
    }

    fn median_us(&self) -> Option<f64> {
        self.took.quantile(0.5).map(micros)
    }

    /// A total for each message that either side sent.
    fn per_message(&self, total: f64) -> Option<f64> {
        (self.sent > 0).then(|| total / self.sent as f64)
    }
}

/// A row of the table.
struct Row<'a> {
    carrier: Carrier,
    flow: Flow,
    summary: &'a Summary,
    /// The median of the control in the same flow, us.
    control_us: Option<f64>,
}

impl Row<'_> {
    fn took_us(&self, of: fn(&Quantiles) -> Duration) -> Option<f64> {
        let took = self.summary.took.quantiles();
        (took.count > 0).then(|| micros(of(&took)))
    }

    fn per_message(&self, of: fn(&Summary) -> f64) -> Option<f64> {
        self.summary.per_message(of(self.summary))
    }
}

/// The columns: latencies in us; `ratio` is p50 in that of the control; cpu, packets and bytes are for each message
/// that either side sent, over both sides, bytes with IP and UDP headers.
#[rustfmt::skip]
fn columns<'a>() -> [Column<'a, Row<'a>>; 12] {
    [
        column("carrier", "", 0, |row| row.carrier.name()),
        column("flow", "", 0, |row| row.flow.name()),
        column("messages", "", 0, |row| row.summary.messages),
        column("lost", "", 0, |row| row.summary.messages.saturating_sub(row.summary.took.quantiles().count)),
        column("p50_us", "us", 1, |row| row.took_us(|took| took.p50)),
        column("p99_us", "us", 1, |row| row.took_us(|took| took.p99)),
        column("p999_us", "us", 1, |row| row.took_us(|took| took.p999)),
        column("max_us", "us", 1, |row| row.took_us(|took| took.max)),
        column("ratio", "", 2, |row| Some(row.summary.median_us()? / row.control_us?)),
        column("cpu_us", "us", 1, |row| row.per_message(|sum| micros(sum.cpu))),
        column("packets", "", 3, |row| row.per_message(|sum| sum.packets as f64)),
        column("bytes", "B", 1, |row| row.per_message(|sum| (sum.bytes + HEADERS * sum.packets) as f64)),
    ]
}

fn micros(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1e6
}

/// A run under way: a summary for each flow and carrier.
#[derive(Debug)]
pub(super) struct Summaries(BTreeMap<(Flow, Carrier), Summary>);

impl Summaries {
    pub(super) fn new() -> Self {
        let all = Flow::ALL.into_iter().flat_map(|flow| {
            let cells = Carrier::ALL.into_iter().map(move |carrier| (flow, carrier));
            cells.map(|cell| (cell, Summary::default()))
        });
        Self(all.collect())
    }

    pub(super) fn add(&mut self, carrier: Carrier, flow: Flow, result: &SliceResult) {
        self.0.entry((flow, carrier)).or_default().add(result);
    }

    pub(super) fn report(&self, config: &BenchConfig, cores: Cores) -> BenchReport {
        let title = format!(
            "{} messages a second of {} bytes over loopback, {}; cpu, packets and bytes for each message, both sides",
            config.rate_hz,
            config.bytes,
            cores.words()
        );
        let rows = self.0.iter().map(|((flow, carrier), summary)| Row {
            carrier: *carrier,
            flow: *flow,
            summary,
            control_us: self.median_us(Carrier::Control, *flow),
        });
        let rows = Table::of(title, &rows.collect::<Vec<_>>(), &columns());
        BenchReport {
            rate_hz: config.rate_hz,
            bytes: config.bytes,
            cores: cores.name(),
            rows,
            targets: self.targets(config),
        }
    }

    fn median_us(&self, carrier: Carrier, flow: Flow) -> Option<f64> {
        self.0.get(&(flow, carrier))?.median_us()
    }

    fn targets(&self, config: &BenchConfig) -> Table {
        let quic = self.median_us(Carrier::Quic, Flow::OneWay);
        let udp = self.median_us(Carrier::RawUdp, Flow::OneWay);
        let ratio = quic.zip(udp).map(|(quic, udp)| quic / udp);
        let promised = config.rate_hz == OWN_PACKETS_HZ;
        let own = self.0.get(&(Flow::OneWay, Carrier::Quic));
        let own = own.filter(|_| promised).and_then(|summary| {
            let packets = summary.per_message(summary.packets as f64);
            packets.map(|packets| packets - 1.0)
        });
        let targets = [
            ("p50 one way, quic / udp", RATIO_MAX, ratio),
            ("p50 one way, quic, us", MEDIAN_MAX_US, quic),
            (
                "packets of quic's own for each message at 1000/s",
                OWN_PACKETS_MAX,
                own,
            ),
        ];
        Table::of(
            "Targets, which are for a quiet machine",
            &targets,
            &[
                column("target", "", 0, |(name, _, _)| *name),
                column("most", "", 2, |(_, most, _)| *most),
                column("measured", "", 2, |(_, _, measured)| *measured),
                column("met", "", 0, |(_, most, measured)| match measured {
                    None => "not measured",
                    Some(measured) if measured <= most => "yes",
                    Some(_) => "no",
                }),
            ],
        )
    }
}

/// What was measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BenchReport {
    /// Messages a second.
    pub rate_hz: u32,
    /// Bytes of a message.
    pub bytes: usize,
    /// Where the two ends ran: the name of [`Cores`].
    pub cores: &'static str,
    /// A row for each carrier and flow.
    pub rows: Table,
    /// The targets.
    pub targets: Table,
}

impl fmt::Display for BenchReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.rows)?;
        write!(f, "{}", self.targets)
    }
}

#[cfg(test)]
mod tests {
    use super::super::slice::Side;
    use super::*;

    const CONFIG: BenchConfig = BenchConfig {
        rate_hz: 1000,
        duration: Duration::from_secs(1),
        bytes: 100,
        cores: Cores::Own,
    };

    /// 100 messages one way, each of which took so long, with so many packets.
    fn result(us: u64, packets: u64) -> SliceResult {
        let far = Side {
            took: vec![Duration::from_micros(us); 100],
            packets: packets - 100,
            ..Side::default()
        };
        let near = Side {
            sent: 100,
            packets: 100,
            bytes: 13_000,
            cpu: Duration::from_millis(1),
            ..Side::default()
        };
        SliceResult { near, far }
    }

    fn report(config: &BenchConfig, quic: &SliceResult) -> BenchReport {
        let mut summaries = Summaries::new();
        summaries.add(Carrier::Control, Flow::OneWay, &result(10, 100));
        summaries.add(Carrier::RawUdp, Flow::OneWay, &result(16, 100));
        summaries.add(Carrier::Quic, Flow::OneWay, quic);
        summaries.report(config, Cores::Own)
    }

    fn verdicts(report: &BenchReport) -> Vec<String> {
        let json = serde_json::to_value(report).unwrap();
        let targets = json["targets"].as_array().unwrap();
        let met = targets.iter().map(|row| row["met"].as_str().unwrap());
        met.map(str::to_owned).collect()
    }

    #[test]
    fn a_row_has_quantiles_ratio_and_what_each_message_costs() {
        let json = serde_json::to_value(report(&CONFIG, &result(30, 110))).unwrap();
        let rows = json["rows"].as_array().unwrap();
        let quic = rows.iter().find(|row| row["carrier"] == "quic").unwrap();
        let near = |key: &str, value: f64| {
            let got = quic[key].as_f64().unwrap();
            assert!((got / value - 1.0).abs() < 0.01, "{key}: {got}");
        };
        near("p50_us", 30.0);
        near("p999_us", 30.0);
        near("ratio", 3.0);
        near("cpu_us", 10.0);
        near("packets", 1.1);
        near("bytes", 130.0 + 28.0 * 1.1);
        assert_eq!((&quic["messages"], &quic["lost"]), (&100.into(), &0.into()));
    }

    #[test]
    fn the_targets_are_judged_by_what_was_measured() {
        assert_eq!(verdicts(&report(&CONFIG, &result(30, 110))), ["yes"; 3]);
        assert_eq!(
            verdicts(&report(&CONFIG, &result(36, 120))),
            ["no", "yes", "no"]
        );
        assert_eq!(
            verdicts(&report(&CONFIG, &result(50, 110))),
            ["no", "no", "yes"]
        );
        // at another rate nothing is promised
        let slower = BenchConfig {
            rate_hz: 100,
            ..CONFIG
        };
        assert_eq!(
            verdicts(&report(&slower, &result(30, 110)))[2],
            "not measured"
        );
    }

    #[test]
    fn nothing_measured_is_absent_and_no_zero() {
        let empty = Summaries::new().report(&CONFIG, Cores::Own);
        assert_eq!(verdicts(&empty), ["not measured"; 3]);
        let json = serde_json::to_value(&empty).unwrap();
        assert!(json["rows"][0]["p50_us"].is_null());
        assert!(json["rows"][0]["packets"].is_null());
    }
}
