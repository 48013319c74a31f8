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

/// The topics of flat messages, each with `$of` of the type that it has.
macro_rules! flat {
    ($of:ident) => {
        [
            ("/master/ticks", $of::<MasterTick> as fn(&[u8]) -> _),
            ("/master/readings", $of::<Reading>),
            ("/slave/ticks", $of::<SlaveTick>),
            ("/master/session", $of::<Session>),
            ("/slave/session", $of::<Session>),
            ("/master/arrivals", $of::<Arrival>),
            ("/slave/arrivals", $of::<Arrival>),
            ("/master/packets", $of::<Packet>),
            ("/slave/packets", $of::<Packet>),
            ("/master/parameters", $of::<Parameters>),
            ("/slave/parameters", $of::<Parameters>),
            ("/master/link", $of::<Link>),
            ("/slave/link", $of::<Link>),
            ("/master/loop", $of::<Loop>),
            ("/slave/loop", $of::<Loop>),
        ]
    };
}

/// The topics of flat messages.
pub fn topics() -> impl Iterator<Item = &'static str> {
    flat!(row_of).into_iter().map(|(topic, _)| topic)
}

/// The row of a message; none of a topic that has no flat messages.
pub fn row(topic: &str, message: &[u8]) -> Option<Result<Row, CdrError>> {
    let of = flat!(row_of).into_iter().find(|(of, _)| *of == topic);
    of.map(|(_, row)| row(message))
}

/// The values of a message below the names of its fields; none of a topic that has no flat messages.
pub fn values(topic: &str, message: &[u8]) -> Option<Result<Named, CdrError>> {
    let of = flat!(values_of).into_iter().find(|(of, _)| *of == topic);
    of.map(|(_, values)| values(message))
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
