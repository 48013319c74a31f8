//! Promises of the play-out buffer.

mod delay;

use super::*;
use mmt_shared::model::sample::{ForceCounts, HipCounts};
use mmt_shared::rng::Substream;
use mmt_shared::stats::values::rms;
use mmt_shared::time::TICK_S;

const MS: i64 = 1_000_000;
/// The master's clock starts elsewhere.
const MASTER_EPOCH: u64 = 7_000_000_000_000;

fn stamp(k: u64) -> Time {
    Time::from_nanos(MASTER_EPOCH + k * MS as u64)
}

/// A smooth motion of at most 0.3 m/s.
fn truth(seconds: f64) -> Vec2 {
    Vec2::new(
        0.1 * libm::sin(2.0 * seconds),
        0.05 * libm::cos(3.0 * seconds),
    )
}

fn sample(k: u64) -> HipSample {
    let hip = truth(k as f64 * 1e-3);
    HipSample {
        stamp: stamp(k),
        hip: HipCounts::nearest(hip),
        force: ForceCounts::nearest(hip * 10.0),
    }
}

/// What the network does with the packet that holds the samples up to k: its transit in ns, or a loss.
type Transit<'a> = &'a mut dyn FnMut(u64) -> Option<i64>;

/// Plays `ticks` ms of packets of `packing` samples; returns what was played, with the slave's time.
fn play(
    config: PlayoutConfig,
    packing: u64,
    ticks: u64,
    transit: Transit<'_>,
) -> (PlayoutBuffer, Vec<(Time, Played)>) {
    let mut buffer = PlayoutBuffer::try_new(config).unwrap();
    let mut packets = Vec::new();
    for k in (packing - 1..ticks).step_by(packing as usize) {
        if let Some(ns) = transit(k) {
            packets.push((k as i64 * MS + ns, k));
        }
    }
    packets.sort_unstable();
    let mut packets = packets.into_iter().peekable();
    let mut played = Vec::new();
    for tick in 0..ticks {
        let now = Time::from_millis(tick);
        while let Some((at, k)) = packets.next_if(|(at, _)| *at <= tick as i64 * MS) {
            for j in k + 1 - packing..=k {
                buffer.push(Time::from_nanos(at as u64), &sample(j));
            }
        }
        played.extend(buffer.advance(now).map(|p| (now, p)));
    }
    (buffer, played)
}

/// Index of the sample of exactly this stamp.
fn index(stamp: Time) -> Option<u64> {
    let off = stamp.as_nanos().checked_sub(MASTER_EPOCH)?;
    (off % MS as u64 == 0).then_some(off / MS as u64)
}

fn assert_steady(played: &[(Time, Played)]) {
    for pair in played.windows(2) {
        let step = pair[1].1.stamp.signed_since(pair[0].1.stamp);
        assert_eq!(step, MS, "at {:?}", pair[0].0);
    }
}

fn assert_is_the_input(played: &[(Time, Played)]) {
    for (now, p) in played {
        let k = index(p.stamp).unwrap_or_else(|| panic!("between samples at {now:?}"));
        assert_eq!(p.hip, sample(k).hip.metres(), "at {now:?}");
        assert_eq!(p.force, Some(sample(k).force.newtons()));
        assert_eq!((p.status, p.limited), (Status::Interpolated, false));
    }
}

fn random_transit(jitter_ns: i64) -> impl FnMut(u64) -> Option<i64> {
    let mut stream = Substream::new(5, "test/jitter", 0);
    move |_| Some(50 * MS + stream.uniform_in(0.0, jitter_ns as f64) as i64)
}

#[test]
fn with_constant_delay_the_input_comes_out_bit_for_bit() {
    let (buffer, played) = play(PlayoutConfig::default(), 10, 3_000, &mut |_| Some(50 * MS));
    // the first packet leaves at 9 ms; its last sample is played 50 + 16 ms after its stamp
    assert_eq!(played[0].0, Time::from_millis(66));
    assert_eq!(played[0].1.stamp, stamp(0));
    assert_eq!(played.len(), 3_000 - 66);
    assert_is_the_input(&played);
    assert_steady(&played);
    let counts = buffer.counts();
    assert_eq!((counts.pushed, counts.interpolated), (2_950, 2_934));
    assert_eq!((counts.late, counts.duplicate, counts.overflow), (0, 0, 0));
}

