//! Captures read back to what was written, and two of one path show what befell the packets between them.

use std::net::SocketAddr;
use std::time::Duration;

use mmt_shared::time::Time;

use super::frame::{Seen, udp};
use super::*;
use crate::direction::Direction;
use crate::packet::DropCause;
use crate::record::{End, Entry, Heading};

const MS: i64 = 1_000_000;

fn address(host: u8, port: u16) -> SocketAddr {
    ([10, 0, 0, host], port).into()
}

fn event(direction: Direction, end: End) -> Event {
    Event {
        entry: Entry {
            direction,
            number: 7,
            offered: Time::from_millis(1000),
            bytes: 5,
            backlog: 0,
            end,
        },
        corrupted_bit: None,
        marked: false,
        sides: Some(Sides {
            came: [address(1, 10), address(2, 20)],
            leaves: [address(2, 21), address(3, 30)],
            class: 0x2a,
        }),
        contents: b"hello".to_vec(),
    }
}

fn sent(copy: bool, corrupted: bool) -> End {
    let due = Time::from_millis(1050);
    let sent = due + Duration::from_micros(20);
    End::Sent {
        due,
        sent,
        copy,
        corrupted,
    }
}

/// A capture of these events.
fn captured(events: Vec<Event>) -> Vec<u8> {
    let writer = Writer::new(Duration::from_secs(1_700_000_000));
    let mut bytes = Writer::heading(&Heading::default());
    for event in events {
        for block in writer.blocks(event) {
            bytes.extend(block.bytes());
        }
    }
    bytes
}

#[test]
fn a_packet_stands_on_both_sides_with_its_fate_and_a_lost_one_where_it_came() {
    let mut corrupted = event(Direction::Down, sent(true, true));
    (corrupted.corrupted_bit, corrupted.marked) = (Some(0), true);
    corrupted.contents = b"iello".to_vec();
    let bytes = captured(vec![
        event(Direction::Up, sent(false, false)),
        event(Direction::Up, End::Dropped(DropCause::Queue)),
        event(Direction::Up, End::Unsent),
        corrupted,
    ]);
    let frames = read(&bytes).unwrap();
    let comments: Vec<&str> = frames.iter().map(|frame| frame.comment).collect();
    let fate = "delayed 50.020000 ms, of that 0.020000 ms by the host";
    assert_eq!(
        comments,
        [
            format!("up 7: {fate}"),
            format!("up 7: {fate}"),
            "up 7: lost (queue)".to_owned(),
            "up 7: not sent (socket)".to_owned(),
            format!("down 7: {fate}, a copy, corrupted (bit 0), marked (ECN)"),
        ]
    );
    let times: Vec<i64> = frames
        .iter()
        .map(|frame| frame.at_ns - 1_700_000_000_000_000_000)
        .collect();
    let (came, left) = (1000 * MS, 1050 * MS + 20_000);
    assert_eq!(times, [left, came, came, came, left]);
    // 20 + 8 bytes of headers; TOS as it came, and marked
    let classes: Vec<u8> = frames.iter().map(|frame| frame.bytes[1]).collect();
    assert_eq!(classes, [0x2a, 0x2a, 0x2a, 0x2a, 0x2b]);
    assert!(
        frames
            .iter()
            .all(|frame| frame.bytes.len() == 33 && frame.link_type == 101)
    );
    assert!(frames[4].bytes.ends_with(b"iello"));
}

#[test]
fn what_came_has_no_bit_turned_over() {
    let mut event = event(Direction::Up, sent(false, true));
    (event.corrupted_bit, event.contents) = (Some(0), b"iello".to_vec());
    let bytes = captured(vec![event]);
    let frames = read(&bytes).unwrap();
    assert!(frames[0].bytes.ends_with(b"iello") && frames[1].bytes.ends_with(b"hello"));
}

#[test]
fn a_capture_cut_off_or_broken_never_panics() {
    let whole = captured(
        (0..3)
            .map(|_| event(Direction::Up, sent(false, false)))
            .collect(),
    );
    assert_eq!(read(&whole).unwrap().len(), 6);
    for end in 0..whole.len() {
        let _ = read(&whole[..end]).map(|frames| assert!(frames.len() < 6));
        let mut broken = whole.clone();
        broken[end] ^= 0xff;
        let frames = read(&broken).unwrap_or_default();
        frames.iter().for_each(|frame| {
            assert!(Seen::of(frame.link_type, frame.bytes).is_none_or(|seen| seen.bytes < 1500))
        });
    }
    assert!(
        read(b"PING")
            .unwrap_err()
            .to_string()
            .contains("neither pcap nor pcapng")
    );
}

