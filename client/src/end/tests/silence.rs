//! What the master's end makes of a path that is slow, lossy or silent.

use std::ops::Range;

use super::*;

/// A session of so many ms over a path that takes `way(is_up, ms)` ms for what is sent then, or loses it; the slave sends
/// an update every 20 ms, and the master's host stands still for a while. Gives the link at each tick, the updates applied
/// by then and the loss up.
fn session(
    until: u64,
    stands_still: Range<u64>,
    way: impl Fn(bool, u64) -> Option<u64>,
) -> Vec<(LinkState, u64, f64)> {
    let mut end = end(CommandConfig::default(), Architecture::Mmt);
    let mut slave = DatagramChannel::new(Side::Slave, Time::ZERO);
    let (mut ups, mut downs) = (Vec::new(), Vec::new());
    let (mut sequence, mut answers) = (0, Time::ZERO);
    let mut seen = Vec::new();
    for ms in 1..=until {
        let mut out = [0; DATAGRAM_MAX];
        ups.retain(|(at, bytes): &(u64, Vec<u8>)| {
            let arrives = *at == ms;
            let message = arrives.then(|| slave.handle(AT(ms), bytes));
            if let Some(Message::Command(command)) = message.flatten().map(|of| of.message) {
                answers = command.samples.last().unwrap().stamp;
            }
            !arrives
        });
        if ms % 20 == 0 {
            sequence += 1;
            let update = Update {
                answers,
                ..update(sequence, 0.7)
            };
            let sent = datagram(&mut slave, AT(ms), Message::Update((&update).into()));
            downs.extend(way(false, ms).map(|takes| (ms + takes, sent)));
        }
        if stands_still.contains(&ms) {
            continue;
        }
        downs.retain(|(at, bytes): &(u64, Vec<u8>)| {
            let arrives = *at <= ms;
            if arrives {
                end.handle_datagram(AT(ms), bytes);
            }
            !arrives
        });
        let tick = end.tick(AT(ms), &MasterGiven::held_at(Vec2::new(-0.3, 0.0)));
        while let Some(length) = end.poll_transmit(AT(ms), &mut out).unwrap() {
            ups.extend(way(true, ms).map(|takes| (ms + takes, out[..length].to_vec())));
        }
        let loss = end.channel().peer().outgoing_at(AT(ms)).share();
        seen.push((
            tick.link,
            end.master().applied().iter().sum::<u64>(),
            loss.unwrap_or(0.0),
        ));
    }
    seen
}

/// Over a path of 20 ms each way whose way up, or down, carries nothing from `lost_from` ms on.
fn outage(up: bool, lost_from: u64) -> Vec<(LinkState, u64, f64)> {
    session(lost_from + 1500, 0..0, |is_up, ms| {
        (is_up != up || ms < lost_from).then_some(20)
    })
}

#[test]
fn a_path_that_becomes_slower_by_two_seconds_is_not_silent() {
    let slower = |_, ms: u64| Some(20 + ms.saturating_sub(1000).min(3000) / 3);
    let seen = session(8000, 0..0, slower);
    let worst = seen.iter().map(|(link, ..)| *link).max().unwrap();
    assert!(worst < LinkState::Stale, "{worst:?}");
    let (_, applied, loss) = seen[seen.len() - 1];
    assert!(applied > 300, "{applied} updates of 400");
    assert!(seen.iter().all(|(.., loss)| *loss < 0.01), "{loss}");
}

#[test]
fn a_host_that_stands_still_for_two_seconds_finds_its_link_as_it_was() {
    let seen = session(6000, 1000..3000, |_, _| Some(20));
    assert!(seen.iter().all(|(link, ..)| *link == LinkState::Fresh));
}

#[test]
fn a_link_that_is_silent_one_way_is_late_stale_and_released_in_time_whichever_way_it_is() {
    for up in [true, false] {
        let seen = outage(up, 1000);
        let first = |state| seen.iter().position(|(link, ..)| *link >= state).unwrap() as u64;
        // the last that came through arrives 20 ms after the outage begins, an answer after 40 ms
        let begins = if up { 1040 } else { 1020 };
        for (state, after) in [
            (LinkState::Late, 120),
            (LinkState::Stale, 250),
            (LinkState::Released, 1000),
        ] {
            let at = first(state);
            let (soonest, latest) = (begins + after - 40, begins + after + 20);
            assert!(
                (soonest..=latest).contains(&at),
                "up {up}: {state:?} at {at} ms"
            );
        }
    }
}

#[test]
fn while_the_way_up_is_lost_nothing_is_applied_and_the_loss_that_is_shown_rises() {
    let seen = outage(true, 1000);
    let stale = seen
        .iter()
        .position(|(link, ..)| *link >= LinkState::Stale)
        .unwrap();
    let (_, applied, loss) = seen[stale];
    assert!(applied > 40, "until then updates were applied: {applied}");
    let (_, at_the_end, worst) = seen[seen.len() - 1];
    assert_eq!(at_the_end, applied);
    assert!(seen[999].2 < 0.01, "no loss before: {}", seen[999].2);
    assert!(loss > 0.05 && worst > 2.0 * loss, "{loss} then {worst}");
}
