//! What the slave's end sends again, and what it takes for new.

mod standing;

use super::*;
use crate::slave::SlaveConfig;
use mmt_shared::fixtures::square_at_rest;
use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::{Face, Vec2};
use mmt_shared::model::sample::{HipCounts, HipSample};
use mmt_shared::model::tool::HandPort;
use mmt_shared::model::update::Cause;
use mmt_shared::wire::{DATAGRAM_MAX, SampleBlock};

const AT: fn(u64) -> Time = Time::from_millis;

fn update(sequence: u32, cause: Cause) -> Update {
    Update {
        sequence,
        cause,
        answers: AT(1),
        touched_face: Some(Face::West),
        state: square_at_rest(0.7, 3.0, 2.06, 0.4),
    }
}

fn end(repeats: &str, architecture: Architecture, scene_hz: u8) -> SlaveEnd {
    let coupling = Coupling::for_stiffness(1000.0);
    let slave = Slave::try_new(&SlaveConfig::default(), coupling).unwrap();
    let config = SlaveEndConfig {
        repeats: repeats.parse().unwrap(),
        stretch_max: StretchMax::RECOMMENDED,
        samples_per_command: 10,
        architecture,
        scene_hz,
    };
    SlaveEnd::new(Time::ZERO, slave, config)
}

/// What the end sends at `now`, as the master reads it.
fn sent(end: &mut SlaveEnd, master: &mut DatagramChannel, now: Time) -> Vec<Message> {
    let mut out = [0; DATAGRAM_MAX];
    let mut all = Vec::new();
    while let Some(length) = end.poll_transmit(now, &mut out).unwrap() {
        all.push(master.handle(now, &out[..length]).unwrap().message);
    }
    all
}

/// The times (ms, 1 to 100) at which an update leaves, and its sequence.
fn updates(end: &mut SlaveEnd, mut before: impl FnMut(u64, &mut SlaveEnd)) -> Vec<(u64, u32)> {
    let mut master = DatagramChannel::new(Side::Master, Time::ZERO);
    let mut all = Vec::new();
    for ms in 1..=100 {
        before(ms, end);
        for matter in sent(end, &mut master, AT(ms)) {
            if let Message::Update(raw) = matter {
                all.push((ms, raw.sequence));
            }
        }
    }
    all
}

/// A command with samples of these stamps (ms).
fn command(
    master: &mut DatagramChannel,
    now: u64,
    stamps: std::ops::RangeInclusive<u64>,
    newest_update: u32,
    port: Option<HandPort>,
) -> Vec<u8> {
    let mut samples = SampleBlock::default();
    for ms in stamps {
        let stamp = AT(ms);
        samples
            .push(HipSample {
                stamp,
                ..HipSample::default()
            })
            .unwrap();
    }
    let command = Command {
        newest_update,
        samples,
        port,
    };
    let mut bytes = [0; DATAGRAM_MAX];
    let length = master.encode(AT(now), Message::Command(command), &mut bytes);
    bytes[..length.unwrap().unwrap()].to_vec()
}

#[test]
fn an_update_is_repeated_at_its_times_with_its_sequence_and_counted_by_its_cause() {
    let mut end = end("10ms 30ms", Architecture::Mmt, 0);
    let sent = updates(&mut end, |ms, end| {
        if ms == 5 {
            end.update = Some(update(1, Cause::Timer));
        }
    });
    assert_eq!(sent, [(5, 1), (15, 1), (35, 1)]);
    let counts = end.counts();
    assert_eq!(counts.repeated.of(Cause::Timer), 2);
    assert_eq!((counts.updates.total(), counts.repeated.total()), (1, 2));
    assert_eq!(end.channel().counts().sent.updates, 3, "repeats included");
}

#[test]
fn a_newer_update_takes_the_place_of_the_repeats_of_the_one_before() {
    let mut end = end("10ms 30ms", Architecture::Mmt, 0);
    let sent = updates(&mut end, |ms, end| match ms {
        5 => end.update = Some(update(1, Cause::Timer)),
        20 => end.update = Some(update(2, Cause::Deadband)),
        _ => {}
    });
    assert_eq!(sent, [(5, 1), (15, 1), (20, 2), (30, 2), (50, 2)]);
}

