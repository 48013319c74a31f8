//! Schemes that send at different rates meet the same network, and a feature leaves the others alone.

use super::*;

/// The fates of packets at 1 kHz, only those of every `step`-th sent.
fn every(words: &str, step: u64) -> Vec<Met> {
    let packets = (0..N).step_by(step as usize);
    let packets = packets.map(|packet| (Time::from_millis(packet), Packet::new(0, ())));
    let out = run(&mut link(words, 307, LinkId::UP), packets);
    out.iter().map(met).collect()
}

#[test]
fn loss_and_delay_in_time_are_the_same_for_two_packet_rates() {
    for words in [
        "loss burst 5% 40ms",
        "delay 50ms 5ms tau 100ms order free",
        "delay 50ms 5ms tau 100ms distribution pareto order free loss burst 10% 20ms",
        "outage 3s for 1s every 7s delay 20ms; at 30s delay 40ms",
    ] {
        let fast = every(words, 1);
        let slow = every(words, 7);
        let same: Vec<Met> = fast.iter().step_by(7).copied().collect();
        assert_eq!(slow, same, "{words}");
        assert!(slow.iter().any(|fate| *fate != slow[0]));
    }
    // and what goes by packet is not: this is what the words in time are for
    let (fast, slow) = (
        every("loss gemodel 1% 10%", 1),
        every("loss gemodel 1% 10%", 7),
    );
    let same: Vec<Met> = fast.iter().step_by(7).copied().collect();
    assert_ne!(slow, same);
}

#[test]
fn order_by_fifo_is_the_same_where_no_packet_waits_for_another() {
    let (fast, slow) = (
        every("delay 50ms 1ms tau 1s", 1),
        every("delay 50ms 1ms tau 1s", 10),
    );
    let dues = |fates: &[Met], step| -> Vec<f64> {
        let dues = fates.iter().step_by(step).filter_map(|fate| fate.ok());
        dues.map(|due| due.as_secs_f64() * 1e3).collect()
    };
    let apart = dues(&fast, 10);
    let worst = dues(&slow, 1)
        .iter()
        .zip(&apart)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max);
    assert!(worst < 0.05, "{worst} ms");
}

/// Everything that can befall a packet on a link without a rate, but for what sets its delay.
const FEATURES: [&str; 12] = [
    "loss 10%",
    "loss 10% 60%",
    "loss gemodel 5% 30%",
    "loss state 5% 30%",
    "loss burst 5% 20ms",
    "loss every 7",
    "loss list 3,17,100-120",
    "loss 10% ecn",
    "duplicate 20% 30%",
    "corrupt 20% 30%",
    "outage 10s for 5s",
    "mtu 500",
];

/// Everything that sets a delay.
const DELAYS: [&str; 10] = [
    "delay 50ms 5ms",
    "delay 50ms 5ms order free",
    "delay 50ms 5ms 70%",
    "delay 50ms 5ms tau 50ms",
    "delay 50ms 5ms reorder 10% 50%",
    "delay 50ms 5ms order free reorder 30% gap 3",
    "delay 50ms 5ms slot 3ms 9ms packets 5",
    "delay 50ms duplicate 30%",
    "delay cdf 40ms@0%,50ms@90%,200ms@100% tau 50ms",
    "delay 20ms 5ms distribution gamma slot distribution normal 4ms 1ms",
];

/// Packets of 100 and of 1000 bytes at 1 kHz, through a link with these words: what became of each.
fn mixed(words: &str) -> Vec<Departure<()>> {
    let size = |packet| if packet % 10 == 3 { 1000 } else { 100 };
    let packets = (0..N / 2).map(|packet| (Time::from_millis(packet), packet));
    let packets = packets.map(|(at, packet)| (at, Packet::new(size(packet), ())));
    run(&mut link(words, 311, LinkId::UP), packets)
}

#[test]
fn no_feature_of_a_link_moves_the_delays_of_a_link_behind_it() {
    let first = "delay 9ms 4ms order free";
    for delay in DELAYS {
        let alone = mixed(&format!("{first}; then {delay}"));
        for feature in FEATURES {
            // copies keep the order and fill slots as their packets do: they are packets more
            let unordered = delay.contains("free") && !delay.contains("slot");
            if feature.starts_with("duplicate") && !unordered {
                continue;
            }
            let both = mixed(&format!("{first} {feature}; then {delay}"));
            let mut pairs = alone.iter().map(met).zip(both.iter().map(met));
            let moved = pairs.find(|(alone, both)| both.is_ok() && both != alone);
            assert_eq!(moved, None, "{first} {feature}; then {delay}");
        }
    }
}

