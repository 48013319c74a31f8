//! What a command holds: news, repeats, and what congestion leaves of both.

use super::*;
use mmt_shared::model::geometry::{Pose, Vec2};
use mmt_shared::model::sample::{ForceCounts, HipCounts};
use mmt_shared::time::TICK;
use mmt_shared::wire::DATAGRAM_MAX;

fn sample(ms: u64) -> HipSample {
    let hip = HipCounts { x: ms as i32, y: 0 };
    HipSample {
        stamp: Time::from_millis(ms),
        hip,
        ..HipSample::default()
    }
}

fn link(samples_per_command: u8, repeat_samples: u8) -> MasterLink {
    let config = CommandConfig {
        samples_per_command,
        repeat_samples,
        ..CommandConfig::default()
    };
    MasterLink::new(Time::ZERO, Coupling::for_stiffness(1000.0), config)
}

/// The stamps (ms) of each command that the samples of `ms` make, as the slave reads them.
fn commands(link: &mut MasterLink, ms: impl IntoIterator<Item = u64>) -> Vec<Vec<u64>> {
    coupled_commands(link, ms, None)
}

/// The same, of a master whose port says this.
fn coupled_commands(
    link: &mut MasterLink,
    ms: impl IntoIterator<Item = u64>,
    port: Option<HandPort>,
) -> Vec<Vec<u64>> {
    let mut slave = LinkEnd::new(Side::Slave, Time::ZERO);
    let mut out = [0; DATAGRAM_MAX];
    let mut all = Vec::new();
    for ms in ms {
        let now = Time::from_millis(ms);
        let Some(length) = link.send(now, sample(ms), port, &mut out).unwrap() else {
            continue;
        };
        let opened = slave.open(now, &out[..length]).unwrap();
        let Message::Command(command) = opened.message else {
            panic!("no command");
        };
        assert_eq!(command.port, port);
        let samples = command.samples.as_slice().iter();
        all.push(
            samples
                .inspect(|sample| {
                    assert_eq!(sample.hip.x as u64 * 1_000_000, sample.stamp.as_nanos())
                })
                .map(|sample| sample.stamp.as_nanos() / 1_000_000)
                .collect(),
        );
    }
    all
}

#[test]
fn a_command_repeats_the_samples_of_as_many_commands_as_it_is_told() {
    let none = commands(&mut link(3, 0), 1..=9);
    assert_eq!(none, [[1, 2, 3], [4, 5, 6], [7, 8, 9]]);
    let one = commands(&mut link(3, 1), 1..=9);
    assert_eq!(one, [vec![1, 2, 3], (1..=6).collect(), (4..=9).collect()]);
    let two = commands(&mut link(2, 2), 1..=8);
    assert_eq!(
        two[1..],
        [vec![1, 2, 3, 4], (1..=6).collect(), (3..=8).collect()]
    );
}

#[test]
fn where_the_hand_feels_the_tool_each_sample_goes_alone_with_the_hands_port() {
    let port = Some(HandPort { in_j: 0.5 });
    let mut link = link(3, 1);
    link.config = link.config.for_architecture(Architecture::Tdpa);
    let alone = coupled_commands(&mut link, 1..=4, port);
    assert_eq!(alone, [[1], [2], [3], [4]]);
    let default = CommandConfig::default();
    assert_eq!(default.for_architecture(Architecture::Mmt), default);
}

#[test]
fn a_command_holds_its_news_and_as_many_repeats_as_there_is_room_for() {
    let full = commands(&mut link(32, 1), 1..=64);
    assert_eq!(full[1], (33..=64).collect::<Vec<_>>());
    let most = commands(&mut link(20, 1), 1..=60);
    assert_eq!(
        most[2],
        (29..=60).collect::<Vec<_>>(),
        "twelve repeats and twenty news"
    );
    assert_eq!(link(20, 1).config.samples_at_most(), 32);
    assert_eq!(link(10, 1).config.samples_at_most(), 20);
}

#[test]
fn stamps_that_go_back_are_no_news_and_leave_no_mixed_command() {
    let mut link = link(2, 1);
    let all = commands(&mut link, [5, 6, 3, 4, 7, 8]);
    // 3 and 4 begin a command that the stamps before do not fit
    assert_eq!(all, [vec![5, 6], vec![3, 4], vec![3, 4, 7, 8]]);
}

#[test]
fn congestion_spaces_the_samples_leaves_the_repeats_out_and_goes() {
    let mut link = link(3, 1);
    assert_eq!(commands(&mut link, 1..=3).len(), 1);
    // round trips of 300 ms after one of 10 ms, from a slave that answers the master's first datagram
    let mut slave = LinkEnd::new(Side::Slave, Time::ZERO);
    let mut out = [0; DATAGRAM_MAX];
    let mut hear = |link: &mut MasterLink, at: u64, took: u64| {
        let length = link
            .end
            .seal(Time::from_millis(at - took), Message::Heartbeat, &mut out);
        slave.open(Time::from_millis(at), &out[..length.unwrap()]);
        let length = slave.seal(Time::from_millis(at), Message::Heartbeat, &mut out);
        link.handle(Time::from_millis(at), &out[..length.unwrap()]);
    };
    hear(&mut link, 1010, 10);
    for at in (2000..3000).step_by(20) {
        hear(&mut link, at, 300);
    }
    assert_eq!(link.end().stretch(), 3.0);
    let all = commands(&mut link, 3000..=3020);
    // the first sample of the stretch is packed, then every third
    assert_eq!(all, [vec![3000, 3003, 3006], vec![3009, 3012, 3015]]);
    assert_eq!(link.samples_skipped(), 14);
    for at in (3100..20_000).step_by(20) {
        hear(&mut link, at, 10);
    }
    assert_eq!(link.end().stretch(), 1.0);
    let all = commands(&mut link, 20_000..=20_010);
    assert_eq!(all.last().unwrap().len(), 6, "repeats are back");
    assert_eq!(TICK.as_millis(), 1, "a sample is a tick");
}

#[test]
fn what_the_slave_sees_and_what_its_tool_feels_count_only_if_newer_than_all_before() {
    let scene = Scene {
        answers: Time::ZERO,
        object: Pose::default(),
        tool: Vec2::zeros(),
        force: Vec2::zeros(),
    };
    let tool = Tool {
        answers: Time::ZERO,
        force: ForceCounts::default(),
        in_contact: false,
        in_j: 0.0,
    };
    for message in [Message::Scene(scene), Message::Tool(tool)] {
        let (mut master, mut slave) = (link(10, 0), LinkEnd::new(Side::Slave, Time::ZERO));
        let mut seal = || {
            let mut out = [0; DATAGRAM_MAX];
            let length = slave.seal(Time::ZERO, message, &mut out).unwrap();
            out[..length].to_vec()
        };
        let (first, second) = (seal(), seal());
        assert!(master.handle(Time::ZERO, &second).is_some());
        assert_eq!(master.handle(Time::ZERO, &first), None, "overtaken");
    }
}
