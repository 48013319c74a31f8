//! What an observer sees of a session, and what it sends.

use std::time::Duration;

use mmt_shared::fixtures::{square_at_rest, update};
use mmt_shared::model::geometry::{Twist, Vec2};
use mmt_shared::model::params::ModelParams;
use mmt_shared::model::settings::{Mode, checked_coupling};
use mmt_shared::model::tool::TOOL_FORCE_MAX_N;
use mmt_shared::pairing::Token;
use mmt_shared::wire::{DATAGRAM_MAX, Label};

use super::*;

const AT: fn(u64) -> Time = Time::from_millis;

fn state(m: f64) -> ModelState {
    square_at_rest(m, 3.0, 2.0, 0.4)
}

fn observer() -> ObserverEnd {
    let welcome = Welcome {
        settings: Mode::Recommended.model_settings(COUPLING),
        state: state(0.4),
        tool: Vec2::zeros(),
        tool_force_max_n: TOOL_FORCE_MAX_N,
        resume: Token::new([0; 32]),
        scheme: Label::clipped("none"),
        program: Label::clipped("test"),
    };
    ObserverEnd::new(AT(0), &welcome)
}

/// The slave's side.
struct Slave(DatagramChannel);

impl Slave {
    fn new() -> Self {
        Self(DatagramChannel::new(Side::Slave, AT(0)))
    }

    fn say(&mut self, now: Time, message: Message) -> Vec<u8> {
        let mut out = [0; DATAGRAM_MAX];
        let length = self.0.encode(now, message, &mut out).unwrap();
        out[..length.unwrap()].to_vec()
    }

    fn update(&mut self, sequence: u32, cause: Cause, m: f64) -> Vec<u8> {
        let update = update(sequence, cause, 7, state(m));
        self.say(AT(1), Message::Update((&update).into()))
    }

    fn scene(&mut self, now: Time, tool_x: f64) -> Vec<u8> {
        self.scene_with(now, tool_x, Vec2::zeros())
    }

    fn scene_with(&mut self, now: Time, tool_x: f64, force: Vec2) -> Vec<u8> {
        let scene = Scene {
            answers: AT(9),
            object: Pose::default(),
            tool: Vec2::new(tool_x, 0.0),
            force,
        };
        self.say(now, Message::Scene(scene))
    }
}

#[test]
fn an_observer_shows_the_newest_update_counts_each_once_and_what_it_changed() {
    let (mut slave, mut observer) = (Slave::new(), observer());
    assert_eq!(
        observer.live(AT(1)).params,
        [0.4, 3.0, 2.0],
        "the welcome's"
    );
    let first = slave.update(1, Cause::Timer, 0.5);
    let old = slave.update(2, Cause::Timer, 0.6);
    let third = slave.update(3, Cause::Deadband, 0.7);
    let again = slave.update(3, Cause::Deadband, 0.7);
    for datagram in [&first, &third, &old, &again, &third] {
        observer.handle_datagram(AT(2), datagram);
    }
    let live = observer.live(AT(3));
    assert_eq!(live.params, [0.7, 3.0, 2.0]);
    assert!(live.in_contact && live.footprint.is_some());
    assert_eq!(live.updates, [1, 1, 0, 0, 0, 0, 0]);
    let change = live.change.unwrap();
    assert_eq!((change.sequence, change.cause), (3, Cause::Deadband));
    assert!((change.params[0] - 0.2).abs() < 1e-12, "{change:?}");
    let updates = observer.half(1.0).updates;
    assert_eq!(updates.applied, Some(2));
    let dropped = updates.dropped.unwrap();
    let of = |name| dropped.get(name).copied();
    assert_eq!((of("stale"), of("duplicate")), (Some(1), Some(1)));
}