#[test]
fn jitter_below_the_delay_leaves_no_trace() {
    let mut stream = Substream::new(5, "test/jitter", 0);
    let mut transit = |_| Some((50 + (stream.bits() % 6) as i64) * MS);
    let (buffer, played) = play(PlayoutConfig::default(), 10, 20_000, &mut transit);
    // the first packets may have been slow: the clock settles within the first second
    let settled: Vec<_> = played
        .into_iter()
        .filter(|(now, _)| *now >= Time::from_millis(1_500))
        .collect();
    assert_is_the_input(&settled);
    assert_steady(&settled);
    assert_eq!(buffer.counts().late, 0);
    assert_eq!(buffer.counts().extrapolated, 0);
}

#[test]
fn between_samples_it_interpolates_and_the_clocks_may_drift() {
    // the slave's clock runs 200 ppm slow: it sees the master's stamps come ever earlier
    let mut transit = |k: u64| Some(60 * MS - (k as i64 * MS) / 5_000);
    let (_, played) = play(PlayoutConfig::default(), 10, 60_000, &mut transit);
    let mut off_grid = 0;
    for (now, p) in &played {
        let want = truth(p.stamp.signed_since(stamp(0)) as f64 * 1e-9);
        assert!((p.hip - want).norm() < 1e-6, "at {now:?}");
        assert_eq!(p.status, Status::Interpolated);
        off_grid += u32::from(index(p.stamp).is_none());
    }
    assert!(off_grid > 1_000, "nothing was interpolated");
    for pair in played.windows(2) {
        let step = pair[1].1.stamp.signed_since(pair[0].1.stamp);
        assert!((step - MS).abs() <= MS / 100, "{step}");
    }
    // and it keeps up: 12 ms of drift leave the play-out delay where it was
    let (now, last) = played.last().unwrap();
    let behind = now.as_nanos() as i64 - last.stamp.signed_since(stamp(0));
    assert!((behind - (48 + 16) * MS).abs() < MS, "{behind}");
}

#[test]
fn a_lost_packet_is_bridged_and_costs_at_most_its_own_curvature() {
    let config = PlayoutConfig::for_packing_and_jitter(10, Duration::from_millis(15));
    let mut lose = |k| (k % 100 != 9).then_some(50 * MS);
    let (buffer, played) = play(config, 10, 3_000, &mut lose);
    for (now, p) in &played {
        let want = truth(p.stamp.signed_since(stamp(0)) as f64 * 1e-9);
        // 1/8 a t² with a < 0.7 m/s², t = 11 ms
        assert!((p.hip - want).norm() < 2e-5, "at {now:?}");
    }
    assert_eq!(buffer.counts().extrapolated + buffer.counts().stopped, 0);
}

#[test]
fn an_underrun_is_extrapolated_for_30_ms_and_then_it_stops() {
    let mut stop = |k| (k < 1_000).then_some(50 * MS);
    let (_, played) = play(PlayoutConfig::default(), 10, 3_000, &mut stop);
    let last_sample = stamp(999);
    let count = |status| played.iter().filter(|(_, p)| p.status == status).count();
    assert_eq!(count(Status::Extrapolated), 30);
    let (mut before, mut still) = (None::<Played>, 0);
    for (_, p) in &played {
        let since = p.stamp.signed_since(last_sample) / MS;
        assert_eq!(p.force.is_some(), since <= 0);
        if let Some(before) = before.filter(|_| since > 30) {
            assert_eq!(p.status, Status::Stopped);
            // bounded deceleration: 20 m/s² over a tick
            assert!((p.velocity - before.velocity).norm() <= 0.020_001);
            still += u32::from(p.hip == before.hip);
        }
        before = Some(*p);
    }
    assert!(still > 1_800, "it does not stop: {still}");
    let end = played.last().unwrap().1.hip;
    let reach = (end - sample(999).hip.metres()).norm();
    assert!(
        reach > 2e-3 && reach < 0.3 * 0.030 + 0.3 * 0.3 / 40.0 + 1e-3,
        "{reach}"
    );
}

#[test]
fn after_an_outage_the_speed_limit_holds() {
    let outage = |k: &u64| (1_000..2_000).contains(k);
    let mut transit = |k| (!outage(&k)).then_some(50 * MS);
    let (buffer, played) = play(PlayoutConfig::default(), 10, 3_000, &mut transit);
    let mut fastest = 0.0_f64;
    for pair in played.windows(2) {
        fastest = fastest.max((pair[1].1.hip - pair[0].1.hip).norm() / 1e-3);
    }
    assert!(fastest <= 0.6 * (1.0 + 1e-6), "{fastest}");
    assert!(buffer.counts().limited > 20, "there was a jump to limit");
    assert!(
        played
            .iter()
            .all(|(_, p)| !(p.limited && p.force.is_some()))
    );
    // and it catches up to the bit
    assert_is_the_input(&played[played.len() - 500..]);
}

