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

/// Everything that can befall a packet without touching when or whether another one arrives.
const FEATURES: [&str; 8] = [
    "loss 10%",
    "loss gemodel 5% 30%",
    "loss state 5% 30%",
    "loss burst 5% 20ms",
    "duplicate 20%",
    "corrupt 20%",
    "outage 10s for 5s",
    "mtu 2000",
];

#[test]
fn no_feature_moves_the_delays_of_another() {
    for jitter in [
        "delay 50ms 5ms order free",
        "delay 50ms 5ms tau 50ms order free",
    ] {
        let alone = fates(jitter, 311, LinkId::UP);
        for feature in FEATURES {
            let both = fates(&format!("{jitter} {feature}"), 311, LinkId::UP);
            for (alone, both) in alone.iter().zip(&both) {
                assert!(both.is_err() || both == alone, "{feature}");
            }
        }
    }
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
    for (alone, both) in alone.iter().zip(itself) {
        // a copy may come through where the packet was lost
        assert!(
            met(alone).is_err() || met(alone) == met(both),
            "a copy cost its packet"
        );
    }
    let expected = 0.3 * 0.81 * N as f64;
    assert!(
        (copies - expected).abs() < 4.0 * expected.sqrt(),
        "{copies}"
    );
}
