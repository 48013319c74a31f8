//! What a world promises to whoever does a part of it.

use super::*;
use mmt_netem::record::End;
use mmt_server::slave::Substitutes;
use mmt_server::trigger::TriggerInput;
use mmt_shared::model::update::Cause;

#[test]
fn a_hand_that_does_what_the_operator_did_gives_the_same_bits() {
    let config = over(WAN, 1);
    let mut first = World::try_new(&config).unwrap();
    let mut hips = Vec::new();
    first.run(Duration::from_secs(5), |tick| {
        hips.push(tick.master.sample.hip.metres())
    });
    let mut again = World::try_new(&config).unwrap();
    for hip in hips {
        again.step_given(Given {
            hip: Some(hip),
            ..Given::default()
        });
    }
    assert_eq!(first.digest(), again.digest());
    assert_eq!(again.operator().pushes_completed(), Some(0));
}

#[test]
fn a_scheme_of_somebody_else_is_asked_once_a_sample_and_sends_what_it_asks_for() {
    let mut world = World::try_new(&over(WAN, 1)).unwrap();
    let (mut asked, mut wanted, mut stamps) = (0_u64, 0_u64, Vec::new());
    for _ in 0..8000 {
        let mut scheme = |stamp: Time, input: &TriggerInput| {
            asked += 1;
            stamps.push(stamp);
            let touches = input.slave_in_contact && input.shadow_in_contact;
            let sends = touches && asked.is_multiple_of(50);
            wanted += u64::from(sends);
            sends.then_some(Cause::Deadband)
        };
        world.step_given(Given {
            hip: None,
            slave: Substitutes {
                estimator: None,
                scheme: Some(&mut scheme),
            },
        });
    }
    let updates = world.outcome().updates;
    assert!(asked > 7000 && stamps.is_sorted());
    assert!(wanted > 10 && updates.of(Cause::Deadband) >= wanted);
    assert_eq!(updates.of(Cause::Timer), 0);
}

#[test]
fn every_packet_has_its_cause_and_its_fate_as_the_link_counted_them() {
    let config = over("delay 50ms 5ms loss 5%", 3);
    let mut world = World::try_new(&config).unwrap().with_packets();
    world.run(Duration::from_secs(10), |_| {});
    while world.down.in_flight() == 0 {
        world.step();
    }
    let all = world.packets();
    for (n, (direction, link)) in [("up", &world.up), ("down", &world.down)]
        .into_iter()
        .enumerate()
    {
        let of = all.iter();
        let of = of.filter(|packet| packet.packet.direction == direction);
        let of: Vec<_> = of.collect();
        let counters = link.counters();
        let ended = |is: fn(&End) -> bool| {
            let ended = of
                .iter()
                .filter(|packet| packet.end.as_ref().is_some_and(is));
            ended.count() as u64
        };
        assert_eq!(of.len() as u64, world.sent()[n].packets);
        let lost = ended(|end| matches!(end, End::Dropped(_)));
        assert_eq!(lost, counters.dropped.loss.packets);
        assert!(lost > 0, "{direction}");
        let came = ended(|end| matches!(end, End::Sent { .. }));
        let under_way = of.iter().filter(|packet| packet.end.is_none()).count();
        assert_eq!(came + lost + under_way as u64, of.len() as u64);
        assert!(under_way > 0, "the last have not had the time");
        for packet in of {
            if let Some(End::Sent { due, .. }) = packet.end {
                assert!(due.saturating_since(packet.sent) > Duration::from_millis(30));
            }
        }
    }
    let causes = |cause: Cause| {
        let of = all.iter();
        let of = of.filter(|packet| packet.packet.cause == cause.name());
        of.filter(|packet| packet.packet.fate == "sent").count() as u64
    };
    let updates = world.outcome().updates;
    let sent: u64 = Cause::ALL.into_iter().map(causes).sum();
    assert!(sent > 0 && sent <= updates.total());
}

#[test]
fn a_packet_whose_copy_comes_through_has_come() {
    let fates = |words: &str| {
        let config = over(words, 3);
        let mut world = World::try_new(&config).unwrap().with_packets();
        world.run(Duration::from_secs(4), |_| {});
        let all = world.packets();
        let ends = all.iter().filter_map(|packet| packet.end);
        let lost = ends.filter(|end| matches!(end, End::Dropped(_))).count();
        (lost, all.len())
    };
    let (lost, of) = fates("delay 10ms loss 30%");
    let (lost_twice, of_copied) = fates("delay 5ms duplicate 100%; then delay 5ms loss 30%");
    assert!(10 * lost > 2 * of, "{lost} of {of}");
    assert!(
        10 * lost_twice < 2 * of_copied,
        "{lost_twice} of {of_copied}"
    );
}
