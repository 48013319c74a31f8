//! When the tool stands: an emergency stop, no samples, a place that is far away.

use super::*;

/// Four seconds of commands of a HIP that is at `hand` (x, m; at each ms) or sends nothing. What `given` returns is what
/// the slave's tick is given; returns the slave's end.
fn four_seconds(
    hand: impl Fn(u64) -> Option<f64>,
    mut given: impl FnMut(u64, &mut SlaveEnd, &mut DatagramChannel) -> SlaveGiven,
) -> SlaveEnd {
    let mut end = end("none", Architecture::Mmt, 0);
    let mut master = DatagramChannel::new(Side::Master, Time::ZERO);
    for ms in 1..=4000 {
        let given = given(ms, &mut end, &mut master);
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
        end.tick(AT(ms), &given);
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
    let end = four_seconds(hand, |_, _, _| SlaveGiven::default());
    (end.slave().tool_at().x, end)
}

#[test]
fn while_either_sides_emergency_stop_is_set_the_tool_stands() {
    for side in [Side::Slave, Side::Master] {
        let mut stood = Vec::new();
        let hand = |ms| Some(going_on(ms));
        let end = four_seconds(hand, |ms, slave, master| {
            let stops = (1000..3000).contains(&ms);
            master.stop(stops && side == Side::Master);
            if (1002..3000).contains(&ms) {
                assert_eq!(slave.stopped_by(), Some(side));
            }
            // it brakes from 0.1 m/s
            if (1007..3000).contains(&ms) {
                stood.push(slave.slave().tool_at().x);
            }
            SlaveGiven {
                stops: stops && side == Side::Slave,
                plant: None,
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
        if ms == 3400 {
            waited = slave.slave().tool_at().x;
        }
        SlaveGiven {
            stops: (1000..3000).contains(&ms),
            plant: None,
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
        SlaveGiven::default()
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
        SlaveGiven::default()
    });
    assert!(end.is_disengaged() && disengaged_at.is_some());
}

#[test]
fn before_the_first_sample_nothing_is_disengaged() {
    let mut end = end("none", Architecture::Mmt, 0);
    (1..=4000).for_each(|ms| {
        end.tick(AT(ms), &SlaveGiven::default());
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
        end.tick(AT(ms), &SlaveGiven::default());
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
            end.tick(AT(ms), &SlaveGiven::default());
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
