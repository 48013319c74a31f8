//! Loss models against their theory: shares, runs, states, times. Bounds are four standard errors
//! (one false alarm in 16 000) unless another level is named; seeds are fixed.

use super::*;
use crate::packet::flip_bit;
use crate::record::summary::{mean_run, runs};

fn lost(words: &str, seed: u64) -> Vec<bool> {
    let fates = fates(words, seed, LinkId::UP);
    fates.iter().map(Met::is_err).collect()
}

fn share(lost: &[bool]) -> f64 {
    lost.iter().filter(|lost| **lost).count() as f64 / lost.len() as f64
}

/// Chi-square of run lengths against a geometric distribution, lengths 1 to 5 and the rest.
fn chi_square_of_runs(lost: &[bool], leave: f64) -> f64 {
    let runs = runs(lost.iter().copied());
    let all: u64 = runs.values().sum();
    let mut observed = [0.0; 6];
    for (length, n) in runs {
        observed[(length as usize - 1).min(5)] += n as f64;
    }
    let expected = |at: usize| match at {
        5 => (1.0 - leave).powi(5),
        at => leave * (1.0 - leave).powi(at as i32),
    };
    let term = |(at, observed): (usize, &f64)| {
        let expected = expected(at) * all as f64;
        (observed - expected).powi(2) / expected
    };
    observed.iter().enumerate().map(term).sum()
}

/// 99.9 % of chi-square with five degrees of freedom.
const CHI_SQUARE_5: f64 = 20.5;

#[test]
fn gilbert_elliott_has_its_share_and_geometric_bursts() {
    let lost = lost("loss gemodel 2% 30%", 41);
    let expected = 0.02 / 0.32;
    // correlated by (1 - p - r): the variance of the mean grows by (1 + rho) / (1 - rho)
    let spread = (expected * (1.0 - expected) / N as f64 * (1.68 / 0.32)).sqrt();
    let share = share(&lost);
    assert!((share - expected).abs() < 4.0 * spread, "{share}");
    let chi_square = chi_square_of_runs(&lost, 0.3);
    assert!(chi_square < CHI_SQUARE_5, "{chi_square}");
    // and the test would notice another chain
    assert!(chi_square_of_runs(&lost, 0.4) > CHI_SQUARE_5);
}

#[test]
fn gaps_between_bursts_are_geometric_too() {
    let gaps: Vec<bool> = lost("loss gemodel 20% 50%", 43)
        .iter()
        .map(|lost| !lost)
        .collect();
    let chi_square = chi_square_of_runs(&gaps, 0.2);
    assert!(chi_square < CHI_SQUARE_5, "{chi_square}");
}

#[test]
fn the_good_and_the_bad_state_lose_what_they_should() {
    let config: crate::LinkConfig = "loss gemodel 5% 20% 60% 1%".parse().unwrap();
    let expected = 0.2 * 0.6 + 0.8 * 0.01;
    assert!((config.loss.share().unwrap() - expected).abs() < 1e-9);
    let share = share(&lost("loss gemodel 5% 20% 60% 1%", 47));
    assert!((share - expected).abs() < 0.01, "{share}");
}

#[test]
fn the_four_states_lose_the_share_of_their_balance() {
    for (words, seed) in [
        ("loss state 3% 60% 20% 50% 1%", 53),
        ("loss state 1%", 59),
        ("loss state 0% 50% 0% 100% 5%", 61),
    ] {
        let config: crate::LinkConfig = words.parse().unwrap();
        let expected = config.loss.share().unwrap();
        let share = share(&lost(words, seed));
        let spread = (expected * (1.0 - expected) / N as f64).sqrt();
        assert!(
            (share - expected).abs() < 12.0 * spread,
            "{words}: {share} {expected}"
        );
    }
    // a lost packet of state 4 is always alone
    let alone = runs(lost("loss state 0% 50% 0% 100% 5%", 61).into_iter());
    assert_eq!(alone.keys().copied().collect::<Vec<_>>(), [1]);
}

#[test]
fn correlated_loss_keeps_its_share_and_comes_in_runs() {
    // the kernel's own arithmetic turns `loss 1% 25%` into 0.00026 %
    for correlation in ["25%", "90%"] {
        let lost = lost(&format!("loss 5% {correlation}"), 67);
        let share = share(&lost);
        assert!((share - 0.05).abs() < 0.008, "{correlation}: {share}");
        let burst = mean_run(&runs(lost.into_iter()));
        let least = if correlation == "25%" { 1.1 } else { 2.0 };
        assert!(burst > least, "{correlation}: {burst}");
    }
}