/// A classic capture of frames at these times, ns, in big endian.
fn pcap(link_type: u32, frames: &[(i64, Vec<u8>)]) -> Vec<u8> {
    let mut file = Vec::new();
    for word in [0xa1b2_3c4d_u32, 2 << 16 | 4, 0, 0, 65535, link_type] {
        file.extend(word.to_be_bytes());
    }
    for (at, frame) in frames {
        let (s, part) = (at / 1_000_000_000, at % 1_000_000_000);
        for word in [
            s as u32,
            part as u32,
            frame.len() as u32,
            frame.len() as u32,
        ] {
            file.extend(word.to_be_bytes());
        }
        file.extend(frame);
    }
    file
}

fn ethernet(ip: Vec<u8>) -> Vec<u8> {
    [vec![0; 12], vec![8, 0], ip].concat()
}

#[test]
fn times_from_one_end_of_time_to_the_other_are_no_path() {
    let there = udp([address(1, 10), address(2, 20)], 0, b"there");
    let back = udp([address(2, 20), address(1, 10)], 0, b"back");
    let both = |at_ns| {
        [&there, &back].map(|bytes| Frame {
            at_ns,
            link_type: 101,
            bytes,
            comment: "",
        })
    };
    for (from, to) in [(0, i64::MAX), (i64::MAX, 0)] {
        for same_clock in [false, true] {
            let refused = Match { same_clock }.paths(&both(from), &both(to));
            assert!(
                matches!(refused, Err(MatchError::Clocks { .. })),
                "{refused:?}"
            );
        }
    }
}

#[test]
fn a_datagram_is_known_again_behind_a_nat_and_another_link_layer() {
    let contents = b"the same";
    let inside = udp([address(1, 10), address(9, 90)], 0, contents);
    let outside = udp([address(7, 70), address(9, 90)], 0xb8, contents);
    let here = Seen::of(1, &ethernet(inside.clone())).unwrap();
    let there = Seen::of(101, &outside).unwrap();
    assert_eq!(here.identity, there.identity);
    assert_eq!((here.bytes, here.between[0]), (8, [10, 0, 0, 1].into()));
    let cooked = [vec![8, 0], vec![0; 18], inside].concat();
    assert_eq!(Seen::of(276, &cooked), Some(here));
    let other = Seen::of(101, &udp([address(1, 10), address(9, 90)], 0, b"the sane")).unwrap();
    assert_ne!(other.identity, here.identity);
    let v6 = |port: u16| SocketAddr::from(([0xfe80_u16, 0, 0, 0, 0, 0, 0, 1], port));
    let over_v6 = Seen::of(101, &udp([v6(1), v6(2)], 0, contents)).unwrap();
    assert_eq!(over_v6.identity, here.identity);
}

const UP_MS: i64 = 30;
const DOWN_MS: i64 = 20;

/// Two captures of a path: 100 packets each way, 20 ms apart; the clock of the second host is ahead by `ahead`.
/// Every tenth packet up and every twentieth down is lost; every fifth up comes twice.
#[test]
fn a_datagram_is_known_again_on_every_kind_of_interface() {
    let ip = udp([address(1, 4000), address(2, 4433)], 0, b"abcdef");
    let here = Seen::of(101, &ip).unwrap();
    // Ethernet, PPP, raw IP of a modem, a TUN device: hardware types of Linux
    for hardware in [1_u16, 512, 519, 0xfffe] {
        let mut cooked = vec![0, 4];
        cooked.extend(hardware.to_be_bytes());
        cooked.extend([0; 10]);
        cooked.extend([8, 0]);
        cooked.extend(&ip);
        assert_eq!(Seen::of(113, &cooked), Some(here), "{hardware}");
    }
}

