//! What the rarer words of tc do: slots, marks in the place of losses, a seed among the words.

use super::*;

fn departures(words: &str, packets: u64, bytes: usize) -> Vec<u64> {
    let packets = (1..=packets).map(|ms| (Time::from_millis(ms), Packet::new(bytes, ())));
    let out = run(&mut link(words, 5, LinkId::UP), packets);
    let dues = out.iter().filter_map(|out| met(out).ok());
    dues.map(|due| due.as_nanos() / 1000).collect()
}

/// Lengths of the batches, and the times between them, us.
fn batches(departures: &[u64]) -> (Vec<usize>, Vec<u64>) {
    let batches: Vec<&[u64]> = departures.chunk_by(|a, b| a == b).collect();
    let lengths = batches.iter().map(|batch| batch.len()).collect();
    let gaps = batches.windows(2).map(|pair| pair[1][0] - pair[0][0]);
    (lengths, gaps.collect())
}

#[test]
fn packets_leave_in_the_batches_of_the_slots() {
    // one packet a millisecond, from 1 ms on: the first finds no slot open and waits for one gap
    let (lengths, gaps) = batches(&departures("slot 20ms", 1000, 100));
    assert!(
        lengths[..lengths.len() - 1].iter().all(|n| *n == 21),
        "{lengths:?}"
    );
    assert!(gaps.iter().all(|us| *us == 21_000), "{gaps:?}");

    // five packets use a slot up: those that wait leave with the next ones, one gap apart
    let (lengths, gaps) = batches(&departures("slot 4ms packets 5", 1000, 100));
    assert!(
        lengths[..lengths.len() - 1]
            .iter()
            .all(|n| (4..=5).contains(n)),
        "{lengths:?}"
    );
    assert!(
        gaps.iter().all(|us| (4_000..=5_000).contains(us)),
        "{gaps:?}"
    );

    // and so do 300 bytes, the packet that goes beyond them included
    let departures = departures("slot 10ms bytes 300", 200, 140);
    let (lengths, gaps) = batches(&departures);
    assert!(
        lengths[..lengths.len() - 1].iter().all(|n| *n == 3),
        "{lengths:?}"
    );
    assert!(gaps.iter().all(|us| *us == 10_000), "{gaps:?}");
    assert!(departures.is_sorted());
}

#[test]
fn gaps_of_slots_are_drawn_as_they_say() {
    let gaps = |words: &str| -> Vec<f64> {
        let (_, gaps) = batches(&departures(words, 60_000, 100));
        gaps.iter().map(|us| *us as f64 * 1e-3).collect()
    };
    // a slot that one packet uses up: the next opens one gap later, never idle at 1 kHz
    let mut uniform = gaps("slot 2ms 6ms packets 1 limit 1000000");
    assert!(uniform.len() > 10_000);
    let ks = kolmogorov_smirnov(&mut uniform, |ms| ((ms - 2.0) / 4.0).clamp(0.0, 1.0));
    assert!(ks < 1.95, "{ks}");
    let mut drawn = gaps("slot distribution normal 4ms 500us packets 1 limit 1000000");
    let normal = |ms: f64| 0.5 * libm::erfc((4.0 - ms) / (0.5 * std::f64::consts::SQRT_2));
    let ks = kolmogorov_smirnov(&mut drawn, normal);
    assert!(ks < 1.95, "{ks}");
    assert!(kolmogorov_smirnov(&mut uniform, normal) > 10.0);
}

#[test]
fn what_would_be_lost_is_marked_if_its_sender_understands() {
    let (deaf, capable) = (
        Packet::new(1000, ()),
        Packet {
            ecn_capable: true,
            ..Packet::new(1000, ())
        },
    );
    let fates = |words: &str, packet: Packet<()>| -> (Vec<bool>, LinkCounters) {
        let mut link = link(words, 7, LinkId::UP);
        let offers = (0..20_000).map(|ms| (Time::from_millis(ms), packet));
        let hit = |out: &Departure<()>| match out.fate {
            Fate::Dropped(_) => true,
            Fate::Delivered { marked, .. } => marked,
        };
        let hits = run(&mut link, offers).iter().map(hit).collect();
        (hits, link.counters())
    };
    let (lost, _) = fates("loss 5% ecn", deaf);
    let (marked, counters) = fates("loss 5% ecn", capable);
    // the same packets
    assert_eq!(lost, marked);
    assert_eq!(counters.dropped.total().packets, 0);
    let hits = marked.iter().filter(|hit| **hit).count() as u64;
    assert_eq!((counters.marked.packets, hits > 900), (hits, true));
    let (all_lost, counters) = fates("loss 5%", capable);
    assert_eq!((all_lost, counters.marked.packets), (lost, 0));

    // 8 Mbit/s wanted where 7.2 are to be had
    let (_, counters) = fates("rate 7200kbit queue 500ms codel ecn", capable);
    assert_eq!(counters.dropped.codel.packets, 0);
    assert!(counters.marked.packets > 100, "{counters:?}");
}

#[test]
fn a_seed_among_the_words_goes_before_that_of_the_link() {
    let words = "delay 50ms 5ms loss 10%";
    let own = fates(&format!("{words} seed 8"), 1, LinkId::UP);
    assert_eq!(own, fates(words, 8, LinkId::UP));
    assert_ne!(own, fates(words, 1, LinkId::UP));
    // and still each direction draws its own
    assert_ne!(own, fates(&format!("{words} seed 8"), 1, LinkId::DOWN));
}
