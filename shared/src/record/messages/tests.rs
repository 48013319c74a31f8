//! What flat messages promise.

use super::*;

fn link() -> Link {
    Link {
        stamp: Stamp(1_700_000_000_000_000_007),
        session: 1,
        rtt_ms: f64::from_bits(0x3fb9_9999_9999_999a),
        up_expected: 2,
        up_received: 1,
        down_expected: 4,
        down_received: 3,
    }
}

#[test]
fn a_message_reads_back_to_the_same_bits_and_a_shorter_one_is_refused() {
    let mut out = CdrWriter::default();
    link().write(out.begin());
    assert_eq!(Link::read(out.message()), Ok(link()));
    let short = out.message().len() - 1;
    let short = out.message().get(..short).unwrap();
    assert!(matches!(Link::read(short), Err(CdrError::Short { .. })));
}

#[test]
fn a_schema_has_a_line_a_field_and_the_time_that_it_uses() {
    let text = schema::<Link>();
    assert!(text.starts_with("builtin_interfaces/Time stamp\nuint32 session\nfloat64 rtt_ms\n"));
    assert!(text.ends_with(TIME), "{text}");
    assert_eq!(Link::NAME, "mmt_msgs/msg/Link");
    assert_eq!(link().cells().len(), Link::FIELDS.len());
}
