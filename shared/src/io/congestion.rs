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

use signals::{Base, Round, Silence, Verdict};

mod signals;

/// The smallest window, bytes.
pub const WINDOW_MIN: u64 = 8_000;
/// The largest window, bytes.
pub const WINDOW_MAX: u64 = 256_000;
/// How long a byte may wait in queues beyond the shortest round trip.
pub const MARGIN: Duration = Duration::from_millis(50);

/// A byte that got no answer for this long and two round trips has left the network.
const LIFETIME_MIN: Duration = Duration::from_secs(1);
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

#[cfg(test)]
mod tests;