#[test]
fn an_observer_sends_heartbeats_and_nothing_else() {
    let (mut slave, mut observer) = (Slave::new(), observer());
    let mut out = [0; DATAGRAM_MAX];
    for ms in 1..=1000 {
        let datagram = slave.update(ms, Cause::EverySample, 0.5);
        observer.handle_datagram(AT(ms.into()), &datagram);
        while let Some(length) = observer.poll_transmit(AT(ms.into()), &mut out).unwrap() {
            let sent = slave.0.handle(AT(ms.into()), &out[..length]);
            assert_eq!(sent.unwrap().message, Message::Heartbeat);
        }
    }
    assert_eq!(slave.0.counts().received.heartbeats, 20);
    assert_eq!(observer.live(AT(1000)).updates[5], 1000);
}

#[test]
fn at_the_end_of_time_what_is_to_be_sent_has_an_end() {
    let mut end = observer();
    let mut out = [0; DATAGRAM_MAX];
    let sent = std::iter::from_fn(|| end.poll_transmit(Time::MAX, &mut out).unwrap());
    assert!(sent.take(10).count() < 10);
}

#[test]
fn whatever_an_operators_device_accepts_an_observer_shows() {
    let softer = Coupling {
        stiffness_n_per_m: COUPLING.stiffness_n_per_m.next_down(),
        ..COUPLING
    };
    let looser = Coupling {
        damping_ns_per_m: -f64::MIN_POSITIVE,
        ..COUPLING
    };
    assert!(checked_coupling(&COUPLING).is_ok(), "it is the least");
    assert!(checked_coupling(&softer).is_err() && checked_coupling(&looser).is_err());
    // the lightest box of the stiffest device, and one that only the softest has
    let stiffest = Coupling {
        stiffness_n_per_m: 10_000.0,
        damping_ns_per_m: 100.0,
    };
    let params = ModelParams::of_square(1.0, 3.0, 2.0, 0.4, &stiffest).unwrap();
    let (footprint, pose) = (BoxFootprint::square(0.4), Pose::default());
    let state = ModelState::try_new(params, footprint, pose, Twist::default(), &stiffest).unwrap();
    let (mut slave, mut observer) = (Slave::new(), observer());
    let update = update(1, Cause::Timer, 7, state);
    let datagram = slave.say(AT(1), Message::Update((&update).into()));
    observer.handle_datagram(AT(2), &datagram);
    assert_eq!(observer.state(), &state);
}

#[test]
fn the_newest_scene_is_shown_with_its_age_and_an_older_one_never() {
    let (mut slave, mut observer) = (Slave::new(), observer());
    assert_eq!(observer.live(AT(50)).scene_age_s, None);
    let (old, new) = (slave.scene(AT(1), 1.0), slave.scene(AT(2), 2.0));
    observer.handle_datagram(AT(100), &new);
    observer.handle_datagram(AT(101), &old);
    let live = observer.live(AT(350));
    assert_eq!(live.scene.unwrap().tool.x, 2.0);
    let age = Duration::from_secs_f64(live.scene_age_s.unwrap());
    assert_eq!(age, Duration::from_millis(250));
}

#[test]
fn contact_ends_and_begins_for_an_observer_with_the_scene_without_any_update() {
    let (mut slave, mut observer) = (Slave::new(), observer());
    observer.handle_datagram(AT(1), &slave.update(1, Cause::Timer, 0.5));
    assert!(observer.live(AT(2)).in_contact, "the update's");
    observer.handle_datagram(AT(3), &slave.scene(AT(3), 1.0));
    assert!(!observer.live(AT(4)).in_contact);
    let touching = slave.scene_with(AT(5), 1.0, Vec2::new(0.2, 0.0));
    observer.handle_datagram(AT(5), &touching);
    assert!(observer.live(AT(6)).in_contact);
}

#[test]
fn an_emergency_stop_and_a_silent_link_are_shown() {
    let (mut slave, mut observer) = (Slave::new(), observer());
    slave.0.stop(true);
    let beat = slave.say(AT(1), Message::Heartbeat);
    observer.handle_datagram(AT(2), &beat);
    let live = observer.live(AT(3));
    assert!(live.stopped);
    assert_eq!(live.link, LinkState::Fresh);
    assert_eq!(observer.live(AT(300)).link, LinkState::Stale);
}
