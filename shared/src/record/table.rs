//! The flat messages of a record as tables: one a topic, a row a message.

use super::cdr::CdrError;
use super::messages::{
    Arrival, Link, Loop, MasterTick, Message, Packet, Parameters, Reading, Session, SlaveTick,
};

/// A row of a table of comma-separated values.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Row {
    /// Names of the columns.
    pub columns: Vec<&'static str>,
    /// The cells; empty where nothing is known.
    pub cells: Vec<String>,
}

/// The row of a message; none of a topic that has no flat messages.
pub fn row(topic: &str, message: &[u8]) -> Option<Result<Row, CdrError>> {
    let (side, what) = topic.strip_prefix('/')?.split_once('/')?;
    Some(match (side, what) {
        ("master", "ticks") => of::<MasterTick>(message),
        ("master", "readings") => of::<Reading>(message),
        ("slave", "ticks") => of::<SlaveTick>(message),
        ("master" | "slave", "session") => of::<Session>(message),
        ("master" | "slave", "arrivals") => of::<Arrival>(message),
        ("master" | "slave", "packets") => of::<Packet>(message),
        ("master" | "slave", "parameters") => of::<Parameters>(message),
        ("master" | "slave", "link") => of::<Link>(message),
        ("master" | "slave", "loop") => of::<Loop>(message),
        _ => return None,
    })
}

fn of<M: Message>(message: &[u8]) -> Result<Row, CdrError> {
    Ok(Row {
        columns: M::FIELDS.iter().map(|(name, _)| *name).collect(),
        cells: M::read(message)?.cells(),
    })
}
