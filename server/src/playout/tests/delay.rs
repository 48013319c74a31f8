//! How the play-out delay follows the jitter.

use super::*;

#[test]
fn the_delay_grows_to_the_jitter_and_the_packing_and_back_again() {
    // 20 ms of jitter in the first half, which ten samples a packet and 16 ms cannot hide
    let mut stream = Substream::new(5, "test/jitter", 0);
    let mut transit = |k| {
        let jitter = if k < 20_000 { 20 * MS } else { 0 };
        Some(50 * MS + stream.uniform_in(0.0, jitter as f64) as i64)
    };
    let mut seen = Vec::new();
    let (buffer, played) = {
        let mut buffer = PlayoutBuffer::try_new(PlayoutConfig::default()).unwrap();
        let (mut packets, mut played) = (Vec::new(), Vec::new());
        for tick in 0..40_000_u64 {
            if tick % 10 == 9 {
                packets.push((tick as i64 * MS + transit(tick).unwrap(), tick));
            }
            let now = Time::from_millis(tick);
            packets.retain(|&(at, k)| {
                let due = at <= tick as i64 * MS;
                for j in (k - 9..=k).filter(|_| due) {
                    buffer.push(Time::from_nanos(at as u64), &sample(j));
                }
                !due
            });
            played.extend(buffer.advance(now).map(|p| (now, p)));
            seen.push(buffer.delay().as_secs_f64() * 1e3);
        }
        (buffer, played)
    };
    let (first, jittered, last) = (seen[100], seen[15_000], seen[39_999]);
    println!("play-out delay: {first} ms, then {jittered} ms, then {last} ms");
    assert_eq!((first, last), (16.0, 16.0));
    // 9 ms of packing, 20 of jitter less one in a hundred, 2 of room, and the bin
    assert!((29.0..=32.0).contains(&jittered), "{jittered}");
    let starved = |from: u64, to: u64| {
        let of = |(now, p): &&(Time, Played)| {
            let ms = now.as_nanos() / 1_000_000;
            (from..to).contains(&ms) && p.status != Status::Interpolated
        };
        played.iter().filter(of).count()
    };
    let (before, after) = (starved(100, 1_500), starved(5_000, 20_000));
    assert!(
        before > 20 && after < before / 10,
        "{before} before, {after} after"
    );
    assert_eq!(buffer.counts().relearned, 0);
    for pair in played.windows(2) {
        let step = pair[1].1.stamp.signed_since(pair[0].1.stamp);
        // 5 % slower at the most, and what the clock slews
        assert!((step - MS).abs() <= MS / 20 + MS / 100, "{step}");
    }
}

#[test]
fn a_delay_whose_greatest_is_its_least_stays() {
    let fixed = PlayoutConfig {
        delay_max_ms: 0.0,
        ..PlayoutConfig::default()
    };
    let (buffer, _) = play(fixed, 10, 5_000, &mut random_transit(30 * MS));
    assert_eq!(buffer.delay(), Duration::from_millis(16));
    assert!(buffer.counts().late > 100);
}

#[test]
fn when_a_long_queue_is_gone_the_tool_does_not_stand_still() {
    // 0.9 s of queue for 10 s, which then drains twice as fast as samples come
    let mut transit = |k: u64| {
        let drained = 2 * k.saturating_sub(10_000) as i64;
        Some((950 - drained).max(50) * MS)
    };
    let (buffer, played) = play(PlayoutConfig::default(), 10, 15_000, &mut transit);
    let after = played
        .iter()
        .filter(|(now, _)| *now > Time::from_millis(12_000));
    let late = after
        .clone()
        .filter(|(_, p)| p.status != Status::Interpolated);
    assert_eq!(late.count(), 0, "{:?}", buffer.counts());
    let lag = |(now, p): &(Time, Played)| now.saturating_since(p.stamp);
    let longest = after.map(lag).max().unwrap();
    assert!(longest < Duration::from_millis(400), "{longest:?}");
}
