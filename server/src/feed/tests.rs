//! What an observer is sent: each update once, scenes at their rate, heartbeats.

use mmt_shared::fixtures::{square_at_rest, update};
use mmt_shared::model::geometry::{Pose, Vec2};
use mmt_shared::model::sample::HipSample;
use mmt_shared::model::update::Cause;
use mmt_shared::wire::{Command, DATAGRAM_MAX, RawState, SampleBlock};

use super::*;

const AT: fn(u64) -> Time = Time::from_millis;

/// Number and cause `n` of a session.
fn made(sequence: u32) -> Update {
    let cause = Cause::ALL[sequence as usize % Cause::ALL.len()];
    update(sequence, cause, 7, square_at_rest(0.7, 3.0, 2.0, 0.4))
}

fn view(session: u64, updates: impl IntoIterator<Item = u32>) -> ObserverView {
    let mut view = ObserverView {
        session,
        ..ObserverView::default()
    };
    for sequence in updates {
        view.updates.push(made(sequence));
    }
    view
}

fn scene(answers_ms: u64) -> Scene {
    Scene {
        answers: AT(answers_ms),
        object: Pose::default(),
        tool: Vec2::new(-0.3, 0.0),
        force: Vec2::zeros(),
    }
}

/// An observer that hears all that is sent to it.
struct Observer(DatagramChannel);

impl Observer {
    fn new() -> Self {
        Self(DatagramChannel::new(Side::Master, AT(0)))
    }

    fn hear(&mut self, now: Time, feed: &mut Feed) -> Vec<Message> {
        let mut out = [0; DATAGRAM_MAX];
        let mut heard = Vec::new();
        while let Some(length) = feed.poll_transmit(now, &mut out).unwrap() {
            let received = self.0.handle(now, &out[..length]);
            heard.push(received.unwrap().message);
        }
        heard
    }
}

fn updates(heard: Vec<Message>) -> Vec<Update<RawState>> {
    let update = |message| match message {
        Message::Update(update) => Some(update),
        _ => None,
    };
    heard.into_iter().filter_map(update).collect()
}

#[test]
fn an_observer_gets_each_update_once_in_order_and_from_then_on_the_newest_once_a_second() {
    let mut observer = Observer::new();
    let mut feed = Feed::new(AT(0), 0, &view(1, []));
    let heard = updates(observer.hear(AT(1), &mut feed));
    assert_eq!(heard, []);
    feed.show(&view(1, 1..=3));
    let heard = updates(observer.hear(AT(2), &mut feed));
    assert_eq!(heard, [1, 2, 3].map(|n| (&made(n)).into()));
    feed.show(&view(1, 1..=3));
    let all: Vec<_> = (3..=4003)
        .flat_map(|ms| updates(observer.hear(AT(ms), &mut feed)))
        .collect();
    assert_eq!(all, [3; 4].map(|n| (&made(n)).into()), "in four seconds");
}

#[test]
fn who_comes_late_begins_with_the_newest_and_who_misses_more_than_a_look_holds_goes_on_with_the_oldest_of_it()
 {
    let mut feed = Feed::new(AT(0), 0, &view(1, 1..=40));
    let mut observer = Observer::new();
    let bodies = |heard: Vec<Update<RawState>>| -> Vec<(u32, Cause)> {
        let of = |update: Update<RawState>| (update.sequence, update.cause);
        heard.into_iter().map(of).collect()
    };
    let first = bodies(updates(observer.hear(AT(1), &mut feed)));
    assert_eq!(first, [(1, made(40).cause)]);
    feed.show(&view(1, 1..=60));
    let after = bodies(updates(observer.hear(AT(2), &mut feed)));
    let kept = (53..=60).map(|n| made(n).cause);
    assert_eq!(after, (2..=9).zip(kept).collect::<Vec<_>>());
}

