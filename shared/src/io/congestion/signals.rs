//! What a path says about itself: its shortest round trip, its queue, its silence.
//!
//! Pure: time comes as an argument. Nothing here knows the window.

use std::time::{Duration, Instant};

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
/// The shortest round trip is forgotten after one to two of these: paths change.
const BASE_MEMORY: Duration = Duration::from_secs(10);

/// The shortest round trip of the last 10 to 20 s.
#[derive(Clone, Debug)]
pub(super) struct Base {
    since: Instant,
    newer: Option<Duration>,
    older: Option<Duration>,
}

impl Base {
    pub(super) fn new(now: Instant) -> Self {
        Self {
            since: now,
            newer: None,
            older: None,
        }
    }

    pub(super) fn record(&mut self, now: Instant, took: Duration) {
        if now.saturating_duration_since(self.since) >= BASE_MEMORY {
            self.older = self.newer.take();
            self.since = now;
        }
        self.newer = Some(self.newer.map_or(took, |shortest| shortest.min(took)));
    }

    pub(super) fn shortest(&self) -> Option<Duration> {
        match (self.newer, self.older) {
            (Some(newer), Some(older)) => Some(newer.min(older)),
            (newer, older) => newer.or(older),
        }
    }
}

/// What a round says about the queue.
pub(super) enum Verdict {
    /// None to speak of.
    Quiet,
    /// One, but not for long, or it is draining.
    Unsettled,
    /// One that stands or grows since some rounds.
    Sustained,
}

/// Watches the quickest answer of each round.
#[derive(Clone, Debug)]
pub(super) struct Round {
    since: Instant,
    acks: u8,
    quickest: Option<Duration>,
    queue_before: Duration,
    standing: u8,
}

impl Round {
    pub(super) fn new(now: Instant) -> Self {
        Self {
            since: now,
            acks: 0,
            quickest: None,
            queue_before: Duration::ZERO,
            standing: 0,
        }
    }

    /// Takes the quickest answer of an acknowledgement; speaks when that ends a round.
    pub(super) fn record(
        &mut self,
        now: Instant,
        took: Duration,
        base: Duration,
    ) -> Option<Verdict> {
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
pub(super) struct Silence {
    since: Instant,
    newer: u64,
    older: u64,
    /// Bytes that were sent so long ago that they no longer count.
    pub(super) expired: u64,
}

impl Silence {
    pub(super) fn new(now: Instant) -> Self {
        Self {
            since: now,
            newer: 0,
            older: 0,
            expired: 0,
        }
    }

    pub(super) fn sent(&mut self, now: Instant, bytes: u64, lifetime: Duration) {
        if now.saturating_duration_since(self.since) >= lifetime {
            self.expired = self.expired.saturating_add(self.older);
            self.older = self.newer;
            self.newer = 0;
            self.since = now;
        }
        self.newer = self.newer.saturating_add(bytes);
    }

    pub(super) fn broken(&mut self, now: Instant, in_flight: u64) {
        *self = Self::new(now);
        self.older = in_flight;
    }
}
