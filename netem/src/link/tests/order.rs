//! Packets that overtake on purpose.

use super::*;

#[test]
fn the_chosen_leave_at_once_and_the_others_wait() {
    let fates = fates("delay 10ms reorder 25%", 211, LinkId::UP);
    let delays = delays(&fates);
    let at_once = delays.iter().filter(|delay| **delay == Some(0.0)).count() as f64;
    assert!(
        delays
            .iter()
            .all(|delay| [Some(0.0), Some(10.0)].contains(delay))
    );
    let n = N as f64;
    assert!(
        (at_once - 0.25 * n).abs() < 4.0 * (0.1875 * n).sqrt(),
        "{at_once}"
    );
}

#[test]
fn with_a_gap_only_every_nth_packet_can_overtake() {
    let fates = fates("delay 10ms reorder 100% gap 5", 1, LinkId::UP);
    for (packet, delay) in delays(&fates).into_iter().enumerate() {
        let expected = if packet % 5 == 4 { 0.0 } else { 10.0 };
        assert_eq!(delay, Some(expected), "{packet}");
    }
}

#[test]
fn what_overtakes_does_not_hold_up_what_follows() {
    let jitter = fates("delay 50ms 5ms", 217, LinkId::UP);
    let both = fates("delay 50ms 5ms reorder 10%", 217, LinkId::UP);
    let never_later = jitter.iter().zip(&both).all(|(a, b)| b <= a);
    assert!(never_later && jitter != both);
}
