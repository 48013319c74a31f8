//! The controller through its trait, and in a loop with a bottleneck.

use std::collections::VecDeque;

use super::*;

const CAP: RateCap = RateCap {
    bytes_per_s: 250_000,
};
const MTU: u16 = 1200;
/// What an acknowledgement leaves in flight.
const IN_FLIGHT: u64 = 1000;

fn ms(millis: u64) -> Duration {
    Duration::from_millis(millis)
}

/// A controller and its time.
struct Path {
    now: Instant,
    window: Box<dyn Controller>,
}

impl Path {
    fn new() -> Self {
        let now = Instant::now();
        let window = Arc::new(CAP).build(now, MTU);
        Self { now, window }
    }

    /// One acknowledgement of `bytes` whose quickest packet took `took`, `after` the last.
    ///
    /// `on_ack` itself cannot be called here, as quinn keeps the constructor of its `RttEstimator` to
    /// itself; it does nothing but hand on what it is given to `answered`.
    fn acknowledge_bytes(&mut self, after: Duration, took: Duration, bytes: u64) {
        self.now += after;
        let mut window = *self
            .window
            .clone_box()
            .into_any()
            .downcast::<Window>()
            .unwrap();
        window.answered(self.now, self.now - took - ms(9), bytes / 2);
        window.answered(self.now, self.now - took, bytes / 2);
        window.on_end_acks(self.now, IN_FLIGHT, true, None);
        self.window = Box::new(window);
    }

    fn acknowledge(&mut self, after: Duration, took: Duration) {
        self.acknowledge_bytes(after, took, 1200);
    }

    /// Ten acknowledgements in 100 ms, `count` times, of 120 kB/s whose quickest packet took `took`.
    fn rounds(&mut self, count: usize, took: Duration) {
        for _ in 0..count * 10 {
            self.acknowledge(ms(10), took);
        }
    }

    fn lose(&mut self, persistent: bool) {
        self.window
            .on_congestion_event(self.now, self.now, persistent, 1200);
    }
}

#[test]
fn the_window_is_the_formula_between_its_bounds() {
    let mut path = Path::new();
    // 250 kB/s × 50 ms + 2 MTU
    assert_eq!(path.window.window(), 12_500 + 2400);
    path.rounds(1, ms(100));
    assert_eq!(path.window.window(), 37_500 + 2400);
    let window_of = |bytes_per_s, took| {
        let mut window = Window::new(RateCap { bytes_per_s }, Instant::now(), MTU);
        window.base.record(Instant::now(), took);
        window.window()
    };
    assert_eq!(window_of(0, ms(100)), WINDOW_MIN);
    assert_eq!(window_of(u64::MAX, Duration::MAX / 4), WINDOW_MAX);
}

#[test]
fn the_window_is_there_without_being_filled_first() {
    let mut path = Path::new();
    path.rounds(1, ms(1000));
    assert_eq!(path.window.window(), WINDOW_MAX);
}

#[test]
fn isolated_loss_and_reordering_do_not_shrink_it() {
    let mut path = Path::new();
    path.rounds(1, ms(100));
    let before = path.window.window();
    for _ in 0..1000 {
        path.acknowledge(ms(10), ms(100));
        path.lose(false);
    }
    assert_eq!(path.window.window(), before);
}

#[test]
fn jitter_does_not_shrink_it() {
    let mut path = Path::new();
    path.rounds(1, ms(100));
    let before = path.window.window();
    for turn in 0..5000 {
        // 100 to 150 ms, every phase of it within a round
        path.acknowledge(ms(10), ms(100 + (turn * 7) % 50));
    }
    assert_eq!(path.window.window(), before);
}

#[test]
fn a_standing_queue_is_steered_to_the_target_and_its_end_lets_the_window_grow_back() {
    let mut path = Path::new();
    path.rounds(2, ms(100));
    let full = path.window.window();
    path.rounds(1, ms(150));
    assert_eq!(path.window.window(), full, "one reading is not enough");
    path.rounds(2, ms(150));
    // what was carried in the shortest round trip and the target
    let carried = 120 * (100 + 12) + 2400;
    let probe_reduction = 2 * 120 * 12;
    let window = path.window.window();
    assert!(window.abs_diff(carried - probe_reduction) < 700, "{window}");
    path.rounds(30, ms(150));
    assert_eq!(path.window.window(), WINDOW_MIN);
    path.rounds(4, ms(100));
    let grown = path.window.window() - WINDOW_MIN;
    assert!(grown > 0 && grown < 2 * u64::from(MTU), "{grown}");
    path.rounds(150, ms(100));
    assert_eq!(path.window.window(), full);
}

#[test]
fn at_the_target_the_window_stays() {
    let mut path = Path::new();
    path.rounds(2, ms(100));
    path.rounds(3, ms(150));
    path.rounds(6, ms(112));
    let window = path.window.window();
    path.rounds(20, ms(112));
    assert_eq!(path.window.window(), window);
}

