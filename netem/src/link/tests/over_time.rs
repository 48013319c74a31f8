//! Settings that change as time goes by, and recorded paths.

use super::*;

fn delay_ms(link: &mut Link<()>, now_ms: u64) -> Option<f64> {
    let now = Time::from_millis(now_ms);
    let due = one(link, now, 0).ok()?;
    Some(due.saturating_since(now).as_secs_f64() * 1e3)
}

#[test]
fn steps_come_at_their_times_and_the_loop_brings_them_again() {
    let words = "delay 20ms; at 1s delay 80ms; at 2s loss 100%; loop 3s";
    let mut link = link(words, 1, LinkId::UP);
    for round in 0..3 {
        let begin = round * 3000;
        assert_eq!(delay_ms(&mut link, begin + 100), Some(20.0));
        assert_eq!(delay_ms(&mut link, begin + 999), Some(20.0));
        assert_eq!(delay_ms(&mut link, begin + 1100), Some(80.0));
        assert_eq!(delay_ms(&mut link, begin + 2000), None);
    }
}

#[test]
fn a_ramp_goes_evenly() {
    let mut link = link(
        "delay 20ms; at 1s over 1s delay 100ms 10ms; at 3s none",
        1,
        LinkId::UP,
    );
    assert_eq!(delay_ms(&mut link, 900), Some(20.0));
    // a quarter of the way: 40 ms, with a quarter of the jitter, in steps of 80 / 32 ms
    let quarter = delay_ms(&mut link, 1250).unwrap();
    assert!((quarter - 40.0).abs() < 2.5 + 1.25, "{quarter}");
    let half = delay_ms(&mut link, 1500).unwrap();
    assert!((half - 60.0).abs() < 5.0 + 1.25, "{half}");
    let arrived = delay_ms(&mut link, 2500).unwrap();
    assert!((arrived - 100.0).abs() <= 10.0, "{arrived}");
    assert_eq!(delay_ms(&mut link, 3100), Some(0.0));
}

#[test]
fn time_counts_from_the_origin() {
    let mut link = link("none; at 1s delay 80ms", 1, LinkId::UP);
    link.set_origin(Time::from_millis(10_000));
    assert_eq!(delay_ms(&mut link, 10_999), Some(0.0));
    assert_eq!(delay_ms(&mut link, 11_000), Some(80.0));
}

#[test]
fn a_recorded_path_is_met_again_with_its_losses() {
    let text = "# mmt netem path 1\nat_ns,delay_ns\n0,10000000\n100000000,\n200000000,30000000\n";
    let config = crate::words::parse("trace p.csv", &mut |_| Ok(text.to_owned())).unwrap();
    assert_eq!(config.to_string(), "trace p.csv");
    assert!(!config.is_transparent());
    let mut link = Link::try_new(config, 1, LinkId::UP).unwrap();
    for round in 0..2 {
        let begin = 300 * round;
        assert_eq!(delay_ms(&mut link, begin + 50), Some(10.0));
        assert_eq!(delay_ms(&mut link, begin + 150), None);
        assert_eq!(delay_ms(&mut link, begin + 250), Some(30.0));
    }
}

#[test]
fn a_step_keeps_the_order_of_what_is_in_flight() {
    let mut link = link("delay 500ms; at 1s delay 1ms", 1, LinkId::UP);
    let packets = [999, 1000].map(|ms| (Time::from_millis(ms), Packet::new(0, ())));
    let out = run(&mut link, packets.into_iter());
    assert_eq!(out[0].due, out[1].due);
}
