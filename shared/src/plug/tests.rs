//! The head to the byte, and who is let in.

use super::*;

const TOKEN: PlugToken = PlugToken::new([0xab; 16]);

fn head() -> PlugHead {
    PlugHead {
        flags: 0x0102,
        sequence: 0x0304_0506,
        answers: 0x0708_090a,
        stamp_ns: 0x0b0c_0d0e_0f10_1112,
    }
}

fn packet() -> [u8; DEVICE_BYTES] {
    let numbers = [1.0_f32, -2.0, 3.5, 0.0, 0.25, -0.5].map(f32::to_le_bytes);
    encode(PlugKind::Reading, &TOKEN, &head(), numbers)
}

fn read(packet: &[u8]) -> Result<(PlugHead, &[u8]), NotTaken> {
    decode(PlugKind::Reading, DEVICE_BYTES, &TOKEN, packet)
}

#[test]
fn a_packet_is_what_the_document_states_to_the_byte() {
    let packet = packet();
    assert_eq!(&packet[..8], b"MMTL\x01\x01\x02\x01");
    assert_eq!(packet[8..12], [6, 5, 4, 3]);
    assert_eq!(packet[12..16], [10, 9, 8, 7]);
    let stamp = [0x12, 0x11, 0x10, 0x0f, 0x0e, 0x0d, 0x0c, 0x0b];
    assert_eq!(packet[16..24], stamp);
    assert_eq!(packet[24..40], [0xab; 16]);
    assert_eq!(packet[40..44], 1.0_f32.to_le_bytes());
    let (found, numbers) = read(&packet).unwrap();
    assert_eq!(found, head());
    assert_eq!(singles(numbers), [1.0, -2.0, 3.5, 0.0, 0.25, -0.5]);
}

#[test]
fn any_other_length_magic_version_kind_or_token_is_not_taken() {
    let good = packet();
    for length in 0..DEVICE_BYTES {
        assert_eq!(read(&good[..length]), Err(NotTaken::Malformed));
    }
    let longer = [&good[..], &[0]].concat();
    assert_eq!(read(&longer), Err(NotTaken::Malformed));
    for byte in 0..HEAD_BYTES {
        let mut other = good;
        other[byte] ^= 0x40;
        let expected = match byte {
            0..=5 => Err(NotTaken::Malformed),
            24.. => Err(NotTaken::Stranger),
            _ => Ok(()),
        };
        assert_eq!(read(&other).map(|_| ()), expected, "byte {byte}");
    }
}

#[test]
fn a_token_is_read_back_and_not_shown() {
    let text = TOKEN.reveal().to_string();
    assert_eq!(text.parse(), Ok(TOKEN));
    assert!(!format!("{TOKEN:?}").contains("ab"));
    assert_eq!("ab".parse::<PlugToken>(), Err(NoToken));
}

#[test]
fn one_is_plugged_in_at_a_time_until_it_is_silent_and_what_is_missing_is_counted() {
    let (one, two) = ([127, 0, 0, 1], 7000);
    let (one, two) = (
        SocketAddr::from((one, two)),
        SocketAddr::from((one, two + 1)),
    );
    let ms = |n: u64| Time::from_nanos(n * 1_000_000);
    let mut peer = PlugPeer::new(Duration::from_millis(40));
    assert!(!peer.is_plugged_in(ms(0)));
    assert_eq!(peer.admit(ms(0), one, u32::MAX - 1), Some(Admitted::First));
    assert_eq!(
        peer.admit(ms(1), one, 2),
        Some(Admitted::Next),
        "it goes round"
    );
    assert_eq!(peer.admit(ms(2), one, 2), None);
    assert_eq!(peer.admit(ms(2), one, u32::MAX), None);
    assert_eq!(peer.admit(ms(40), two, 1), None, "the first is still there");
    assert_eq!(peer.admit(ms(41), two, 1), Some(Admitted::First));
    assert_eq!(peer.admit(ms(42), one, 3), None);
    assert!(peer.is_plugged_in(ms(80)) && !peer.is_plugged_in(ms(81)));
    let expected = PlugCounts {
        taken: 3,
        lost: 3,
        late: 2,
        second: 2,
        ..PlugCounts::default()
    };
    assert_eq!(peer.counts, expected);
}