#[test]
fn the_first_sample_is_reached_at_the_speed_limit_from_the_start() {
    let mut buffer = PlayoutBuffer::try_new(PlayoutConfig::default()).unwrap();
    buffer.start_at(Vec2::new(0.0, -0.1));
    buffer.push(Time::ZERO, &sample(0));
    let played = buffer.advance(Time::from_millis(16)).unwrap();
    assert!(played.limited);
    assert!((played.hip - Vec2::new(0.0, -0.1)).norm() <= 0.6e-3 * 1.000_001);
}

#[test]
fn holding_the_newest_sample_is_far_worse_than_the_buffer_under_jitter() {
    // 1 sample a packet, 10 ms of jitter; error against the truth at each method's own mean delay
    let config = PlayoutConfig::for_packing_and_jitter(1, Duration::from_millis(10));
    let (_, played) = play(config, 1, 10_000, &mut random_transit(10 * MS));
    let error_of = |pairs: &[(f64, Vec2)]| {
        let error = |delay: f64| {
            let errors = pairs.iter().map(|(t, hip)| (hip - truth(t - delay)).norm());
            rms(errors).unwrap()
        };
        (0..400)
            .map(|k| error(0.045 + f64::from(k) * 1e-4))
            .fold(f64::MAX, f64::min)
    };
    let buffered: Vec<_> = played[2_000..]
        .iter()
        .map(|(now, p)| (now.as_secs_f64(), p.hip))
        .collect();

    let mut transit = random_transit(10 * MS);
    let mut arrivals: Vec<_> = (0..10_000_u64)
        .filter_map(|k| transit(k).map(|ns| (k as i64 * MS + ns, k)))
        .collect();
    arrivals.sort_unstable();
    let held: Vec<_> = (2_000..9_900_i64)
        .map(|tick| {
            // the sample that arrived last
            let next = arrivals.partition_point(|(at, _)| *at <= tick * MS);
            (
                tick as f64 * 1e-3,
                sample(arrivals[next - 1].1).hip.metres(),
            )
        })
        .collect();

    let (buffered, held) = (error_of(&buffered), error_of(&held));
    println!("r.m.s. motion error: held {held:.2e} m, buffered {buffered:.2e} m");
    assert!(held > 20.0 * buffered, "{held} {buffered}");
}

#[test]
fn copies_late_and_reordered_samples_are_counted_and_do_not_change_the_motion() {
    let mut buffer = PlayoutBuffer::try_new(PlayoutConfig::default()).unwrap();
    let at = |ms: u64| Time::from_millis(100 + ms);
    for k in [1, 0, 3, 2, 2, 4] {
        buffer.push(at(4), &sample(k));
    }
    assert_eq!(buffer.counts().duplicate, 1);
    for tick in 16..=20 {
        let played = buffer.advance(at(tick)).unwrap();
        assert_eq!(played.hip, sample(tick - 16).hip.metres());
    }
    // already played: a copy; and one from before all others: late
    buffer.push(at(20), &sample(3));
    assert_eq!(buffer.counts().duplicate, 2);
    let early = HipSample {
        stamp: stamp(0).offset_by(-5 * MS),
        ..sample(0)
    };
    buffer.push(at(20), &early);
    assert_eq!(buffer.counts().late, 1);
}

#[test]
fn a_path_that_becomes_slower_for_good_is_learned_anew_and_no_stamp_is_played_twice() {
    let mut transit = |k| Some(if k < 2_000 { 50 * MS } else { 350 * MS });
    let (buffer, played) = play(PlayoutConfig::default(), 10, 6_000, &mut transit);
    assert_eq!(buffer.counts().relearned, 1);
    assert!(played.windows(2).all(|w| w[0].1.stamp <= w[1].1.stamp));
    assert_is_the_input(&played[played.len() - 2_000..]);
}

