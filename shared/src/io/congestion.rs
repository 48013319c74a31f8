//! How many bytes may be on their way: a window for small periodic messages of which only the newest counts.
//!
//! quinn's own controllers grow only while the application fills the window, and take every reordering for
//! congestion; at 1 kHz both end in seconds of queue. This one starts from what the sender may use,
//! `clamp(rate cap × (min RTT + margin) + 2 MTU, 8 kB, 256 kB)`, so that no more than the margin can ever
//! wait in the network, and shrinks on a sustained queue, on ECN-CE (RFC 3168) and on persistent congestion
//! (RFC 9002, section 7.6). Isolated loss is a matter of the radio, not of a queue: it does not shrink it.
//! It must never fall below 8 kB: quinn wants a whole MTU of room for the smallest packet.

use std::any::Any;
use std::sync::Arc;
use std::time::{Duration, Instant};

use quinn::congestion::{Controller, ControllerFactory};
use quinn_proto::RttEstimator;

/// The smallest window, bytes.
pub const WINDOW_MIN: u64 = 8_000;
/// The largest window, bytes.
pub const WINDOW_MAX: u64 = 256_000;
/// How long a byte may wait in queues beyond the shortest round trip.
pub const MARGIN: Duration = Duration::from_millis(50);

/// A queue is standing if the quickest answer of a round took this much longer than the quickest of the last
/// 10 s: the peer may hold an acknowledgement for 25 ms, and the hosts add some.
const STANDING: Duration = Duration::from_millis(40);
/// A queue that falls by this much in a round is draining, and is left to it.
const DRAINING: Duration = Duration::from_millis(5);
/// Rounds in a row with a standing queue that count as sustained.
const SUSTAINED_ROUNDS: u8 = 3;
/// A round lasts at least this long, and a round trip, and three acknowledgements.
const ROUND_MIN: Duration = Duration::from_millis(100);
const ROUND_ACKS: u8 = 3;
/// A byte that got no answer for this long and two round trips has left the network.
const LIFETIME_MIN: Duration = Duration::from_secs(1);
/// The shortest round trip is forgotten after one to two of these: paths change.
const BASE_MEMORY: Duration = Duration::from_secs(10);

/// What a side may send, and the factory of its controllers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RateCap {
    /// The most that this side ever sends, bytes a second of UDP payload.
    pub bytes_per_s: u64,
}

impl ControllerFactory for RateCap {
    fn build(self: Arc<Self>, now: Instant, current_mtu: u16) -> Box<dyn Controller> {
        Box::new(Window::new(*self, now, current_mtu))
    }
}

/// The controller of one path.
#[derive(Clone, Debug)]
pub struct Window {
    cap: RateCap,
    mtu: u64,
    base: Base,
    round: Round,
    /// The quickest answer of the acknowledgement that is being processed.
    batch: Option<Duration>,
    /// What congestion leaves of the window; none if there was none lately.
    allowed: Option<u64>,
    /// Up to here a shrunk window grows fast.
    fast_until: u64,
    /// When the window was last shrunk: what was sent before says nothing new.
    shrunk: Option<Instant>,
    silence: Silence,
}

impl Window {
    fn new(cap: RateCap, now: Instant, mtu: u16) -> Self {
        Self {
            cap,
            mtu: u64::from(mtu),
            base: Base::new(now),
            round: Round::new(now),
            batch: None,
            allowed: None,
            fast_until: 0,
            shrunk: None,
            silence: Silence::new(now),
        }
    }

    /// The window on a path without congestion.
    fn limit(&self) -> u64 {
        let shortest = self.base.shortest().unwrap_or(Duration::ZERO);
        let reach_us = shortest.saturating_add(MARGIN).as_micros();
        let bytes = u128::from(self.cap.bytes_per_s).saturating_mul(reach_us) / 1_000_000;
        let bytes = u64::try_from(bytes).unwrap_or(u64::MAX);
        let room = bytes.saturating_add(self.mtu.saturating_mul(2));
        room.clamp(WINDOW_MIN, WINDOW_MAX)
    }

    fn congested(&self) -> u64 {
        self.allowed.unwrap_or(u64::MAX).min(self.limit())
    }

    fn answered(&mut self, took: Duration) {
        self.batch = Some(self.batch.map_or(took, |quickest| quickest.min(took)));
    }

    fn end_batch(&mut self, now: Instant) {
        let Some(took) = self.batch.take() else {
            return;
        };
        self.base.record(now, took);
        let base = self.base.shortest().unwrap_or(took);
        match self.round.record(now, took, base) {
            None => {}
            Some(Verdict::Quiet) => self.grow(),
            Some(Verdict::Unsettled) => {}
            Some(Verdict::Sustained) => self.shrink(now),
        }
    }

    fn grow(&mut self) {
        let Some(allowed) = self.allowed else {
            return;
        };
        let step = if allowed < self.fast_until {
            allowed / 2
        } else {
            self.mtu
        };
        let grown = allowed.saturating_add(step);
        self.allowed = (grown < self.limit()).then_some(grown);
    }

    fn shrink(&mut self, now: Instant) {
        let shrunk = (self.congested() / 4 * 3).max(WINDOW_MIN);
        self.allowed = Some(shrunk);
        self.fast_until = 0;
        self.shrunk = Some(now);
    }

    fn collapse(&mut self, now: Instant) {
        self.fast_until = self.congested() / 2;
        self.allowed = Some(WINDOW_MIN);
        self.shrunk = Some(now);
    }
}

