//! What came out: a row for each carrier and flow, and the targets with what was measured.

use std::collections::BTreeMap;
use std::fmt;
use std::time::Duration;

use serde::Serialize;

use super::slice::{Sum, Turn};
use super::{BenchConfig, BenchError, Carrier, Cores, Flow};
use crate::table::{Cell, Table};

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

/// The columns: latencies in us; `ratio` is p50 in that of the control; cpu, packets and bytes are for each message
/// that either side sent, over both sides, bytes with IP and UDP headers.
const COLUMNS: [(&str, usize); 12] = [
    ("carrier", 0),
    ("flow", 0),
    ("messages", 0),
    ("lost", 0),
    ("p50_us", 1),
    ("p99_us", 1),
    ("p999_us", 1),
    ("max_us", 1),
    ("ratio", 2),
    ("cpu_us", 1),
    ("packets", 3),
    ("bytes", 1),
];

/// The sums of a run under way.
pub(super) struct Ledger(BTreeMap<(Flow, Carrier), Sum>);

impl Ledger {
    pub(super) fn try_new() -> Result<Self, BenchError> {
        let mut sums = BTreeMap::new();
        for flow in Flow::ALL {
            for carrier in Carrier::ALL {
                sums.insert((flow, carrier), Sum::try_new()?);
            }
        }
        Ok(Self(sums))
    }

    pub(super) fn add(&mut self, carrier: Carrier, flow: Flow, turn: &Turn) {
        if let Some(sum) = self.0.get_mut(&(flow, carrier)) {
            sum.add(turn);
        }
    }

    pub(super) fn report(&self, config: &BenchConfig, cores: Cores) -> BenchReport {
        let mut rows = Table::new(
            format!(
                "{} messages a second of {} bytes over loopback, {}; cpu, packets and bytes for each message, both sides",
                config.rate_hz,
                config.bytes,
                cores.words()
            ),
            &COLUMNS,
        );
        for ((flow, carrier), sum) in &self.0 {
            let control = self.median_us(Carrier::Control, *flow);
            rows.push(row(*carrier, *flow, sum, control));
        }
        BenchReport {
            rate_hz: config.rate_hz,
            bytes: config.bytes,
            cores: cores.name(),
            rows,
            targets: self.targets(config),
        }
    }

    fn median_us(&self, carrier: Carrier, flow: Flow) -> Option<f64> {
        let took = self.0.get(&(flow, carrier))?.took.quantiles();
        (took.count > 0).then(|| micros(took.p50))
    }

    fn targets(&self, config: &BenchConfig) -> Table {
        let quic = self.median_us(Carrier::Quic, Flow::OneWay);
        let udp = self.median_us(Carrier::RawUdp, Flow::OneWay);
        let ratio = quic.zip(udp).map(|(quic, udp)| quic / udp);
        let own = self.0.get(&(Flow::OneWay, Carrier::Quic));
        let own = own.filter(|_| config.rate_hz == OWN_PACKETS_HZ);
        let own = own.and_then(|sum| per_message(sum.packets as f64, sum).map(|each| each - 1.0));
        let mut targets = Table::new(
            "Targets, which are for a quiet machine",
            &[("target", 0), ("most", 2), ("measured", 2), ("met", 0)],
        );
        for (name, most, measured) in [
            ("p50 one way, quic / udp", RATIO_MAX, ratio),
            ("p50 one way, quic, us", MEDIAN_MAX_US, quic),
            (
                "packets of quic's own for each message at 1000/s",
                OWN_PACKETS_MAX,
                own,
            ),
        ] {
            let met = match measured {
                None => "not measured",
                Some(measured) if measured <= most => "yes",
                Some(_) => "no",
            };
            targets.push([name.into(), most.into(), measured.into(), met.into()]);
        }
        targets
    }
}

fn row(carrier: Carrier, flow: Flow, sum: &Sum, control_us: Option<f64>) -> [Cell; COLUMNS.len()] {
    let took = sum.took.quantiles();
    let us = |duration| Cell::from((took.count > 0).then(|| micros(duration)));
    let ratio = control_us
        .filter(|_| took.count > 0)
        .map(|control| micros(took.p50) / control);
    let bytes = sum.bytes + HEADERS * sum.packets;
    [
        carrier.name().into(),
        flow.name().into(),
        sum.sent.into(),
        sum.sent.saturating_sub(took.count).into(),
        us(took.p50),
        us(took.p99),
        us(took.p999),
        us(took.max),
        ratio.into(),
        per_message(micros(sum.cpu), sum).into(),
        per_message(sum.packets as f64, sum).into(),
        per_message(bytes as f64, sum).into(),
    ]
}

fn per_message(total: f64, sum: &Sum) -> Option<f64> {
    (sum.carried > 0).then(|| total / sum.carried as f64)
}

fn micros(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1e6
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
    fn turn(us: u64, packets: u64) -> Turn {
        let far = Side {
            took: vec![Duration::from_micros(us); 100],
            packets: packets - 100,
            ..Side::new()
        };
        let near = Side {
            sent: 100,
            packets: 100,
            bytes: 13_000,
            cpu: Duration::from_millis(1),
            ..Side::new()
        };
        Turn { near, far }
    }

    fn report(config: &BenchConfig, quic: &Turn) -> BenchReport {
        let mut ledger = Ledger::try_new().unwrap();
        ledger.add(Carrier::Control, Flow::OneWay, &turn(10, 100));
        ledger.add(Carrier::RawUdp, Flow::OneWay, &turn(16, 100));
        ledger.add(Carrier::Quic, Flow::OneWay, quic);
        ledger.report(config, Cores::Own)
    }

    fn verdicts(report: &BenchReport) -> Vec<String> {
        let json = serde_json::to_value(report).unwrap();
        let targets = json["targets"].as_array().unwrap();
        let met = targets.iter().map(|row| row["met"].as_str().unwrap());
        met.map(str::to_owned).collect()
    }

    #[test]
    fn a_row_has_quantiles_ratio_and_what_each_message_costs() {
        let json = serde_json::to_value(report(&CONFIG, &turn(30, 110))).unwrap();
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
        assert_eq!(verdicts(&report(&CONFIG, &turn(30, 110))), ["yes"; 3]);
        assert_eq!(
            verdicts(&report(&CONFIG, &turn(36, 120))),
            ["no", "yes", "no"]
        );
        assert_eq!(
            verdicts(&report(&CONFIG, &turn(50, 110))),
            ["no", "no", "yes"]
        );
        // at another rate nothing is promised
        let slower = BenchConfig {
            rate_hz: 100,
            ..CONFIG
        };
        assert_eq!(
            verdicts(&report(&slower, &turn(30, 110)))[2],
            "not measured"
        );
    }

    #[test]
    fn nothing_measured_is_absent_and_no_zero() {
        let empty = Ledger::try_new().unwrap().report(&CONFIG, Cores::Own);
        assert_eq!(verdicts(&empty), ["not measured"; 3]);
        let json = serde_json::to_value(&empty).unwrap();
        assert!(json["rows"][0]["p50_us"].is_null());
        assert!(json["rows"][0]["packets"].is_null());
    }
}
