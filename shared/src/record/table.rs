//! The flat messages of a record as tables: one a topic, a row a message.

use super::cdr::CdrError;
use super::messages::{
    Arrival, Link, Loop, MasterTick, Message, Packet, Parameters, Reading, Session, SlaveTick,
    Value,
};

/// A row of a table of comma-separated values.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Row {
    /// Names of the columns.
    pub columns: Vec<&'static str>,
    /// The cells; empty where nothing is known.
    pub cells: Vec<String>,
}

/// What `$of` makes of a message of whichever type its topic has; none of a topic that has no flat messages.
macro_rules! by_topic {
    ($topic:expr, $message:expr, $of:ident) => {{
        let (side, what) = $topic.strip_prefix('/')?.split_once('/')?;
        Some(match (side, what) {
            ("master", "ticks") => $of::<MasterTick>($message),
            ("master", "readings") => $of::<Reading>($message),
            ("slave", "ticks") => $of::<SlaveTick>($message),
            ("master" | "slave", "session") => $of::<Session>($message),
            ("master" | "slave", "arrivals") => $of::<Arrival>($message),
            ("master" | "slave", "packets") => $of::<Packet>($message),
            ("master" | "slave", "parameters") => $of::<Parameters>($message),
            ("master" | "slave", "link") => $of::<Link>($message),
            ("master" | "slave", "loop") => $of::<Loop>($message),
            _ => return None,
        })
    }};
}

/// The row of a message; none of a topic that has no flat messages.
pub fn row(topic: &str, message: &[u8]) -> Option<Result<Row, CdrError>> {
    by_topic!(topic, message, row_of)
}

/// The values of a message below the names of its fields; none of a topic that has no flat messages.
pub fn values(topic: &str, message: &[u8]) -> Option<Result<Named, CdrError>> {
    by_topic!(topic, message, values_of)
}

/// Names and values of the fields of a message.
pub type Named = Vec<(&'static str, Value)>;

fn names<M: Message>() -> impl Iterator<Item = &'static str> {
    M::FIELDS.iter().map(|(name, _)| *name)
}

fn row_of<M: Message>(message: &[u8]) -> Result<Row, CdrError> {
    Ok(Row {
        columns: names::<M>().collect(),
        cells: M::read(message)?.cells(),
    })
}

fn values_of<M: Message>(message: &[u8]) -> Result<Named, CdrError> {
    Ok(names::<M>().zip(M::read(message)?.values()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::cdr::CdrWriter;
    use crate::record::messages::Stamp;

    #[test]
    fn values_have_the_names_and_the_content_of_the_row() {
        let link = Link {
            stamp: Stamp(1_700_000_000_000_000_007),
            session: 1,
            rtt_ms: f64::NAN,
            up_expected: 2,
            up_received: 1,
            down_expected: 4,
            down_received: 3,
        };
        let mut out = CdrWriter::default();
        link.write(out.begin());
        let row = row("/slave/link", out.message()).unwrap().unwrap();
        let values = values("/slave/link", out.message()).unwrap().unwrap();
        let named = values.iter().map(|(name, _)| *name);
        assert!(named.eq(row.columns));
        assert_eq!(values[0].1, Value::Whole(1_700_000_000_000_000_007));
        assert!(matches!(values[2].1, Value::Number(rtt_ms) if rtt_ms.is_nan()));
        assert_eq!(values[6].1, Value::Whole(3));
        assert_eq!(super::values("/slave/scene", out.message()), None);
        assert!(
            super::values("/slave/ticks", out.message())
                .unwrap()
                .is_err()
        );
    }
}