#[test]
fn what_the_master_has_is_not_repeated_and_without_times_nothing_is() {
    let mut with = end("10ms 30ms", Architecture::Mmt, 0);
    let mut master = DatagramChannel::new(Side::Master, Time::ZERO);
    let has_it = command(&mut master, 20, 1..=1, 1, None);
    let sent = updates(&mut with, |ms, end| match ms {
        5 => end.update = Some(update(1, Cause::Timer)),
        20 => end.handle_datagram(AT(ms), &has_it),
        _ => {}
    });
    assert_eq!(sent, [(5, 1), (15, 1)]);

    let mut without = end("none", Architecture::Mmt, 0);
    let sent = updates(&mut without, |ms, end| {
        if ms == 5 {
            end.update = Some(update(1, Cause::Timer));
        }
    });
    assert_eq!((sent, without.repeat_due()), (vec![(5, 1)], None));
}

#[test]
fn one_that_is_asked_for_late_is_sent_once() {
    let mut end = end("10ms 30ms", Architecture::Mmt, 0);
    let mut master = DatagramChannel::new(Side::Master, Time::ZERO);
    end.update = Some(update(1, Cause::Timer));
    assert_eq!(sent(&mut end, &mut master, AT(0)).len(), 1);
    assert_eq!(end.poll_timeout(), AT(10));
    assert_eq!(sent(&mut end, &mut master, AT(70)).len(), 1);
    assert_eq!(end.repeat_due(), None);
    assert_eq!(end.poll_timeout(), AT(120), "the heartbeat");
}

#[test]
fn only_the_new_samples_of_a_command_acknowledge() {
    // the shadow takes the update for known from the sample that acknowledges it
    let known_after = |stamps: std::ops::RangeInclusive<u64>| {
        let mut end = end("none", Architecture::Mmt, 0);
        let mut master = DatagramChannel::new(Side::Master, Time::ZERO);
        end.handle_datagram(AT(20), &command(&mut master, 20, stamps, 7, None));
        end.counts().samples
    };
    assert_eq!((known_after(1..=20), known_after(11..=20)), (20, 10));
}

#[test]
fn a_port_counts_in_the_newest_command_only_and_where_the_hello_has_spoken_of_one() {
    let port = |in_j| Some(HandPort { in_j });
    let mut master = DatagramChannel::new(Side::Master, Time::ZERO);
    let first = command(&mut master, 1, 1..=1, 0, port(0.1));
    let second = command(&mut master, 2, 2..=2, 0, port(0.2));
    let feels = |end: &mut SlaveEnd| {
        (3..60).any(|ms| end.tick(AT(ms), &SlaveGiven::default()).is_some() && end.tool.is_some())
    };
    let mut late = end("none", Architecture::Tdpa, 0);
    late.handle_datagram(AT(3), &command(&mut master, 3, 1..=1, 0, None));
    late.handle_datagram(AT(3), &first);
    assert!(!feels(&mut late), "overtaken");
    assert_eq!(late.half(1.0).session.drops["messages_overtaken"], 1);
    assert_eq!(late.counts().samples, 2, "its sample counts");
    let mut newest = end("none", Architecture::Tdpa, 0);
    newest.handle_datagram(AT(3), &second);
    assert!(feels(&mut newest));
    let mut never = end("none", Architecture::Mmt, 0);
    never.handle_datagram(AT(3), &second);
    assert!(!feels(&mut never));
    assert_eq!(never.counts().messages_overtaken, 0);
}

#[test]
fn the_tools_state_goes_out_every_tick_and_stands_for_the_heartbeat() {
    let mut end = end("none", Architecture::Tdpa, 0);
    let mut master = DatagramChannel::new(Side::Master, Time::ZERO);
    let bytes = command(&mut master, 1, 1..=10, 0, Some(HandPort::default()));
    end.handle_datagram(AT(1), &bytes);
    let mut tools = 0;
    for ms in 1..=30 {
        end.tick(AT(ms), &SlaveGiven::default());
        for matter in sent(&mut end, &mut master, AT(ms)) {
            tools += u32::from(matches!(matter, Message::Tool(_)));
        }
    }
    assert!(tools > 10, "{tools}");
    assert_eq!(end.channel().heartbeat_due(), AT(80));
}

