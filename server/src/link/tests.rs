//! What the slave's end says again, and what it takes for news.

use super::*;
use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::{BoxFootprint, Pose, Twist, Vec2};
use mmt_shared::model::params::{ModelParams, ModelState};
use mmt_shared::model::sample::ForceCounts;
use mmt_shared::model::tool::HandPort;
use mmt_shared::model::update::Cause;
use mmt_shared::wire::{DATAGRAM_MAX, SampleBlock};

const AT: fn(u64) -> Time = Time::from_millis;

fn update(sequence: u32, cause: Cause) -> Update {
    let coupling = Coupling::for_stiffness(1000.0);
    let params = ModelParams::of_square(0.7, 3.0, 2.06, 0.4, &coupling).unwrap();
    let footprint = BoxFootprint::square(0.4);
    let state = ModelState::try_new(params, footprint, Pose::default(), Twist::default());
    Update {
        sequence,
        cause,
        answers: AT(1),
        slave_in_contact: true,
        state: state.unwrap(),
    }
}

fn link(repeats: &str) -> SlaveLink {
    link_of(repeats, Architecture::Mmt)
}

fn link_of(repeats: &str, architecture: Architecture) -> SlaveLink {
    let config = SlaveLinkConfig {
        repeats: repeats.parse().unwrap(),
        stretch_max: StretchMax::RECOMMENDED,
        samples_per_command: 10,
        architecture,
        scene_hz: 0,
    };
    SlaveLink::new(Time::ZERO, config)
}

/// The times (ms, 1 to 100) at which a repeat leaves, and the sequence that a master reads from it.
fn repeats(link: &mut SlaveLink, mut before: impl FnMut(u64, &mut SlaveLink)) -> Vec<(u64, u32)> {
    let mut master = LinkEnd::new(Side::Master, Time::ZERO);
    let mut out = [0; DATAGRAM_MAX];
    let mut sent = Vec::new();
    for ms in 1..=100 {
        before(ms, link);
        while let Some(length) = link.repeat(AT(ms), &mut out).unwrap() {
            let Message::Update(raw) = master.open(AT(ms), &out[..length]).unwrap().message else {
                panic!("no update");
            };
            sent.push((ms, raw.sequence));
        }
    }
    sent
}

/// Sends `update` at its time.
fn send(link: &mut SlaveLink, now: u64, update: &Update) {
    link.send_update(AT(now), update, &mut [0; DATAGRAM_MAX])
        .unwrap();
}

#[test]
fn an_update_is_repeated_at_its_times_with_its_sequence_and_counted_by_its_cause() {
    let mut link = link("10ms 30ms");
    let sent = repeats(&mut link, |ms, link| {
        if ms == 5 {
            send(link, ms, &update(1, Cause::Timer));
        }
    });
    assert_eq!(sent, [(15, 1), (35, 1)]);
    assert_eq!(link.repeated().of(Cause::Timer), 2);
    assert_eq!(link.repeated().total(), 2);
    assert_eq!(link.end().traffic().sent.updates, 3, "repeats included");
}

#[test]
fn a_newer_update_takes_the_place_of_the_repeats_of_the_one_before() {
    let mut link = link("10ms 30ms");
    let sent = repeats(&mut link, |ms, link| match ms {
        5 => send(link, ms, &update(1, Cause::Timer)),
        20 => send(link, ms, &update(2, Cause::Deadband)),
        _ => {}
    });
    assert_eq!(sent, [(15, 1), (30, 2), (50, 2)]);
}

#[test]
fn what_the_master_has_is_not_repeated_and_without_times_nothing_is() {
    let mut with = link("10ms 30ms");
    let mut master = LinkEnd::new(Side::Master, Time::ZERO);
    let mut bytes = [0; DATAGRAM_MAX];
    let mut block = SampleBlock::new();
    block.push(HipSample::default()).unwrap();
    let command = Command {
        newest_update: 1,
        samples: block,
        port: None,
    };
    let length = master.seal(AT(20), Message::Command(command), &mut bytes);
    let length = length.unwrap();
    let sent = repeats(&mut with, |ms, link| match ms {
        5 => send(link, ms, &update(1, Cause::Timer)),
        20 => assert!(link.handle(AT(ms), &bytes[..length]).is_some()),
        _ => {}
    });
    assert_eq!(sent, [(15, 1)]);

    let mut without = link("none");
    let sent = repeats(&mut without, |ms, link| {
        if ms == 5 {
            send(link, ms, &update(1, Cause::Timer));
        }
    });
    assert_eq!((sent, without.repeat_due()), (vec![], None));
}