#[test]
fn no_feature_moves_the_delays_of_another() {
    for delay in DELAYS {
        let alone: Vec<Met> = mixed(delay).iter().map(met).collect();
        for feature in FEATURES {
            if feature.starts_with("duplicate") && delay.contains("duplicate") {
                continue;
            }
            // copies keep the order and fill slots as their packets do: they are packets more
            if feature.starts_with("duplicate") && !delay.contains("free") {
                continue;
            }
            let both: Vec<Met> = mixed(&format!("{delay} {feature}"))
                .iter()
                .map(met)
                .collect();
            let moved = alone
                .iter()
                .zip(&both)
                .filter(|(alone, both)| both.is_ok() && both != alone);
            assert_eq!(moved.count(), 0, "{feature} beside {delay}");
        }
    }
}

#[test]
fn raising_a_share_only_ever_adds() {
    let lost = |out: &Departure<()>| !out.is_delivered();
    let copied = |words: &str| -> Vec<bool> {
        let packets = (0..N / 2).map(|packet| (Time::from_millis(packet), Packet::new(100, ())));
        let out = with_copies(&mut link(words, 311, LinkId::UP), packets);
        let mut copied = vec![false; (N / 2) as usize];
        out.iter()
            .filter(|out| out.copy)
            .for_each(|out| copied[out.number as usize] = true);
        copied
    };
    let at_once = |out: &Departure<()>| out.due == out.offered_at;
    let all =
        |words: &str, hit: &dyn Fn(&Departure<()>) -> bool| mixed(words).iter().map(hit).collect();
    for (few, many) in [
        ("loss 1%", "loss 5%"),
        ("loss 1% 60%", "loss 5% 60%"),
        ("loss gemodel 1%", "loss gemodel 2%"),
        ("loss gemodel 1% 30%", "loss gemodel 2% 30%"),
        ("loss gemodel 2% 30%", "loss gemodel 2% 20%"),
        ("loss gemodel 2% 30% 60% 1%", "loss gemodel 2% 30% 70% 2%"),
        ("loss burst 1% 20ms", "loss burst 3% 20ms"),
        ("loss burst 40% 20ms 50%", "loss burst 90% 20ms 60%"),
        (
            "outage 1s for 500ms every 9s",
            "outage 1s for 900ms every 9s",
        ),
        ("loss list 100-250", "loss list 50-400"),
        ("loss 2%; then loss 1%", "loss 2%; then loss 3%"),
    ] {
        let (few, many): (Vec<bool>, Vec<bool>) = (all(few, &lost), all(many, &lost));
        only_adds(&few, &many);
    }
    for order in ["", "order free loss 10%", "corrupt 10%"] {
        let words = |percent| format!("delay 9ms 2ms duplicate {percent}% 20% {order}");
        only_adds(&copied(&words(2)), &copied(&words(5)));
        let words = |percent| format!("delay 9ms 2ms reorder {percent}% 20% {order}");
        only_adds(&all(&words(2), &at_once), &all(&words(5), &at_once));
        let order = order.replace("corrupt 10%", "");
        let words = |percent| format!("delay 9ms 2ms corrupt {percent}% 20% {order}");
        let turned = Departure::is_corrupted;
        only_adds(&all(&words(2), &turned), &all(&words(5), &turned));
    }
}

#[test]
fn more_loss_on_a_link_only_ever_adds_whatever_follows() {
    let adds = |few: &str, many: &str, then: &str| {
        let lost = |words: &str| -> Vec<bool> {
            let fates = mixed(&format!("{words}; then {then}"));
            fates.iter().map(|fate| !fate.is_delivered()).collect()
        };
        only_adds(&lost(few), &lost(many));
    };
    let without_memory = [
        "loss 3%",
        "loss burst 3% 20ms",
        "loss every 9",
        "loss list 100-400",
        "duplicate 20% loss 3%",
    ];
    let with_memory = [
        "loss 3% 40%",
        "loss gemodel 3% 30%",
        "loss state 3% 30%",
        "delay 5ms 2ms loss 3%; then delay 9ms 3ms reorder 10% loss 5% 50%",
    ];
    let free = "delay 9ms 4ms order free";
    for (few, many) in [
        (format!("{free} loss 1%"), format!("{free} loss 5%")),
        (
            format!("{free}; then loss 1%"),
            format!("{free}; then loss 5%"),
        ),
        ("loss gemodel 1% 30%".into(), "loss gemodel 2% 30%".into()),
    ] {
        for then in without_memory.into_iter().chain(with_memory) {
            adds(&few, &many, then);
        }
    }
    // behind a bottleneck what is left comes earlier, to other states
    for then in without_memory {
        let first = "rate 100mbit delay 5ms";
        adds(
            &format!("{first} loss 1%"),
            &format!("{first} loss 5%"),
            then,
        );
    }
}

