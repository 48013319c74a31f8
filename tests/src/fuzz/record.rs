//! Records: their messages, their files, and sessions that are run again from them.

use mmt_client::again::MasterAgain;
use mmt_lab::check::RecordChecks;
use mmt_lab::record_report::RecordReport;
use mmt_server::again::SlaveAgain;
use mmt_shared::io::record::{Ended, RecordError, read_from};
use mmt_shared::record::again::EndAgain;
use mmt_shared::record::cdr::{CdrError, CdrWriter};
use mmt_shared::record::messages::{
    Arrival, Link, Loop, MasterTick, Message, Packet, Parameters, Reading, Session, SlaveTick,
    Value,
};
use mmt_shared::record::table;

use super::inputs::{self, TOPICS};
use super::outcome::Outcome;

/// The first byte asks for a topic.
pub(super) fn message(input: &[u8]) -> Outcome {
    let (topic, message) = input.split_first().unwrap_or((&0, &[]));
    let number = usize::from(*topic) % TOPICS.len();
    let topic = TOPICS[number];
    let read = match topic.rsplit('/').next().unwrap_or_default() {
        "ticks" if topic.starts_with("/master") => read_twice::<MasterTick>(message),
        "ticks" => read_twice::<SlaveTick>(message),
        "session" => read_twice::<Session>(message),
        "arrivals" => read_twice::<Arrival>(message),
        "packets" => read_twice::<Packet>(message),
        "parameters" => read_twice::<Parameters>(message),
        "link" => read_twice::<Link>(message),
        "loop" => read_twice::<Loop>(message),
        _ => read_twice::<Reading>(message),
    };
    let row = table::row(topic, message).unwrap();
    let values = table::values(topic, message).unwrap();
    assert_eq!((row.is_ok(), values.is_ok()), (read.is_ok(), read.is_ok()));
    if let (Ok(row), Ok(values)) = (row, values) {
        assert_eq!(row.columns.len(), row.cells.len());
        assert_eq!(values.len(), row.columns.len());
        for (value, cell) in values.iter().zip(&row.cells) {
            let length = match &value.1 {
                Value::Bytes(bytes) => bytes.len(),
                Value::Text(text) => text.len(),
                _ => 0,
            };
            assert!(length <= message.len() && cell.len() <= 2 * message.len() + 4000);
        }
    }
    match read {
        Ok(()) => Outcome::taken(number as u64),
        Err(why) => Outcome::refused(&format_args!("{topic}: {why}")),
    }
}

/// What is read and written reads as the same bytes from then on.
fn read_twice<M: Message>(message: &[u8]) -> Result<(), CdrError> {
    let read = M::read(message)?;
    let (mut once, mut twice) = (CdrWriter::default(), CdrWriter::default());
    read.write(once.begin());
    let again = M::read(once.message()).unwrap();
    again.write(twice.begin());
    assert_eq!(once.message(), twice.message());
    assert!(once.message().len() <= message.len() + 8);
    Ok(())
}

/// No chunk of these is longer, bytes; a record's own bound is 64 MiB.
const CHUNK_MAX: usize = 1 << 20;

pub(super) fn file(input: &[u8]) -> Outcome {
    let (mut checks, mut report) = (RecordChecks::default(), RecordReport::default());
    let (mut messages, mut broken) = (0_u64, 0_u64);
    let ended = read_from::<RecordError>(input, CHUNK_MAX, |topic, message| {
        messages += 1;
        let row = table::row(topic, message);
        broken += u64::from(matches!(row, Some(Err(_))));
        broken += u64::from(checks.take(topic, message).is_err());
        broken += u64::from(report.take(topic, message).is_err());
        Ok(())
    });
    assert!(messages <= input.len() as u64);
    let verdict = checks.verdict(true);
    assert!(verdict.to_string().len() < 100_000);
    let findings = report.findings("fuzz");
    assert!(findings.tables.len() < 20);
    match ended {
        Ok(ended) => Outcome::taken(
            messages.min(8) + 16 * broken.min(3) + 64 * u64::from(ended == Ended::Whole),
        ),
        Err(why) => Outcome::refused(&why),
    }
}

/// The ends of a recorded session, whose digests nobody compares: they run as far as the record goes.
#[derive(Default)]
struct Again {
    master: Option<MasterAgain>,
    slave: Option<SlaveAgain>,
}

impl Again {
    fn take(&mut self, topic: &str, message: &[u8]) {
        match topic {
            "/master/session" => {
                self.master = Session::read(message)
                    .ok()
                    .and_then(|session| MasterAgain::try_new(&session).ok());
            }
            "/slave/session" => {
                self.slave = Session::read(message)
                    .ok()
                    .and_then(|session| SlaveAgain::try_new(&session).ok());
            }
            "/master/arrivals" => both(&mut self.master, Arrival::read(message), |end, of| {
                end.arrival(&of)
            }),
            "/slave/arrivals" => both(&mut self.slave, Arrival::read(message), |end, of| {
                end.arrival(&of)
            }),
            "/master/ticks" => both(&mut self.master, MasterTick::read(message), |end, of| {
                end.tick(&of);
                let force = end.done().unwrap().hand_force;
                assert!(
                    force.x.is_finite() && force.y.is_finite() && force.norm() <= 50.0 + 1e-9,
                    "{force:?}"
                );
                assert!(end.left().count() <= 8);
            }),
            "/slave/ticks" => both(&mut self.slave, SlaveTick::read(message), |end, of| {
                end.tick(&of);
                let tool = end.done().map(|done| done.tool + done.f_s);
                assert!(
                    tool.is_none_or(|tool| tool.x.is_finite() && tool.y.is_finite()),
                    "{tool:?}"
                );
                assert!(end.left().count() <= 8);
            }),
            _ => {}
        }
    }
}

fn both<E, M>(end: &mut Option<E>, message: Result<M, CdrError>, work: impl FnOnce(&mut E, M)) {
    if let (Some(end), Ok(message)) = (end, message) {
        work(end, message);
    }
}

/// Messages one behind the other, each with its topic's number and its length in two bytes in front.
pub(super) fn session(input: &[u8]) -> Outcome {
    let (mut checks, mut report) = (RecordChecks::default(), RecordReport::default());
    let (mut again, mut taken) = (Again::default(), 0);
    let (mut reason, mut broken) = (None, 0_u64);
    for (topic, message) in inputs::messages_of(input) {
        again.take(topic, message);
        // a report knows no order of messages
        broken += u64::from(report.take(topic, message).is_err());
        match checks.take(topic, message) {
            Ok(()) => taken += 1,
            Err(why) => {
                assert!(why.to_string().len() < 20_000);
                reason.get_or_insert(why.to_string());
            }
        }
    }
    let verdict = checks.verdict(true);
    assert!(verdict.to_string().len() < 100_000);
    assert!(report.findings("fuzz").tables.len() < 20);
    match reason {
        Some(why) if taken == 0 => Outcome::refused(&why),
        _ => Outcome::taken(taken.min(63) + 64 * broken.min(3)),
    }
}