#[test]
fn hostile_stamps_neither_panic_nor_block_the_buffer() {
    let hostile = [0, 1, u64::MAX, u64::MAX - 1, u64::MAX / 2, MASTER_EPOCH * 2];
    for bad in hostile {
        for first in [true, false] {
            let mut buffer = PlayoutBuffer::try_new(PlayoutConfig::default()).unwrap();
            let mut poison = |at| {
                let sample = HipSample {
                    stamp: Time::from_nanos(bad),
                    ..sample(0)
                };
                buffer.push(at, &sample);
                buffer.advance(at);
            };
            if first {
                for tick in 0..30 {
                    poison(Time::from_millis(tick));
                }
            }
            let mut last = None;
            for k in 0..3_000_u64 {
                let now = Time::from_millis(50 + k);
                if k == 1_000 {
                    let sample = HipSample {
                        stamp: Time::from_nanos(bad),
                        ..sample(0)
                    };
                    buffer.push(now, &sample);
                }
                buffer.push(now, &sample(k));
                last = buffer.advance(now);
            }
            let last = last.unwrap();
            assert_eq!(last.stamp, stamp(2_999 - 16), "{bad} {first}");
            assert_eq!(last.hip, sample(2_999 - 16).hip.metres());
        }
    }
    // the slave's own time may be anything, too
    let mut buffer = PlayoutBuffer::try_new(PlayoutConfig::default()).unwrap();
    for now in [Time::MAX, Time::ZERO, Time::from_millis(5), Time::MAX] {
        buffer.push(now, &sample(3));
        buffer.advance(now);
    }
}

#[test]
fn a_slave_that_does_not_tick_keeps_the_newest_half_second() {
    let mut buffer = PlayoutBuffer::try_new(PlayoutConfig::default()).unwrap();
    let capacity = buffer.buffer.samples().capacity();
    for k in 0..2_000 {
        buffer.push(Time::from_millis(50 + k), &sample(k));
    }
    assert_eq!(
        buffer.counts().overflow,
        2_000 - jitter_buffer::SAMPLES_MAX as u64
    );
    assert_eq!(buffer.buffer.samples().back().unwrap().stamp, stamp(1_999));
    assert_eq!(buffer.buffer.samples().capacity(), capacity, "it allocated");
}

#[test]
fn a_wrong_configuration_is_named() {
    let config = PlayoutConfig {
        delay_ms: f64::NAN,
        ..PlayoutConfig::default()
    };
    let error = PlayoutBuffer::try_new(config).unwrap_err().to_string();
    assert!(error.contains("delay NaN"), "{error}");
    let config = PlayoutConfig::for_packing_and_jitter(10, Duration::from_millis(5));
    assert!((config.delay_ms - 16.0).abs() < 1e-9);
    let slowest = PlayoutConfig::for_packing_and_jitter(255, Duration::from_secs(9));
    assert!(PlayoutBuffer::try_new(slowest).is_ok());
}

#[test]
fn a_hip_that_is_far_away_takes_the_tool_no_farther_than_its_reach() {
    let config = PlayoutConfig {
        reach_m: 0.5,
        ..PlayoutConfig::default()
    };
    let mut buffer = PlayoutBuffer::try_new(config).unwrap();
    buffer.start_at(Vec2::zeros());
    let mut most = 0.0_f64;
    for k in 0..3000 {
        let now = Time::from_millis(k);
        let hip = HipCounts::nearest(Vec2::new(160.0, -120.0));
        buffer.push(now, &HipSample { hip, ..sample(k) });
        let Some(played) = buffer.advance(now) else {
            continue;
        };
        most = most.max(played.hip.norm());
        assert!(played.velocity.norm() <= 0.6 + 1e-9);
        assert!(
            played.limited && played.force.is_none(),
            "it is not the hand's place"
        );
    }
    assert!((most - 0.5).abs() < 1e-9, "{most} m");
}

#[test]
fn a_hip_that_jumped_away_is_not_gone_to_once_samples_have_run_out() {
    let config = PlayoutConfig::default();
    let mut buffer = PlayoutBuffer::try_new(config).unwrap();
    let (mut at, mut stood) = (Vec2::zeros(), None);
    for k in 0..2000_u64 {
        let now = Time::from_millis(k);
        if k < 500 {
            let x = if k < 400 { 0.0 } else { 1.5 };
            buffer.push(
                now,
                &HipSample {
                    stamp: stamp(k),
                    hip: HipCounts::nearest(Vec2::new(x, 0.0)),
                    ..HipSample::default()
                },
            );
        }
        let Some(played) = buffer.advance(now) else {
            continue;
        };
        let way = (played.hip - at).norm();
        assert!(way <= 0.6e-3 + 1e-9, "{way} m at {k} ms");
        // 16 ms of delay, 30 ms on, 30 ms from 0.6 m/s to a stop
        if way > 1e-12 {
            assert!(k <= 500 + 16 + 30 + 30 + 2, "it goes on at {k} ms");
        } else if k > 500 {
            stood.get_or_insert(k);
            assert!(played.stands, "{k} ms");
        }
        at = played.hip;
    }
    assert!(stood.is_some() && at.x > 0.05 && at.x < 0.15, "{at}");
}

