//! What the slave's end sends again, and what it takes for new.

use super::*;
use crate::slave::SlaveConfig;
use mmt_shared::fixtures::square_at_rest;
use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::Vec2;
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
        slave_in_contact: true,
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
    let feels =
        |end: &mut SlaveEnd| (3..60).any(|ms| end.tick(AT(ms)).is_some() && end.tool.is_some());
    let mut late = end("none", Architecture::Tdpa, 0);
    late.handle_datagram(AT(3), &command(&mut master, 3, 1..=1, 0, None));
    late.handle_datagram(AT(3), &first);
    assert!(!feels(&mut late), "overtaken");
    assert_eq!(late.counts().samples, 2, "its sample counts");
    let mut newest = end("none", Architecture::Tdpa, 0);
    newest.handle_datagram(AT(3), &second);
    assert!(feels(&mut newest));
    let mut never = end("none", Architecture::Mmt, 0);
    never.handle_datagram(AT(3), &second);
    assert!(!feels(&mut never));
}

#[test]
fn the_tools_state_goes_out_every_tick_and_stands_for_the_heartbeat() {
    let mut end = end("none", Architecture::Tdpa, 0);
    let mut master = DatagramChannel::new(Side::Master, Time::ZERO);
    let bytes = command(&mut master, 1, 1..=10, 0, Some(HandPort::default()));
    end.handle_datagram(AT(1), &bytes);
    let mut tools = 0;
    for ms in 1..=30 {
        end.tick(AT(ms));
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
        end.tick(AT(ms));
    }
    assert_eq!(end.scene_due(), Some(AT(100)));
    let scene = sent(&mut end, &mut master, AT(100));
    let scenes = scene.iter().filter(|m| matches!(m, Message::Scene(_)));
    assert_eq!(scenes.count(), 1, "{scene:?}");
    assert_eq!(end.scene_due(), Some(AT(150)));
    let nobody = self::end("none", Architecture::Mmt, 0);
    assert_eq!(nobody.scene_due(), None);
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
        made += u64::from(end.tick(AT(ms)).is_some_and(|tick| tick.update.is_some()));
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

/// Four seconds of commands of a HIP that is at `hand` (x, m; at each ms) or sends nothing. Before each tick `also` is done
/// with both ends; returns the slave's.
fn four_seconds(
    hand: impl Fn(u64) -> Option<f64>,
    mut also: impl FnMut(u64, &mut SlaveEnd, &mut DatagramChannel),
) -> SlaveEnd {
    let mut end = end("none", Architecture::Mmt, 0);
    let mut master = DatagramChannel::new(Side::Master, Time::ZERO);
    for ms in 1..=4000 {
        also(ms, &mut end, &mut master);
        if let Some(x) = hand(ms) {
            let mut samples = SampleBlock::default();
            let sample = HipSample {
                stamp: AT(ms),
                hip: HipCounts::nearest(Vec2::new(x, 0.0)),
                ..HipSample::default()
            };
            samples.push(sample).unwrap();
            let command = Message::Command(Command {
                newest_update: 0,
                samples,
                port: None,
            });
            let mut bytes = [0; DATAGRAM_MAX];
            let length = master.encode(AT(ms), command, &mut bytes).unwrap().unwrap();
            end.handle_datagram(AT(ms), &bytes[..length]);
        }
        end.tick(AT(ms));
    }
    end
}

/// A HIP that goes on at 0.1 m/s.
fn going_on(ms: u64) -> f64 {
    -1.0 + 1e-4 * ms as f64
}

/// The tool's place (m) after commands of a HIP that goes on and stop at 1 s for `gap` (ms).
fn place_after_gap(gap: u64) -> (f64, SlaveEnd) {
    let hand = |ms| (!(1001..=1000 + gap).contains(&ms)).then(|| going_on(ms));
    let end = four_seconds(hand, |_, _, _| {});
    (end.slave().tool_at().x, end)
}

#[test]
fn while_either_sides_emergency_stop_is_set_the_tool_stands() {
    for side in [Side::Slave, Side::Master] {
        let mut stood = Vec::new();
        let hand = |ms| Some(going_on(ms));
        let end = four_seconds(hand, |ms, slave, master| {
            let stops = (1000..3000).contains(&ms);
            match side {
                Side::Slave => slave.stop(stops),
                Side::Master => master.stop(stops),
            }
            if (1002..3000).contains(&ms) {
                assert_eq!(slave.stopped_by(), Some(side));
            }
            // it brakes from 0.1 m/s
            if (1007..3000).contains(&ms) {
                stood.push(slave.slave().tool_at().x);
            }
        });
        let first = stood[0];
        assert!((first - -0.9).abs() < 0.01, "{first} m");
        assert!(stood.iter().all(|x| *x == first), "it moves");
        // the hand went on 20 cm meanwhile: it has to come for the tool
        assert_eq!(end.stopped_by(), None);
        assert_eq!(end.slave().tool_at().x, first);
    }
}

#[test]
fn after_an_emergency_stop_the_tool_follows_a_hand_that_comes_for_it() {
    let back = |ms| if ms < 3500 { going_on(ms) } else { -0.9 };
    let hand = |ms| Some(back(ms) + if ms < 3800 { 0.0 } else { 0.05 });
    let mut waited = 0.0;
    let end = four_seconds(hand, |ms, slave, _| {
        slave.stop((1000..3000).contains(&ms));
        if ms == 3400 {
            waited = slave.slave().tool_at().x;
        }
    });
    assert!(
        (waited - -0.9).abs() < 0.01,
        "it went to the hand: {waited} m"
    );
    let x = end.slave().tool_at().x;
    assert!((x - -0.85).abs() < 1e-3, "{x} m");
}

#[test]
fn samples_that_come_after_two_seconds_of_none_move_nothing() {
    let (x, end) = place_after_gap(1999);
    assert!((x - -0.602).abs() < 0.01, "it follows again: {x} m");
    assert!(!end.is_disengaged());
    // a tick more, and the tool stands where it stopped
    let (x, end) = place_after_gap(2000);
    assert!((x - -0.9).abs() < 0.01, "{x} m");
    assert!(end.is_disengaged());
    assert_eq!(end.counts().samples_disengaged, 1000);
}

#[test]
fn a_stamp_of_hours_ahead_does_not_disengage_a_tool_whose_samples_go_on() {
    let ahead = |ms, slave: &mut SlaveEnd, master: &mut DatagramChannel| {
        if ms == 1000 {
            let stamps = 3_600_000..=3_600_000;
            slave.handle_datagram(AT(ms), &command(master, ms, stamps, 0, None));
        }
    };
    let end = four_seconds(|ms| Some(going_on(ms)), ahead);
    assert_eq!(end.slave().playout().counts().implausible, 1);
    assert!(!end.is_disengaged());
    let x = end.slave().tool_at().x;
    assert!((x - -0.602).abs() < 0.01, "it follows: {x} m");
}

#[test]
fn a_hip_that_jumped_away_before_a_silence_moves_a_disengaged_tool_nowhere() {
    // 1.9 m, which take more than three seconds
    let hand = |ms| (ms < 1020).then(|| if ms < 1000 { -0.9 } else { 1.0 });
    let mut disengaged_at = None;
    let end = four_seconds(hand, |_, slave, _| {
        if slave.is_disengaged() {
            let x = slave.slave().tool_at().x;
            assert_eq!(*disengaged_at.get_or_insert(x), x, "it goes on");
        }
    });
    assert!(end.is_disengaged() && disengaged_at.is_some());
}

#[test]
fn before_the_first_sample_nothing_is_disengaged() {
    let mut end = end("none", Architecture::Mmt, 0);
    (1..=4000).for_each(|ms| {
        end.tick(AT(ms));
    });
    assert!(!end.is_disengaged());
}

#[test]
fn a_hello_far_away_starts_within_reach() {
    let mut slave =
        Slave::try_new(&SlaveConfig::default(), Coupling::for_stiffness(1000.0)).unwrap();
    slave.start_at(Vec2::new(-4.0, 3.0));
    assert!((slave.tool_at() - Vec2::new(-1.6, 1.2)).norm() < 1e-12);
    slave.start_at(Vec2::new(-0.45, 0.0));
    assert_eq!(slave.tool_at(), Vec2::new(-0.45, 0.0));
}

#[test]
fn a_slave_without_samples_shows_hold_after_100_ms_and_disengaged_after_2_s() {
    let mut end = end("none", Architecture::Mmt, 0);
    let mut master = DatagramChannel::new(Side::Master, Time::ZERO);
    let bytes = command(&mut master, 10, 1..=10, 0, None);
    end.handle_datagram(AT(10), &bytes);
    let mut shown = Vec::new();
    for ms in 11..=2200 {
        end.tick(AT(ms));
        sent(&mut end, &mut master, AT(ms));
        let state = master.other().tool;
        if shown.last().is_none_or(|(_, last)| *last != state) {
            shown.push((ms, state));
        }
    }
    let states: Vec<ToolState> = shown.iter().map(|(_, state)| *state).collect();
    assert_eq!(states, ToolState::ALL);
    let [(_, _), (hold, _), (disengaged, _)] = shown[..] else {
        panic!("{shown:?}");
    };
    // with the next heartbeat, 50 ms later at the most
    assert!((110..=170).contains(&hold), "{hold} ms");
    assert!((2010..=2070).contains(&disengaged), "{disengaged} ms");
    // a sample ends a hold
    let mut end = self::end("none", Architecture::Mmt, 0);
    let mut master = DatagramChannel::new(Side::Master, Time::ZERO);
    for (from, until) in [(0, 300), (300, 400)] {
        let bytes = command(&mut master, from + 10, from + 1..=from + 10, 0, None);
        end.handle_datagram(AT(from + 10), &bytes);
        for ms in from + 11..=until {
            end.tick(AT(ms));
            sent(&mut end, &mut master, AT(ms));
            if ms == 290 {
                assert_eq!(master.other().tool, ToolState::Hold);
            }
            if ms == 380 {
                assert_eq!(master.other().tool, ToolState::Nominal);
            }
        }
    }
}