#[test]
fn one_that_is_asked_for_late_is_sent_once() {
    let mut link = link("10ms 30ms");
    send(&mut link, 0, &update(1, Cause::Timer));
    let mut out = [0; DATAGRAM_MAX];
    assert!(link.repeat(AT(70), &mut out).unwrap().is_some());
    assert_eq!(link.repeat(AT(70), &mut out), Ok(None));
    assert_eq!(link.repeat_due(), None);
}

#[test]
fn only_the_news_of_a_command_acknowledge() {
    let mut block = SampleBlock::new();
    for ms in 1..=20 {
        let stamp = AT(ms);
        block
            .push(HipSample {
                stamp,
                ..HipSample::default()
            })
            .unwrap();
    }
    let command = Command {
        newest_update: 7,
        samples: block,
        port: None,
    };
    let link = link("none");
    let said: Vec<(u64, u32)> = link
        .samples(&command)
        .map(|(sample, newest)| (sample.stamp.as_nanos() / 1_000_000, newest))
        .collect();
    let expected: Vec<(u64, u32)> = (1..=20)
        .map(|ms| (ms, if ms <= 10 { 0 } else { 7 }))
        .collect();
    assert_eq!(said, expected);
}

#[test]
fn a_port_counts_in_the_newest_command_only_and_where_the_hello_has_spoken_of_one() {
    let port = |in_j| Some(HandPort { in_j });
    let mut master = LinkEnd::new(Side::Master, Time::ZERO);
    let mut command = |ms, port| {
        let mut samples = SampleBlock::new();
        let stamp = AT(ms);
        let sample = HipSample {
            stamp,
            ..HipSample::default()
        };
        samples.push(sample).unwrap();
        let command = Command {
            newest_update: 0,
            samples,
            port,
        };
        let mut bytes = [0; DATAGRAM_MAX];
        let length = master.seal(AT(ms), Message::Command(command), &mut bytes);
        bytes[..length.unwrap()].to_vec()
    };
    let (first, second) = (command(1, port(0.1)), command(2, port(0.2)));
    let mut feels = link_of("none", Architecture::Tdpa);
    let taken = feels.handle(AT(3), &second).unwrap();
    assert_eq!(taken.port, port(0.2));
    let late = feels.handle(AT(4), &first).unwrap();
    assert_eq!(
        (late.port, late.samples.len()),
        (None, 1),
        "its sample counts"
    );
    let mut never = link("none");
    assert_eq!(never.handle(AT(3), &second).unwrap().port, None);
}

#[test]
fn the_tools_state_stands_for_the_heartbeat() {
    let tool = Tool {
        answers: AT(7),
        force: ForceCounts::default(),
        in_contact: false,
        in_j: 0.25,
    };
    let mut link = link_of("none", Architecture::Tdpa);
    let mut master = LinkEnd::new(Side::Master, Time::ZERO);
    let mut out = [0; DATAGRAM_MAX];
    let length = link.send_tool(AT(40), &tool, &mut out).unwrap();
    let opened = master.open(AT(50), &out[..length]).unwrap();
    assert_eq!(opened.message, Message::Tool(tool));
    assert_eq!(link.end().heartbeat_due(), AT(90));
    assert_eq!(link.end().traffic().sent.tools, 1);
}

#[test]
fn scenes_are_due_as_often_as_somebody_wants_to_see_them() {
    let config = SlaveLinkConfig {
        scene_hz: 20,
        ..link("none").config
    };
    let mut link = SlaveLink::new(Time::ZERO, config);
    let scene = Scene {
        answers: AT(40),
        object: Pose::new(0.1, 0.0, 0.2),
        tool: Vec2::new(-0.1, 0.0),
        force: Vec2::new(2.0, 0.0),
    };
    let mut master = LinkEnd::new(Side::Master, Time::ZERO);
    let mut out = [0; DATAGRAM_MAX];
    assert_eq!(link.scene_due(), Some(AT(50)));
    let length = link.send_scene(AT(50), Some(&scene), &mut out);
    let length = length.unwrap().unwrap();
    let opened = master.open(AT(50), &out[..length]).unwrap();
    assert_eq!(opened.message, Message::Scene(scene));
    assert_eq!(link.scene_due(), Some(AT(100)));
    assert_eq!(
        link.send_scene(AT(100), None, &mut out),
        Ok(None),
        "nothing to see"
    );
    assert_eq!(link.scene_due(), Some(AT(150)));
    assert_eq!(self::link("none").scene_due(), None, "nobody looks");
}