#[test]
fn bursts_in_time_have_their_share_and_their_length_at_any_rate() {
    for (rate_hz, seed) in [(1000_u64, 71), (100, 71)] {
        let mut link = link("loss burst 5% 40ms", seed, LinkId::UP);
        let step = 1_000_000_000 / rate_hz;
        let packets = 0..2_000 * rate_hz;
        let packets = packets.map(|packet| (Time::from_nanos(packet * step), Packet::new(0, ())));
        let out = run(&mut link, packets);
        let lost: Vec<bool> = out.iter().map(|out| met(out).is_err()).collect();
        // 2500 bursts in 2000 s: the share is known to 1 / sqrt(2500), times sqrt(2)
        assert!(
            (share(&lost) / 0.05 - 1.0).abs() < 4.0 * 0.0283,
            "{}",
            share(&lost)
        );
        let burst_ms = mean_run(&runs(lost.iter().copied())) * 1000.0 / rate_hz as f64;
        // a burst seen lasts longer than a burst: the shortest fall between packets
        let interval_ms = 1000.0 / rate_hz as f64;
        let expected = interval_ms / (1.0 - libm::exp(-interval_ms / 40.0));
        assert!(
            (burst_ms / expected - 1.0).abs() < 0.1,
            "{rate_hz} Hz: {burst_ms} {expected}"
        );
    }
}

#[test]
fn a_chain_that_loses_until_it_comes_to_rest_is_no_link_that_never_loses() {
    let is_transparent = |words: &str| words.parse::<LinkConfig>().unwrap().is_transparent();
    for words in ["loss state 100% 0% 100% 0%", "loss gemodel 100% 0% 0% 100%"] {
        let lost = lost(words, 1);
        let at: Vec<usize> = (0..lost.len()).filter(|at| lost[*at]).collect();
        assert_eq!((at, is_transparent(words)), (vec![0], false), "{words}");
    }
    for words in ["loss state 0% 50% 50% 0%", "loss gemodel 0% 50% 100% 0%"] {
        assert!(is_transparent(words), "{words}");
    }
}

#[test]
fn named_packets_and_scheduled_outages_are_lost_and_no_others() {
    let listed = lost("loss list 11-12,3,10-11", 1);
    let at: Vec<usize> = (0..listed.len()).filter(|at| listed[*at]).collect();
    assert_eq!(at, [3, 10, 11, 12]);
    let every = lost("loss every 100", 1);
    assert!(
        every
            .iter()
            .enumerate()
            .all(|(at, lost)| *lost == (at % 100 == 99))
    );
    let out = fates("outage 1s for 50ms every 10s", 1, LinkId::UP);
    for (ms, fate) in out.iter().enumerate() {
        let expected = ms >= 1000 && (ms - 1000) % 10_000 < 50;
        assert_eq!(*fate == Err(DropCause::Outage), expected, "{ms} ms");
    }
}

#[test]
fn copies_and_turned_bits_have_their_shares_and_their_counts() {
    let mut link = link("duplicate 10% corrupt 5% mtu 1000", 73, LinkId::UP);
    let mut turned = [0_u64; 8];
    let bytes = |packet| if packet % 10 == 0 { 1001 } else { 1000 };
    let offer = |packet| (Time::from_millis(packet), Packet::new(bytes(packet), ()));
    for out in run(&mut link, (0..N).map(offer)) {
        assert_eq!(out.number % 10 == 0, met(&out) == Err(DropCause::Mtu));
        if let Fate::Delivered {
            corrupted_bit: Some(bit),
            ..
        } = out.fate
        {
            assert!(bit < 8000);
            turned[(bit / 1000) as usize] += 1;
        }
    }
    let counters = link.counters();
    let passed = N as f64 * 0.9;
    let duplicated = counters.duplicated.packets as f64;
    assert!((duplicated - 0.1 * passed).abs() < 4.0 * (0.09 * passed).sqrt());
    let corrupted = counters.corrupted.packets as f64;
    assert!((corrupted - 0.055 * passed).abs() < 4.0 * (0.055 * passed).sqrt());
    let even = turned.iter().sum::<u64>() as f64 / 8.0;
    assert!(
        turned
            .iter()
            .all(|n| (*n as f64 - even).abs() < 4.5 * even.sqrt()),
        "{turned:?}"
    );
    assert_eq!(
        counters.offered.plus(counters.duplicated),
        counters.delivered.plus(counters.dropped.total())
    );
    let mut bytes = [0_u8; 2];
    flip_bit(&mut bytes, 9);
    flip_bit(&mut bytes, 16);
    assert_eq!(bytes, [0, 2]);
}

#[test]
fn a_copy_draws_its_own_corruption() {
    let packets = (0..N).map(|packet| (Time::from_millis(packet), Packet::new(100, ())));
    let out = with_copies(
        &mut link("duplicate 100% corrupt 20%", 79, LinkId::UP),
        packets,
    );
    let hits = |copy| out.iter().filter(move |out| out.copy == copy);
    let both = hits(false).zip(hits(true));
    let both = both.filter(|(packet, copy)| packet.is_corrupted() && copy.is_corrupted());
    let expected = 0.04 * N as f64;
    let both = both.count() as f64;
    assert!((both - expected).abs() < 4.0 * expected.sqrt(), "{both}");
}
