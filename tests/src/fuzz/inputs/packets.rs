//! Records of packets.

use mmt_netem::Direction;
use mmt_netem::record::{End, Entry, Heading, binary, csv};
use mmt_shared::time::Time;

pub(in crate::fuzz) fn packet_records() -> Vec<Vec<u8>> {
    let mut text = csv::heading(&heading());
    entries()
        .iter()
        .for_each(|entry| csv::push(&mut text, entry));
    let (mut writer, mut bytes) = (binary::Writer::default(), Vec::new());
    writer.heading(&mut bytes, &heading());
    entries()
        .iter()
        .for_each(|entry| writer.push(&mut bytes, entry));
    vec![text.into_bytes(), bytes]
}

pub(super) fn heading() -> Heading {
    Heading {
        seed: 7,
        up: "delay 50ms 5ms loss 1%".to_owned(),
        down: "none".to_owned(),
    }
}

pub(super) fn entries() -> Vec<Entry> {
    let entry = |number: u64, end| Entry {
        direction: if number.is_multiple_of(3) {
            Direction::Down
        } else {
            Direction::Up
        },
        number,
        offered: Time::from_millis(number * 10),
        bytes: 100,
        backlog: 2,
        end,
    };
    let sent = |number: u64, copy| End::Sent {
        due: Time::from_millis(number * 10 + 50),
        sent: Time::from_millis(number * 10 + 51),
        copy,
        corrupted: false,
    };
    let mut entries: Vec<Entry> = (0..6)
        .map(|number| entry(number, sent(number, false)))
        .collect();
    entries.push(entry(6, sent(6, true)));
    entries.push(entry(7, End::Unsent));
    entries.extend(mmt_netem::DropCause::ALL.map(|cause| entry(8, End::Dropped(cause))));
    entries
}