fn two_captures(ahead: i64) -> (Vec<u8>, Vec<u8>) {
    let start = 1_700_000_000_000_000_000;
    let (a, b) = (address(1, 10), address(9, 90));
    let (mut here, mut there) = (Vec::new(), Vec::new());
    for n in 0..100_i64 {
        let at = start + 20 * n * MS;
        let (up, down) = (format!("up {n}"), format!("down {n}"));
        let up = ethernet(udp([a, b], 0, up.as_bytes()));
        let down = ethernet(udp([b, a], 0, down.as_bytes()));
        here.push((at, up.clone()));
        there.push((at + ahead, down.clone()));
        let copies = if n % 5 == 3 { 2 } else { 1 };
        for copy in (0..copies).filter(|_| n % 10 != 5) {
            there.push((at + ahead + (UP_MS + n % 3 + copy) * MS, up.clone()));
        }
        if n % 20 != 7 {
            here.push((at + (DOWN_MS + n % 2) * MS, down));
        }
    }
    // the same contents twice: which is which nobody knows
    for at in [start, start + MS] {
        here.push((at, ethernet(udp([a, b], 0, b"ping"))));
        there.push((at + ahead + UP_MS * MS, ethernet(udp([a, b], 0, b"ping"))));
    }
    // before the other capture began
    here.push((start - 1000 * MS, ethernet(udp([a, b], 0, b"early"))));
    // of others
    here.push((start, ethernet(udp([a, address(5, 5)], 0, b"other"))));
    (pcap(1, &here), pcap(1, &there))
}

#[test]
fn two_captures_of_one_path_show_delay_loss_and_copies_of_each_way() {
    for ahead in [0, 5_000 * MS, -70 * MS] {
        let (here, there) = two_captures(ahead);
        let (here, there) = (read(&here).unwrap(), read(&there).unwrap());
        let matched = Match::default().paths(&here, &there).unwrap();
        // 30 ms up and 20 down are 25 each where no clock is known to be right
        assert_eq!(matched.clock_ahead_ns, ahead + 5 * MS);
        assert_eq!(matched.ambiguous, 2);
        let of = |direction| {
            matched
                .entries
                .iter()
                .filter(move |entry| entry.direction == direction)
        };
        for (direction, least, jitter, lost, copies) in [
            (Direction::Up, 25, 3, 10, 20),
            (Direction::Down, 25, 2, 5, 0),
        ] {
            let packets =
                |end: fn(&End) -> bool| of(direction).filter(move |entry| end(&entry.end)).count();
            assert_eq!(
                packets(|end| !matches!(end, End::Sent { copy: true, .. })),
                100
            );
            assert_eq!(
                packets(|end| matches!(end, End::Dropped(DropCause::Loss))),
                lost
            );
            assert_eq!(
                packets(|end| matches!(end, End::Sent { copy: true, .. })),
                copies
            );
            for entry in of(direction) {
                if let End::Sent {
                    sent, copy: false, ..
                } = entry.end
                {
                    let delay = sent.saturating_since(entry.offered).as_millis() as i64;
                    assert_eq!(delay, least + entry.number as i64 % jitter, "{direction:?}");
                }
            }
        }
        // the other way round up is down
        let turned = Match::default().paths(&there, &here).unwrap();
        assert_eq!(turned.clock_ahead_ns, -ahead - 5 * MS);
    }
}

#[test]
fn captures_in_which_every_packet_stands_twice_make_no_path() {
    let there = udp([address(1, 10), address(2, 20)], 0, b"there");
    // as on the loopback, or of all interfaces
    let twice = [0, MS].map(|at_ns| Frame {
        at_ns,
        link_type: 101,
        bytes: &there,
        comment: "",
    });
    let refused = Match::default().paths(&twice, &twice);
    assert_eq!(refused, Err(MatchError::Ambiguous { packets: 2 }));
}

#[test]
fn one_clock_is_believed_and_two_that_cannot_be_are_refused() {
    let (here, there) = two_captures(0);
    let (here, there) = (read(&here).unwrap(), read(&there).unwrap());
    let same = Match { same_clock: true };
    let matched = same.paths(&here, &there).unwrap();
    let first = matched
        .entries
        .iter()
        .find(|entry| entry.direction == Direction::Up)
        .unwrap();
    let End::Sent { sent, .. } = first.end else {
        panic!("{first:?}");
    };
    assert_eq!(sent.saturating_since(first.offered).as_millis(), 30);
    let (_, ahead) = two_captures(-70 * MS);
    let error = same.paths(&here, &read(&ahead).unwrap()).unwrap_err();
    assert_eq!(error, MatchError::Clocks { delay_ms: -40 });
    assert_eq!(same.paths(&here, &[]).unwrap_err(), MatchError::Nothing);
}