impl Controller for Window {
    fn on_sent(&mut self, now: Instant, bytes: u64, _last_packet_number: u64) {
        let shortest = self.base.shortest().unwrap_or(Duration::ZERO);
        let lifetime = shortest.saturating_mul(2).saturating_add(LIFETIME_MIN);
        self.silence.sent(now, bytes, lifetime);
    }

    fn on_ack(
        &mut self,
        now: Instant,
        sent: Instant,
        _bytes: u64,
        _app_limited: bool,
        _rtt: &RttEstimator,
    ) {
        self.answered(now.saturating_duration_since(sent));
    }

    fn on_end_acks(
        &mut self,
        now: Instant,
        in_flight: u64,
        _app_limited: bool,
        _largest_packet_num_acked: Option<u64>,
    ) {
        self.silence.broken(now, in_flight);
        self.end_batch(now);
    }

    fn on_congestion_event(
        &mut self,
        now: Instant,
        sent: Instant,
        is_persistent_congestion: bool,
        lost_bytes: u64,
    ) {
        if self.shrunk.is_some_and(|shrunk| sent <= shrunk) {
            return;
        }
        // No bytes lost means a mark (ECN-CE).
        if is_persistent_congestion {
            self.collapse(now);
        } else if lost_bytes == 0 {
            self.shrink(now);
        }
    }

    fn on_mtu_update(&mut self, new_mtu: u16) {
        self.mtu = u64::from(new_mtu);
    }

    fn window(&self) -> u64 {
        let window = self.congested().saturating_add(self.silence.expired);
        window.min(WINDOW_MAX)
    }

    fn clone_box(&self) -> Box<dyn Controller> {
        Box::new(self.clone())
    }

    fn initial_window(&self) -> u64 {
        self.limit()
    }

    fn into_any(self: Box<Self>) -> Box<dyn Any> {
        self
    }
}

/// The shortest round trip of the last 10 to 20 s.
#[derive(Clone, Debug)]
struct Base {
    since: Instant,
    newer: Option<Duration>,
    older: Option<Duration>,
}

impl Base {
    fn new(now: Instant) -> Self {
        Self {
            since: now,
            newer: None,
            older: None,
        }
    }

    fn record(&mut self, now: Instant, took: Duration) {
        if now.saturating_duration_since(self.since) >= BASE_MEMORY {
            self.older = self.newer.take();
            self.since = now;
        }
        self.newer = Some(self.newer.map_or(took, |shortest| shortest.min(took)));
    }

    fn shortest(&self) -> Option<Duration> {
        match (self.newer, self.older) {
            (Some(newer), Some(older)) => Some(newer.min(older)),
            (newer, older) => newer.or(older),
        }
    }
}

/// What a round says about the queue.
enum Verdict {
    /// None to speak of.
    Quiet,
    /// One, but not for long, or it is draining.
    Unsettled,
    /// One that stands or grows since some rounds.
    Sustained,
}

/// Watches the quickest answer of each round.
#[derive(Clone, Debug)]
struct Round {
    since: Instant,
    acks: u8,
    quickest: Option<Duration>,
    queue_before: Duration,
    standing: u8,
}

impl Round {
    fn new(now: Instant) -> Self {
        Self {
            since: now,
            acks: 0,
            quickest: None,
            queue_before: Duration::ZERO,
            standing: 0,
        }
    }

    /// Takes the quickest answer of an acknowledgement; speaks when that ends a round.
    fn record(&mut self, now: Instant, took: Duration, base: Duration) -> Option<Verdict> {
        let quickest = self.quickest.map_or(took, |quickest| quickest.min(took));
        self.quickest = Some(quickest);
        self.acks = self.acks.saturating_add(1);
        let over = now.saturating_duration_since(self.since) >= base.max(ROUND_MIN);
        if !over || self.acks < ROUND_ACKS {
            return None;
        }
        let queue = quickest.saturating_sub(base);
        let draining = queue.saturating_add(DRAINING) < self.queue_before;
        *self = Self {
            since: now,
            acks: 0,
            quickest: None,
            queue_before: queue,
            standing: self.standing,
        };
        if queue <= STANDING {
            self.standing = 0;
            return Some(Verdict::Quiet);
        }
        self.standing = if draining { 0 } else { self.standing + 1 };
        if self.standing < SUSTAINED_ROUNDS {
            return Some(Verdict::Unsettled);
        }
        self.standing = 0;
        Some(Verdict::Sustained)
    }
}

/// What left the network while no acknowledgement came.
///
/// In an outage nothing declares packets lost, so they would fill the window and the next message would
/// have to wait for a backed-off probe. But a byte two round trips and a second old is in no queue any
/// more: it makes room for a new one. So a silent path gets at most one window a lifetime.
#[derive(Clone, Debug)]
struct Silence {
    since: Instant,
    newer: u64,
    older: u64,
    expired: u64,
}

impl Silence {
    fn new(now: Instant) -> Self {
        Self {
            since: now,
            newer: 0,
            older: 0,
            expired: 0,
        }
    }

    fn sent(&mut self, now: Instant, bytes: u64, lifetime: Duration) {
        if now.saturating_duration_since(self.since) >= lifetime {
            self.expired = self.expired.saturating_add(self.older);
            self.older = self.newer;
            self.newer = 0;
            self.since = now;
        }
        self.newer = self.newer.saturating_add(bytes);
    }

    fn broken(&mut self, now: Instant, in_flight: u64) {
        *self = Self::new(now);
        self.older = in_flight;
    }
}

#[cfg(test)]
#[path = "congestion_tests.rs"]
mod tests;
