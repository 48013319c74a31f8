//! Records of both forms read back to themselves, and their summary tells what happened.

use proptest::prelude::*;

use super::summary::Summary;
use super::*;
use crate::direction::Direction;
use crate::packet::{DropCause, Packet};
use crate::{Link, LinkConfig, LinkId};
use mmt_shared::time::Time;

fn heading() -> Heading {
    Heading {
        seed: 7,
        up: "delay 50ms 5ms loss 1%".to_owned(),
        down: "none".to_owned(),
    }
}

fn as_csv(entries: &[Entry]) -> String {
    let mut text = csv::heading(&heading());
    entries.iter().for_each(|entry| csv::push(&mut text, entry));
    text
}

fn as_binary(entries: &[Entry]) -> Vec<u8> {
    let (mut writer, mut bytes) = (binary::Writer::default(), Vec::new());
    writer.heading(&mut bytes, &heading());
    for entry in entries {
        writer.push(&mut bytes, entry);
    }
    bytes
}

fn any_entry() -> impl Strategy<Value = Entry> {
    let time = any::<u64>().prop_map(Time::from_nanos);
    let sent = (time.clone(), time.clone(), any::<bool>(), any::<bool>());
    let end = prop_oneof![
        sent.prop_map(|(due, sent, copy, corrupted)| End::Sent {
            due,
            sent,
            copy,
            corrupted
        }),
        prop::sample::select(DropCause::ALL.to_vec()).prop_map(End::Dropped),
        Just(End::Unsent),
    ];
    let direction = prop_oneof![Just(Direction::Up), Just(Direction::Down)];
    let numbers = (any::<u64>(), any::<u32>(), any::<u32>());
    (direction, time, numbers, end).prop_map(|(direction, offered, numbers, end)| Entry {
        direction,
        offered,
        number: numbers.0,
        bytes: numbers.1,
        backlog: numbers.2,
        end,
    })
}

proptest! {
    #[test]
    fn both_forms_read_back(entries in prop::collection::vec(any_entry(), 0..20)) {
        let expected = (heading(), entries);
        prop_assert_eq!(read(as_csv(&expected.1).as_bytes()), Ok(expected.clone()));
        prop_assert_eq!(read(&as_binary(&expected.1)), Ok(expected));
    }

    #[test]
    fn a_record_cut_off_or_broken_is_reported_and_never_panics(
        entries in prop::collection::vec(any_entry(), 1..5),
        at in any::<prop::sample::Index>(),
        byte in any::<u8>(),
    ) {
        let whole = as_binary(&entries);
        let mut broken = whole.clone();
        broken[at.index(whole.len())] = byte;
        let _ = read(&broken);
        let cut = at.index(whole.len());
        if let Ok((_, read)) = read(&whole[..cut]) {
            prop_assert!(read.len() < entries.len());
        }
    }
}

/// A link driven in virtual time, every packet on record.
fn driven(words: &str, packets: u64) -> Vec<Entry> {
    let mut link = Link::try_new(words.parse().unwrap(), 3, LinkId::UP).unwrap();
    let mut entries = Vec::new();
    let mut take = |link: &mut Link<()>, now| {
        let out = std::iter::from_fn(|| link.poll(now));
        entries.extend(out.map(|out| Entry::of(Direction::Up, &out)));
    };
    for now in (0..packets).map(Time::from_millis) {
        take(&mut link, now);
        link.offer(now, Packet::new(100, ()));
    }
    take(&mut link, Time::MAX);
    entries
}