#[test]
fn under_congestion_the_window_makes_way_for_the_shortest_round_trip_again_and_again() {
    let mut path = Path::new();
    path.rounds(2, ms(100));
    path.rounds(3, ms(150));
    path.rounds(6, ms(112));
    let window = path.window.window();
    let mut gave_way = 0;
    for _ in 0..100 {
        path.rounds(1, ms(112));
        gave_way += u32::from(path.window.window() < window);
    }
    assert!(gave_way > 0, "10 s without a look");
}

#[test]
fn a_queue_that_drains_is_left_to_it() {
    let mut path = Path::new();
    path.rounds(2, ms(100));
    let before = path.window.window();
    for round in 0..30 {
        path.rounds(1, ms(400 - 10 * round));
    }
    assert_eq!(path.window.window(), before);
}

#[test]
fn a_longer_path_is_accepted_in_the_end() {
    let mut path = Path::new();
    path.rounds(2, ms(20));
    let before = path.window.window();
    path.rounds(100, ms(120));
    assert!(path.window.window() < before, "taken for a queue at first");
    path.rounds(400, ms(120));
    assert_eq!(path.window.window(), 42_500 + 2400);
}

#[test]
fn a_mark_shrinks_it_once_a_round_trip() {
    let mut path = Path::new();
    path.rounds(1, ms(100));
    let (before, sent) = (path.window.window(), path.now);
    for _ in 0..50 {
        path.now += ms(1);
        path.window.on_congestion_event(path.now, sent, false, 0);
    }
    assert_eq!(path.window.window(), before / 4 * 3);
    path.window
        .on_congestion_event(path.now, path.now, false, 0);
    assert!(
        path.window.window() < before / 4 * 3,
        "sent after the first answer"
    );
}

#[test]
fn persistent_congestion_collapses_it_and_it_is_back_in_a_second() {
    let mut path = Path::new();
    path.rounds(1, ms(100));
    let before = path.window.window();
    path.lose(true);
    assert_eq!(path.window.window(), WINDOW_MIN);
    path.rounds(10, ms(100));
    assert!(
        path.window.window() > before / 2,
        "{}",
        path.window.window()
    );
}

#[test]
fn in_an_outage_there_is_room_for_the_next_message_and_the_first_answer_ends_that() {
    let mut path = Path::new();
    path.rounds(1, ms(100));
    let before = path.window.window();
    let mut in_flight = IN_FLIGHT;
    for beat in 0..3000 {
        path.now += ms(1);
        assert!(
            in_flight + u64::from(MTU) < path.window.window(),
            "blocked after {beat} ms"
        );
        path.window.on_sent(path.now, 150, 0);
        in_flight += 150;
    }
    path.acknowledge(ms(1), ms(100));
    let ignored = path.window.window() - before;
    assert_eq!(
        ignored, IN_FLIGHT,
        "what was sent into the outage does not count"
    );
    let sent = path.now - ms(1);
    path.window
        .on_congestion_event(path.now, sent, true, ignored);
    assert_eq!(path.window.window(), before, "an outage is no congestion");
    path.lose(true);
    assert_eq!(
        path.window.window(),
        before,
        "sent no later than the answer"
    );
    path.now += ms(1);
    path.lose(true);
    assert_eq!(path.window.window(), WINDOW_MIN, "sent after it");
}

/// 1 kHz × `bytes` over a bottleneck with an unbounded queue; the longest queueing delay after the first
/// 5 s and the share of the bottleneck that was used.
fn bottleneck(bytes: u64, rate: u64, round_trip: Duration) -> (Duration, f64) {
    let mut path = Path::new();
    let (start, steps) = (path.now, 30_000u32);
    let (mut free_at, mut in_flight, mut carried) = (start, 0, 0);
    let mut waiting: VecDeque<(Instant, Instant)> = VecDeque::new();
    let mut worst = Duration::ZERO;
    for step in 0..steps {
        let now = start + ms(1) * step;
        // the peer acknowledges every tenth
        while waiting.len() >= 10 && waiting[9].0 <= now {
            let newest = waiting[9];
            waiting.drain(..10);
            in_flight -= 10 * bytes;
            path.acknowledge_bytes(now - path.now, now - newest.1, 10 * bytes);
        }
        if in_flight + u64::from(MTU) < path.window.window() {
            let leaves = free_at.max(now) + Duration::from_nanos(bytes * 1_000_000_000 / rate);
            free_at = leaves;
            in_flight += bytes;
            carried += bytes;
            waiting.push_back((leaves + round_trip, now));
            if step > 5000 {
                worst = worst.max(leaves - now);
            }
        }
    }
    let used = carried as f64 / (rate as f64 * f64::from(steps) * 1e-3);
    (worst, used)
}

#[test]
fn a_bottleneck_that_is_too_narrow_is_used_without_a_long_queue() {
    // 1.3 Mbit/s needed, 1 Mbit/s there: without a window the queue would be 7 s long after 30 s
    for round_trip in [ms(10), ms(50), ms(100), ms(200)] {
        let (worst, used) = bottleneck(163, 125_000, round_trip);
        println!("round trip {round_trip:?}: longest queue {worst:?}, used {used:.3}");
        assert!(worst < ms(50), "{round_trip:?}: {worst:?}");
        assert!(used > 0.9, "{round_trip:?}: {used}");
    }
}
