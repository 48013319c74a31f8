//! What shows the state of a path: its shortest round trip, its queue, its silence.
//!
//! Pure: time comes as an argument. Nothing here depends on the window.

use std::time::{Duration, Instant};

use crate::stats::queue::RoundTrips;

/// A round lasts at least this long from its first answer on.
const ROUND_MIN: Duration = Duration::from_millis(100);
/// After this long without an answer what is in flight stops counting: three times as long as a peer may hold an
/// acknowledgement, and short enough that a window without congestion is not full by then.
const SILENT: Duration = Duration::from_millis(75);
/// The shortest round trip is forgotten after one to two of these: paths change.
const BASE_MEMORY: Duration = Duration::from_secs(10);
/// A round trip longer by no more than this is the shortest one, seen again.
const AGAIN: Duration = Duration::from_millis(1);

/// The shortest round trip of the last 10 to 20 s.
#[derive(Clone, Debug)]
pub(super) struct Base {
    since: Instant,
    newer: Option<Duration>,
    older: Option<Duration>,
    /// When a round trip hardly longer than the shortest was last seen.
    seen: Instant,
}

impl Base {
    pub(super) fn new(now: Instant) -> Self {
        Self {
            since: now,
            newer: None,
            older: None,
            seen: now,
        }
    }

    pub(super) fn record(&mut self, now: Instant, took: Duration) {
        if now.saturating_duration_since(self.since) >= BASE_MEMORY {
            self.older = self.newer.take();
            self.since = now;
        }
        self.newer = Some(self.newer.map_or(took, |shortest| shortest.min(took)));
        let shortest = self.shortest().unwrap_or(took);
        if took <= shortest.saturating_add(AGAIN) {
            self.seen = now;
        }
    }

    /// Whether the shortest round trip will soon be forgotten unless it is seen again.
    pub(super) fn is_ageing(&self, now: Instant) -> bool {
        now.saturating_duration_since(self.seen) >= BASE_MEMORY / 2
    }

    pub(super) fn shortest(&self) -> Option<Duration> {
        match (self.newer, self.older) {
            (Some(newer), Some(older)) => Some(newer.min(older)),
            (newer, older) => newer.or(older),
        }
    }
}

/// What a round shows of the path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Reading {
    /// How much longer than the shortest round trip the quickest answer took.
    pub(super) excess: Duration,
    /// The queue that there is for certain: the excess less the jitter.
    pub(super) queue: Duration,
    /// What was answered.
    pub(super) bytes_per_s: u64,
}

/// Reads the queue from the answers of a round.
#[derive(Clone, Debug)]
pub(super) struct Round {
    began: Instant,
    /// When the first acknowledgement of the round came.
    first: Option<Instant>,
    /// Of each acknowledgement the quickest.
    round_trips: RoundTrips,
    /// Bytes answered after the first acknowledgement.
    bytes: u64,
}

impl Round {
    pub(super) fn new(now: Instant) -> Self {
        Self {
            began: now,
            first: None,
            round_trips: RoundTrips::NONE,
            bytes: 0,
        }
    }

    /// Whether something sent at `sent` was sent in this round.
    pub(super) fn covers(&self, sent: Instant) -> bool {
        sent >= self.began
    }

    /// Takes an acknowledgement, whose quickest packet took `took`; a reading when that ends the round, which has
    /// `acks_min` of them at least.
    pub(super) fn record(
        &mut self,
        now: Instant,
        took: Duration,
        bytes: u64,
        base: Duration,
        acks_min: u32,
    ) -> Option<Reading> {
        match self.first {
            None => self.first = Some(now),
            Some(_) => self.bytes = self.bytes.saturating_add(bytes),
        }
        self.round_trips.add(took);
        let lasted = now.saturating_duration_since(self.first?);
        if self.round_trips.count() < acks_min || lasted < ROUND_MIN {
            return None;
        }
        let per_s = u128::from(self.bytes) * 1_000_000_000 / lasted.as_nanos().max(1);
        let reading = Reading {
            excess: self.round_trips.excess(base),
            queue: self.round_trips.queue(base),
            bytes_per_s: u64::try_from(per_s).unwrap_or(u64::MAX),
        };
        *self = Self::new(now);
        Some(reading)
    }
}

/// What is in flight, and what of it no longer counts because the path fell silent.
///
/// In an outage nothing declares packets lost, so they would fill the window, and the first message after it would
/// have to wait for a probe. But what was sent into silence waits in no queue that we fill: where a queue is, answers
/// come. So on a silent path there is always room for the next message, at the application's own pace; and once the
/// silence is broken, what was sent into it does not count against the window.
#[derive(Clone, Debug)]
pub(super) struct Silence {
    /// The last answer.
    answered_at: Instant,
    silent: bool,
    in_flight: u64,
    /// When the last silence was broken: what was sent before shows no queue.
    broken: Option<Instant>,
    /// Bytes of that which are still in flight.
    ignored: u64,
}

impl Silence {
    pub(super) fn new(now: Instant) -> Self {
        Self {
            answered_at: now,
            silent: false,
            in_flight: 0,
            broken: None,
            ignored: 0,
        }
    }

    pub(super) fn sent(&mut self, now: Instant, bytes: u64) {
        self.silent = now.saturating_duration_since(self.answered_at) >= SILENT;
        self.in_flight = self.in_flight.saturating_add(bytes);
    }

    /// An answer to what was sent at `sent`.
    pub(super) fn answered(&mut self, sent: Instant, bytes: u64) {
        if self.of_silence(sent) {
            self.ignored = self.ignored.saturating_sub(bytes);
        }
    }

    /// The end of an acknowledgement that left so much in flight. True if it broke a silence.
    pub(super) fn end_acks(&mut self, now: Instant, in_flight: u64) -> bool {
        let broken = std::mem::replace(&mut self.silent, false);
        self.answered_at = now;
        self.in_flight = in_flight;
        if broken {
            self.broken = Some(now);
            self.ignored = in_flight;
        }
        broken
    }

    /// So many bytes are given up for lost.
    pub(super) fn lost(&mut self, bytes: u64) {
        self.in_flight = self.in_flight.saturating_sub(bytes);
        self.ignored = self.ignored.saturating_sub(bytes);
    }

    /// Whether something sent at `sent` was sent before the last silence was broken.
    pub(super) fn of_silence(&self, sent: Instant) -> bool {
        self.broken.is_some_and(|broken| sent <= broken)
    }

    /// The window that there is in truth when congestion leaves `window`; `room` is what one more packet needs.
    pub(super) fn widen(&self, window: u64, room: u64) -> u64 {
        let widened = window.saturating_add(self.ignored);
        if self.silent {
            widened.max(self.in_flight.saturating_add(room))
        } else {
            widened
        }
    }
}