#[test]
fn the_next_operators_updates_go_on_with_the_observers_own_numbers() {
    let mut feed = Feed::new(AT(0), 0, &view(1, [1, 2]));
    let mut observer = Observer::new();
    feed.show(&view(2, []));
    assert_eq!(updates(observer.hear(AT(1), &mut feed)), []);
    feed.show(&view(2, [1]));
    let heard = updates(observer.hear(AT(2), &mut feed));
    assert_eq!(heard.len(), 1);
    feed.show(&view(3, [1, 2]));
    let heard = updates(observer.hear(AT(3), &mut feed));
    let numbers: Vec<_> = heard.iter().map(|update| update.sequence).collect();
    assert_eq!(numbers, [2, 3]);
}

#[test]
fn scenes_come_at_the_rate_that_was_asked_for_and_none_twice() {
    for (scene_hz, expected) in [(0, 0), (20, 20), (60, 60)] {
        let mut feed = Feed::new(AT(0), scene_hz, &view(1, []));
        let mut observer = Observer::new();
        let mut scenes = 0;
        for ms in 0..1000 {
            let scene = Some(scene(ms));
            feed.show(&ObserverView {
                scene,
                ..view(1, [])
            });
            let heard = observer.hear(AT(ms), &mut feed);
            scenes += heard
                .iter()
                .filter(|of| matches!(of, Message::Scene(_)))
                .count();
        }
        // each goes in the first tick in which it is due
        assert!(scenes <= expected && scenes + 3 > expected, "{scenes}");
        // the last one, which was not due yet
        observer.hear(AT(2000), &mut feed);
        let again = observer.hear(AT(3000), &mut feed);
        assert!(!again.iter().any(|of| matches!(of, Message::Scene(_))));
    }
}

#[test]
fn at_the_end_of_time_what_is_to_be_sent_has_an_end() {
    let mut feed = Feed::new(AT(0), 20, &view(1, [1]));
    feed.show(&ObserverView {
        scene: Some(scene(1)),
        ..view(1, [1])
    });
    let mut out = [0; DATAGRAM_MAX];
    let sent = std::iter::from_fn(|| feed.poll_transmit(Time::MAX, &mut out).unwrap());
    assert!(sent.take(10).count() < 10);
}

#[test]
fn while_nothing_happens_heartbeats_go_twenty_times_a_second_and_carry_the_stop() {
    let mut feed = Feed::new(AT(0), 20, &view(0, []));
    let mut observer = Observer::new();
    for ms in 1..=1000 {
        assert!(feed.poll_timeout() > AT(ms - 1));
        observer.hear(AT(ms), &mut feed);
    }
    assert_eq!(observer.0.counts().received.heartbeats, 20);
    assert_eq!(observer.0.stopped_by(), None);
    feed.show(&ObserverView {
        stopped: true,
        ..view(0, [])
    });
    observer.hear(AT(1050), &mut feed);
    assert_eq!(observer.0.stopped_by(), Some(Side::Slave));
}

#[test]
fn a_command_of_an_observer_is_counted_and_changes_nothing_that_is_sent() {
    let mut feed = Feed::new(AT(0), 20, &view(1, [1]));
    let mut samples = SampleBlock::default();
    samples.push(HipSample::default()).unwrap();
    let command = Command {
        newest_update: 1,
        samples,
        port: None,
    };
    let mut observer = Observer::new();
    let mut out = [0; DATAGRAM_MAX];
    let length = observer
        .0
        .encode(AT(1), Message::Command(command), &mut out)
        .unwrap();
    feed.handle_datagram(AT(1), &out[..length.unwrap()]);
    assert_eq!(feed.commands_refused(), 1);
    assert_eq!(feed.last_arrival(), AT(1), "it lives");
    // the update goes out though it was acknowledged, and again after a second
    assert_eq!(updates(observer.hear(AT(2), &mut feed)).len(), 1);
    assert_eq!(updates(observer.hear(AT(1002), &mut feed)).len(), 1);
}
