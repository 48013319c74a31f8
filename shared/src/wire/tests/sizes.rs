//! How long messages are.

use super::*;

#[test]
fn no_buffer_is_too_short_without_an_error() {
    let (envelope, message) = (ENVELOPE, messages()[0]);
    for length in 0..datagram(envelope, message).len() {
        let encoded = Datagram {
            flags: Flags::default(),
            envelope,
            message,
        }
        .encode(&mut vec![0; length]);
        assert!(matches!(encoded, Err(EncodeError::BufferTooSmall { .. })));
    }
    for message in stream_messages() {
        for length in 0..on_stream(&message).len() {
            let encoded = message.encode(&mut vec![0; length]);
            assert!(matches!(encoded, Err(EncodeError::BufferTooSmall { .. })));
        }
    }
}

#[test]
fn the_longest_messages_fit() {
    let wide = i32::MAX;
    let samples = block((0..SAMPLES_MAX as u64).map(|k| {
        let stamp =
            Time::from_nanos(u64::MAX - (SAMPLES_MAX as u64 - k) * u64::from(u32::MAX) * 1_000_000);
        let count = if k % 2 == 0 { wide } else { -wide };
        HipSample {
            stamp,
            hip: HipCounts { x: count, y: count },
            force: ForceCounts { x: count, y: count },
        }
    }));
    let echo = Some(Echo {
        number: u32::MAX,
        sent: Time::MAX,
        held_ns: u64::MAX,
        received: u32::MAX,
    });
    let envelope = Envelope {
        number: u32::MAX,
        sent: Time::MAX,
        echo,
    };
    let command = Command {
        newest_update: u32::MAX,
        samples,
        port: None,
    };
    let bytes = datagram(envelope, Message::Command(command));
    // 8 header, 46 envelope, 5 newest update, 1 length, 30 the first sample, 25 each other, 1 no port
    assert_eq!(bytes.len(), 8 + 46 + 5 + 1 + 30 + 31 * 25 + 1);
    let port = Some(HandPort::default());
    let longest = datagram(envelope, Message::Command(Command { port, ..command }));
    // E_in
    assert_eq!(longest.len(), bytes.len() + 8);
    assert!(longest.len() <= DATAGRAM_MAX);
    assert!(reads_only_what_it_writes(&longest, Side::Master));
    let report = [b' '; STREAM_MESSAGE_MAX - 8 - 1 - 2];
    let report = &report[..];
    let farewell = StreamMessage::Farewell(Farewell { report, ..FAREWELL });
    assert_eq!(on_stream(&farewell).len(), STREAM_MESSAGE_MAX);
}

#[test]
fn ten_samples_of_a_push_take_116_bytes_in_all_and_126_with_a_strong_tremor() {
    let echo = Some(Echo {
        number: 300,
        sent: Time::from_millis(29_900),
        held_ns: 31_000_000,
        received: 297,
    });
    let envelope = Envelope {
        number: 3000,
        sent: Time::from_millis(30_009),
        echo,
    };
    let length = |tremor| {
        let command = Command {
            newest_update: 250,
            samples: push_samples(10, tremor),
            port: None,
        };
        datagram(envelope, Message::Command(command)).len()
    };
    // a hand without and with a strong tremor
    let (smooth, shaking) = (length(0.0), length(5e-4));
    assert!(smooth <= 116, "{smooth} bytes");
    assert!(smooth < shaking && shaking <= 126, "{shaking} bytes");
    println!("{smooth} bytes smooth, {shaking} bytes shaking");
}