#[test]
fn copies_of_an_earlier_link_meet_a_later_one_each_by_itself() {
    let came = |words: &str| -> Vec<(u64, Time)> {
        let packets = (0..N / 2).map(|packet| (Time::from_millis(packet), Packet::new(100, ())));
        let out = with_copies(&mut link(words, 311, LinkId::UP), packets);
        let out = out.iter().filter(|out| out.copy && out.is_delivered());
        out.map(|out| (out.number, out.due)).collect()
    };
    for then in [
        "delay 9ms 5ms order free loss 10%",
        "delay 9ms 5ms 50% order free loss 10% 50%",
        "delay 9ms 5ms order free duplicate 20%; then delay 9ms 5ms order free loss 3%",
    ] {
        let words = |first: &str| came(&format!("{first}; then {then}"));
        let is_among = |few: &[(u64, Time)], many: &[(u64, Time)]| {
            let many: std::collections::BTreeSet<_> = many.iter().collect();
            let missing = few.iter().filter(|copy| !many.contains(copy)).count();
            assert!(few.len() > 100 && many.len() > few.len(), "{then}");
            assert_eq!(missing, 0, "of {}: {then}", few.len());
        };
        // what both have is the same; a lost packet that has a copy takes its place
        is_among(
            &words("duplicate 20% loss 40%"),
            &words("duplicate 20% loss 1%"),
        );
        is_among(&words("duplicate 5%"), &words("duplicate 20%"));
    }
}

fn only_adds(few: &[bool], many: &[bool]) {
    let count = |all: &[bool]| all.iter().filter(|hit| **hit).count();
    assert!(count(few) > 100 && count(many) > count(few));
    let gone = few.iter().zip(many).filter(|(few, many)| **few && !**many);
    assert_eq!(gone.count(), 0, "of {} and {}", count(few), count(many));
}

#[test]
fn no_feature_moves_the_losses_of_another() {
    for loss in [
        "loss 10%",
        "loss 10% 50%",
        "loss gemodel 5% 30%",
        "loss burst 5% 20ms",
    ] {
        let alone = fates(loss, 313, LinkId::UP);
        for feature in [
            "delay 50ms 5ms",
            "delay 50ms 5ms tau 50ms",
            "delay 50ms 5ms 30% distribution pareto",
            "delay 50ms reorder 20%",
            "corrupt 20%",
            "rate 1gbit",
        ] {
            let both = fates(&format!("{feature} {loss}"), 313, LinkId::UP);
            let mut pairs = alone.iter().zip(&both);
            let same = pairs.all(|(a, b)| a.is_err() == b.is_err());
            assert!(same, "{loss} beside {feature}");
        }
    }
}

#[test]
fn a_copy_takes_nothing_from_the_packets() {
    let through = |words: &str| {
        let packets = (0..N).map(|packet| (Time::from_millis(packet), Packet::new(0, ())));
        with_copies(&mut link(words, 317, LinkId::UP), packets)
    };
    let words = "delay 50ms 5ms order free loss 10%";
    let alone = through(words);
    let both = through(&format!("{words} duplicate 30%"));
    let copies = both.iter().filter(|out| out.copy).count() as f64;
    let itself = both.iter().filter(|out| !out.copy);
    let mut saved = 0.0;
    for (alone, both) in alone.iter().zip(itself) {
        if met(alone).is_err() && met(both).is_ok() {
            saved += 1.0;
        } else {
            assert_eq!(met(alone), met(both), "a copy cost its packet");
        }
    }
    // as in tc: a packet that is both lost and copied passes once
    let expected = 0.3 * 0.1 * N as f64;
    assert!((saved - expected).abs() < 4.0 * expected.sqrt(), "{saved}");
    let expected = 0.3 * 0.81 * N as f64;
    assert!(
        (copies - expected).abs() < 4.0 * expected.sqrt(),
        "{copies}"
    );
}
