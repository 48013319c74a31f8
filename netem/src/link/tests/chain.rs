//! Links one behind the other: delays add, losses compose, and the first link is what it is alone.

use super::*;

#[test]
fn delays_add_and_so_do_their_variances() {
    let constant = delays(&fates("delay 20ms; then delay 30ms", 1, LinkId::UP));
    assert!(constant.iter().all(|delay| *delay == Some(50.0)));
    let free = "delay 20ms 5ms order free; then delay 30ms 4ms distribution normal order free";
    let drawn: Vec<f64> = delays(&fates(free, 1, LinkId::UP))
        .into_iter()
        .flatten()
        .collect();
    let ((mean, sd), n) = (mean_and_sd(&drawn), N as f64);
    let variance: f64 = 25.0 / 3.0 + 16.0;
    assert!((mean - 50.0).abs() < 4.0 * (variance / n).sqrt(), "{mean}");
    assert!(
        (sd * sd / variance - 1.0).abs() < 4.0 * (2.0 / n).sqrt(),
        "{sd}"
    );
}

#[test]
fn losses_compose_and_each_link_draws_its_own() {
    let lost = |fates: &[Met]| fates.iter().filter(|fate| fate.is_err()).count() as u64;
    let both = fates("loss 10%; then loss 20%", 3, LinkId::UP);
    let level = binomial_level(N, lost(&both), 1.0 - 0.9 * 0.8);
    assert!(level > 0.001, "{level}");
    // the same words: not the same packets again
    let twice = fates("loss 10%; then loss 10%", 3, LinkId::UP);
    let level = binomial_level(N, lost(&twice), 1.0 - 0.9 * 0.9);
    assert!(level > 0.001, "{level}");
}

#[test]
fn a_second_link_changes_nothing_of_the_first() {
    for first in [
        "delay 10ms 5ms order free loss 10%",
        "delay 10ms 5ms tau 20ms loss gemodel 2% 20%",
        "rate 1mbit queue 5p delay 3ms loss 5%",
    ] {
        let alone = fates(first, 5, LinkId::UP);
        let longer = fates(&format!("{first}; then delay 30ms"), 5, LinkId::UP);
        let later: Vec<Met> = alone
            .iter()
            .map(|fate| fate.map(|due| due + 30 * MS))
            .collect();
        assert_eq!(longer, later, "{first}");
        let lossier = fates(&format!("{first}; then loss 20%"), 5, LinkId::UP);
        for (alone, lossier) in alone.iter().zip(&lossier) {
            assert!(
                alone == lossier || alone.is_ok() && *lossier == Err(DropCause::Loss),
                "{first}"
            );
        }
    }
}

#[test]
fn the_narrowest_bottleneck_sets_the_pace_and_waits_add() {
    let packets = || std::iter::repeat_n((Time::ZERO, Packet::new(1000, ())), 5);
    let out = run(
        &mut link("rate 2mbit; then rate 1mbit delay 1ms", 1, LinkId::UP),
        packets(),
    );
    let ms = |time: Duration| time.as_millis() as u64;
    let dues: Vec<u64> = out
        .iter()
        .map(|out| ms(out.due.saturating_since(Time::ZERO)))
        .collect();
    assert_eq!(dues, [13, 21, 29, 37, 45]);
    let waits: Vec<u64> = out.iter().map(|out| ms(out.queued)).collect();
    assert_eq!(waits, [0, 8, 16, 24, 32]);
    // what the second one drops has its own name and the number of its offer
    let mut narrow = link("rate 2mbit; then rate 1mbit queue 2p", 1, LinkId::UP);
    let out = run(&mut narrow, packets());
    let dropped = out.iter().filter(|out| met(out) == Err(DropCause::Queue));
    assert_eq!(dropped.map(|out| out.number).collect::<Vec<_>>(), [3]);
    let counters = narrow.counters();
    assert_eq!(
        (counters.offered.packets, counters.delivered.packets),
        (5, 4)
    );
    assert_eq!(counters.dropped.queue.packets, 1);
}

#[test]
fn each_link_has_its_own_time() {
    let fates = fates(
        "delay 5ms; at 10s delay 10ms; loop 20s; then delay 1ms; at 15s delay 2ms",
        1,
        LinkId::UP,
    );
    let delay = |s: usize| delays(&fates)[1000 * s];
    assert_eq!(
        [delay(1), delay(11), delay(16), delay(21)],
        [Some(6.0), Some(11.0), Some(12.0), Some(7.0)]
    );
}

#[test]
fn a_chain_becomes_longer_and_shorter_while_it_runs() {
    let mut link = link("delay 5ms", 1, LinkId::UP);
    let mut at = |ms, words: &str| {
        let now = Time::from_millis(ms);
        link.reconfigure(now, words.parse().unwrap()).unwrap();
        one(&mut link, now, 100).map(|due| due.saturating_since(now).as_millis())
    };
    assert_eq!(at(0, "delay 5ms; then delay 30ms"), Ok(35));
    assert_eq!(at(100, "delay 7ms"), Ok(7));
    assert_eq!(at(200, "none; then loss 100%"), Err(DropCause::Loss));
    // what has passed the first link meets the second as it is then
    let now = Time::from_millis(300);
    link.reconfigure(now, "delay 5ms; then delay 30ms".parse().unwrap())
        .unwrap();
    link.offer(now, Packet::new(100, ()));
    link.reconfigure(now + MS, "none; then delay 1ms".parse().unwrap())
        .unwrap();
    assert_eq!(link.in_flight(), 1);
    assert_eq!(link.poll(Time::MAX).map(|out| out.due), Some(now + 6 * MS));
}