#[test]
fn samples_of_before_that_come_after_a_silence_do_not_draw_the_tool_back() {
    let mut buffer = PlayoutBuffer::try_new(PlayoutConfig::default()).unwrap();
    let (mut at, mut stood) = (Vec2::zeros(), false);
    for k in 0..1500_u64 {
        let now = Time::from_millis(50 + k);
        let old = match k {
            0..500 => vec![k],
            // two datagrams on a long way round, so far apart that the clock is learned anew
            550 => (330..335).collect(),
            800 => (200..205).collect(),
            _ => Vec::new(),
        };
        for k in old {
            buffer.push(now, &sample(k));
        }
        let Some(played) = buffer.advance(now) else {
            continue;
        };
        let way = (played.hip - at).norm();
        stood |= k > 600 && way == 0.0;
        assert!(!stood || way == 0.0, "{way} m at {k} ms");
        at = played.hip;
    }
    assert!(stood);
    assert_eq!(buffer.counts().relearned, 1);
}

#[test]
fn no_stamp_is_played_again_after_the_clock_was_learned_anew_from_an_older_sample() {
    let mut buffer = PlayoutBuffer::try_new(PlayoutConfig::default()).unwrap();
    let mut last = Time::ZERO;
    for k in 0..1500_u64 {
        // at 600 ms the slave stands for 2 s, so that the stamp played is as far ahead of all samples as it may be
        let now = Time::from_millis(if k < 600 { k } else { k + 2000 });
        let some = match k {
            0..500 => vec![k],
            // two datagrams of before, so far apart that the clock is learned anew
            700 => vec![420],
            1000 => vec![430],
            _ => Vec::new(),
        };
        for k in some {
            buffer.push(now, &sample(k));
        }
        // it stands again before it plays the second
        if (1000..1100).contains(&k) {
            continue;
        }
        let Some(played) = buffer.advance(now) else {
            continue;
        };
        assert!(played.stamp >= last, "{:?} after {last:?}", played.stamp);
        last = played.stamp;
    }
    assert_eq!(last, stamp(499) + Duration::from_secs(1));
    assert_eq!(buffer.counts().relearned, 1);
}

#[test]
fn a_tool_that_slides_along_the_end_of_its_reach_brakes_all_the_same_when_it_is_held() {
    let config = PlayoutConfig {
        reach_m: 0.5,
        ..PlayoutConfig::default()
    };
    let (mut slid, a) = (0, config.acceleration_max_m_per_s2);
    for held_at in 500..1500 {
        let mut buffer = PlayoutBuffer::try_new(config).unwrap();
        buffer.start_at(Vec2::new(0.0, 0.3));
        let (mut at, mut speed) = (Vec2::zeros(), 0.0);
        for k in 0..held_at + 50 {
            let now = Time::from_millis(k);
            // the hand goes straight on
            let hip = HipCounts::nearest(Vec2::new(0.55e-3 * k as f64, 0.3));
            buffer.push(now, &HipSample { hip, ..sample(k) });
            buffer.hold(k >= held_at);
            let Some(played) = buffer.advance(now) else {
                continue;
            };
            let goes = (played.hip - at).norm() / TICK_S;
            if k >= held_at {
                let most = (speed - a * TICK_S).max(0.0);
                assert!(goes <= most + 2e-4, "{goes} m/s after {speed} m/s");
                slid += u32::from(goes > 0.0 && played.hip.norm() > 0.5 - 1e-9);
            }
            (at, speed) = (played.hip, goes);
        }
    }
    assert!(slid > 0, "the effect exists");
}

#[test]
fn a_clock_that_was_set_back_is_followed_again() {
    for back_ms in [500, 900, 5000] {
        let mut buffer = PlayoutBuffer::try_new(PlayoutConfig::default()).unwrap();
        let mut last = None;
        for k in 0..10_000_u64 {
            let now = Time::from_millis(50 + k);
            let back = if k < 6000 { 0 } else { back_ms * MS };
            let set_back = HipSample {
                stamp: stamp(k).offset_by(-back),
                ..sample(k)
            };
            buffer.push(now, &set_back);
            last = buffer.advance(now);
        }
        let last = last.unwrap();
        assert_eq!(last.stamp, stamp(9_999 - 16).offset_by(-back_ms * MS));
        assert_eq!(last.hip, sample(9_999 - 16).hip.metres(), "{back_ms} ms");
        assert_eq!(last.status, Status::Interpolated);
    }
}
