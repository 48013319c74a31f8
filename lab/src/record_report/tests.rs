//! What the record of one end shows of a run, and what those of both show together.

use super::*;
use crate::table::Cell;

fn packet(fate: &str, number: u32, at_ms: u64) -> Packet {
    Packet {
        stamp: Stamp(1_000_000_000 + at_ms * 1_000_000),
        session: 1,
        direction: "down".to_owned(),
        number,
        sent_ns: u64::from(number),
        bytes: 100,
        kind: "update".to_owned(),
        update: number,
        cause: "timer".to_owned(),
        fate: fate.to_owned(),
    }
}

fn bytes(message: &impl Message) -> Vec<u8> {
    let mut out = mmt_shared::record::cdr::CdrWriter::default();
    message.write(out.begin());
    out.message().to_vec()
}

fn table(findings: &Findings, name: &str) -> Vec<Vec<Cell>> {
    let found = findings.tables.iter().find(|(of, _)| *of == name);
    let rows = found.unwrap().1.rows().map(<[Cell]>::to_vec);
    rows.collect()
}

#[test]
fn what_left_and_never_arrived_is_lost_and_what_did_has_a_delay() {
    let mut report = RecordReport::default();
    for number in 1..=4 {
        let sent = packet("sent", number, 10 * u64::from(number));
        report.take("/slave/packets", &bytes(&sent)).unwrap();
    }
    let half = report.findings("half");
    let rows = table(&half, "packets.csv");
    assert_eq!(rows[0][2], Cell::Count(4));
    assert_eq!(rows[0][4], Cell::Absent, "one end alone knows no loss");
    assert!(table(&half, "delays.csv").is_empty());
    for number in [1, 2, 4] {
        let arrived = packet("newest", number, 10 * u64::from(number) + 7);
        report.take("/master/packets", &bytes(&arrived)).unwrap();
    }
    let whole = report.findings("whole");
    let rows = table(&whole, "packets.csv");
    assert_eq!(rows[0][1], Cell::Text("update:timer".to_owned()));
    assert_eq!(
        (&rows[0][4], &rows[0][5]),
        (&Cell::Count(1), &Cell::Count(3))
    );
    let delays = table(&whole, "delays.csv");
    assert_eq!((delays.len(), &delays[0][1]), (1, &Cell::Count(3)));
    let Cell::Number(median) = delays[0][2] else {
        panic!("no delay");
    };
    assert!((median - 7.0).abs() < 1e-6, "{median}");
    for (name, figure) in &whole.figures {
        assert!(figure.draw().unwrap().contains("<svg"), "{name}");
    }
}