#[test]
fn scenes_are_due_as_often_as_somebody_wants_to_see_them() {
    let mut end = end("none", Architecture::Mmt, 20);
    let mut master = DatagramChannel::new(Side::Master, Time::ZERO);
    assert_eq!(end.scene_due(), Some(AT(50)));
    let heartbeat = sent(&mut end, &mut master, AT(50));
    assert_eq!(
        heartbeat,
        [Message::Heartbeat],
        "nothing to see before a tick"
    );
    let bytes = command(&mut master, 51, 1..=10, 0, None);
    end.handle_datagram(AT(51), &bytes);
    for ms in 52..100 {
        end.tick(AT(ms), &SlaveGiven::default());
    }
    assert_eq!(end.scene_due(), Some(AT(100)));
    let scene = sent(&mut end, &mut master, AT(100));
    let scenes = scene.iter().filter(|m| matches!(m, Message::Scene(_)));
    assert_eq!(scenes.count(), 1, "{scene:?}");
    assert_eq!(end.scene_due(), Some(AT(150)));
    let nobody = self::end("none", Architecture::Mmt, 0);
    assert_eq!(nobody.scene_due(), None);
}

/// As the stamp of a broken record may be.
#[test]
fn at_the_end_of_time_what_is_to_be_sent_has_an_end() {
    let mut end = end("10ms 30ms", Architecture::Mmt, 20);
    let mut master = DatagramChannel::new(Side::Master, Time::ZERO);
    let bytes = command(&mut master, 1, 1..=10, 0, None);
    end.handle_datagram(AT(1), &bytes);
    for ms in 2..50 {
        end.tick(AT(ms), &SlaveGiven::default());
    }
    assert!(end.scene.is_some());
    let mut out = [0; DATAGRAM_MAX];
    let sent = std::iter::from_fn(|| end.poll_transmit(Time::MAX, &mut out).unwrap());
    assert!(sent.take(10).count() < 10);
}

#[test]
fn each_update_that_a_tick_made_is_sent_superseded_or_unsent() {
    let mut config = SlaveConfig::default();
    config.trigger.scheme = "every-sample".parse().unwrap();
    let mut end = end("none", Architecture::Mmt, 0);
    end.slave = Slave::try_new(&config, Coupling::for_stiffness(1000.0)).unwrap();
    let mut master = DatagramChannel::new(Side::Master, Time::ZERO);
    let mut made = 0;
    for ms in 1..=400 {
        // what is there leaves every 7 ms until 350 ms
        if ms % 10 == 0 {
            let bytes = command(&mut master, ms, ms - 9..=ms, 0, None);
            end.handle_datagram(AT(ms), &bytes);
        }
        made += u64::from(
            end.tick(AT(ms), &SlaveGiven::default())
                .is_some_and(|tick| tick.update.is_some()),
        );
        if ms % 7 == 0 && ms <= 350 {
            sent(&mut end, &mut master, AT(ms));
        }
    }
    let half = end.half(0.4);
    let [superseded, unsent] =
        ["updates_superseded", "updates_unsent"].map(|name| half.session.drops[name]);
    assert!(
        made > 0 && superseded > 0 && unsent > 0,
        "the law has work to do"
    );
    assert_eq!(half.updates.sent, Some(made - superseded - unsent));
}

#[test]
fn an_acknowledgement_of_what_never_left_silences_nothing_and_is_counted() {
    let mut end = end("10ms 30ms", Architecture::Mmt, 0);
    let mut master = DatagramChannel::new(Side::Master, Time::ZERO);
    let sent = updates(&mut end, |ms, end| match ms {
        5 => end.update = Some(update(1, Cause::Timer)),
        8 => {
            let command = command(&mut master, 8, 1..=10, u32::MAX, None);
            end.handle_datagram(AT(8), &command);
        }
        _ => {}
    });
    assert_eq!(sent, [(5, 1), (15, 1), (35, 1)]);
    assert_eq!(end.counts().acknowledgements_implausible, 1);
}