#[test]
fn a_summary_finds_what_was_configured() {
    let words = "delay 50ms 5ms distribution normal order free loss gemodel 1% 25%";
    let entries = driven(words, 60_000);
    let summary = Summary::of(&entries, Direction::Up);
    let expected = words
        .parse::<LinkConfig>()
        .unwrap()
        .expected(1000.0, 100)
        .unwrap();
    assert_eq!(summary.offered.packets, 60_000);
    assert!((summary.rate_hz - 1000.0).abs() < 1e-6);
    assert!((summary.mean_ms - expected.mean_ms).abs() < 0.1);
    assert!((summary.sd_ms - expected.sd_ms).abs() < 0.1);
    assert!((summary.p99_ms - expected.p99_ms).abs() < 0.5);
    assert!((summary.reordered - expected.reordered).abs() < 0.02);
    assert!((summary.loss - expected.loss).abs() < 0.006);
    assert!(
        (summary.burst_packets - 4.0).abs() < 0.8,
        "{}",
        summary.burst_packets
    );
    assert_eq!(summary.lateness_us, [0.0; 3]);
    assert!(!summary.degraded);
    let binned: u64 = summary.delay_histogram.iter().map(|(_, n)| n).sum();
    assert_eq!(binned, summary.sent.packets);
    let in_runs: u64 = summary
        .loss_bursts
        .iter()
        .map(|(length, n)| length * n)
        .sum();
    assert_eq!(in_runs, summary.dropped[DropCause::Loss.name()]);
    assert!(
        summary
            .queue
            .iter()
            .all(|(_, most)| (30..80).contains(most) || *most < 80)
    );
    assert_eq!(Summary::of(&entries, Direction::Down), Summary::default());
}

#[test]
fn a_late_host_marks_its_record() {
    let mut entries = driven("delay 5ms", 1000);
    assert!(!Summary::of(&entries, Direction::Up).degraded);
    let mut late = |number: usize| {
        if let End::Sent { sent, .. } = &mut entries[number].end {
            *sent += std::time::Duration::from_micros(1001);
        }
        Summary::of(&entries, Direction::Up).degraded
    };
    // one of a thousand is no verdict, two are
    assert!(!late(500));
    assert!(late(501));
}

#[test]
fn a_record_replays_as_a_path() {
    let entries = driven("delay 50ms 5ms loss 5%", 2000);
    let text = as_csv(&entries);
    let config = crate::words::parse("trace r.csv up", &mut |_| Ok(text.clone())).unwrap();
    assert_eq!(config.to_string(), "trace r.csv up");
    let mut link = crate::Link::try_new(config, 99, LinkId::DOWN).unwrap();
    for entry in {
        let mut sorted = entries.clone();
        sorted.sort_by_key(|entry| entry.number);
        sorted
    } {
        link.offer(entry.offered, Packet::new(0, ()));
        let due = link.poll_delivered(Time::MAX).map(|out| out.due);
        let expected = match entry.end {
            End::Sent { due, .. } => Some(due),
            _ => None,
        };
        assert_eq!(due, expected, "packet {}", entry.number);
    }
}

/// FNV-1a, 64 bit: enough to tell two logs apart, and nothing that a platform could change.
fn digest(bytes: &[u8]) -> u64 {
    let step = |hash: u64, byte: &u8| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, step)
}

#[test]
fn the_log_of_a_run_is_the_same_to_the_byte_and_another_seed_gives_another() {
    let words = "delay 40ms 10ms tau 20ms distribution gamma loss burst 2% 30ms duplicate 1% corrupt 1% \
                 rate 2mbit 28 queue 50ms codel slot 2ms packets 40";
    let log = |words: &str| digest(as_csv(&driven(words, 20_000)).as_bytes());
    assert_eq!(log(words), log(words));
    assert_ne!(log(words), log(&format!("{words} seed 4")));
    // pinned: another machine and another day give the same
    assert_eq!(log(words), 0xf4aa_0937_80d4_adbf, "{:#x}", log(words));
}

#[test]
fn a_heading_whose_words_are_two_lines_is_refused() {
    let heading = Heading {
        up: "none\n# seed 8".to_owned(),
        ..heading()
    };
    let mut bytes = Vec::new();
    binary::Writer::default().heading(&mut bytes, &heading);
    let refused = read(&bytes).unwrap_err();
    assert!(refused.reason.contains("not one line"), "{refused}");
}

#[test]
fn a_record_of_another_version_is_refused_by_name() {
    let error = read(b"mmtnetem1\n\x07\x00\x00").unwrap_err();
    assert!(error.to_string().contains("reads version 2"), "{error}");
}

#[test]
fn the_binary_form_is_compact() {
    let entries = driven("delay 50ms 5ms loss 1%", 1000);
    let (text, bytes) = (as_csv(&entries).len(), as_binary(&entries).len());
    assert!(
        bytes < 20 * entries.len() && bytes * 3 < text,
        "{bytes} {text}"
    );
}
