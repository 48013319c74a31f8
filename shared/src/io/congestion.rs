//! How many bytes may be on their way: a window for small periodic messages of which only the newest counts.
//!
//! quinn's own controllers grow only while the application fills the window, and take every reordering for
//! congestion; at 1 kHz both end in seconds of queue. This one starts from what the sender may use,
//! `clamp(rate cap × (min RTT + margin) + 2 MTU, 8 kB, 256 kB)`, so that no more than the margin can ever
//! wait in the network. A queue that stands is steered to a target: the window moves by what the queue holds too
//! much or too little, read once a round (cf. LEDBAT, RFC 6817). ECN-CE (RFC 3168) and persistent congestion (RFC
//! 9002, section 7.6) shrink it. Isolated loss is a matter of the radio, not of a queue, and does not; nor does the
//! loss of what was sent into an outage. It must never stay below 8 kB: quinn wants a whole MTU of room for the
//! smallest packet.

use std::any::Any;
use std::sync::Arc;
use std::time::{Duration, Instant};

use quinn::congestion::{Controller, ControllerFactory};
use quinn_proto::RttEstimator;

use signals::{Base, Reading, Round, Silence};

mod signals;

/// The smallest window, bytes.
pub const WINDOW_MIN: u64 = 8_000;
/// The largest window, bytes.
pub const WINDOW_MAX: u64 = 256_000;
/// How long a byte may wait in queues beyond the shortest round trip.
pub const MARGIN: Duration = Duration::from_millis(50);

/// A queue this long, in two rounds in a row, is congestion.
const STANDING: Duration = Duration::from_millis(30);
/// A queue that fell by this much since the round before is draining, and is left to it.
const DRAINING: Duration = Duration::from_millis(5);
/// Acknowledgements in a round: few, to see a queue early, and more under congestion, to steer by.
const WATCHING_ACKS: u32 = 8;
const STEERING_ACKS: u32 = 16;
/// Under congestion the queue is steered to this length: long enough to use the path, short for a hand.
const TARGET: Duration = Duration::from_millis(12);

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
    /// The quickest of those that belong to the round, and the bytes of all of these.
    of_round: Option<(Duration, u64)>,
    /// The queue of the last round, if it stood.
    standing: Option<Duration>,
    /// What the window gives up for one round, so that the shortest round trip is seen again.
    given_up: u64,
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
            of_round: None,
            standing: None,
            given_up: 0,
            allowed: None,
            fast_until: 0,
            shrunk: None,
            silence: Silence::new(now),
        }
    }

    /// The window on a path without congestion.
    fn limit(&self) -> u64 {
        let shortest = self.base.shortest().unwrap_or(Duration::ZERO);
        let reach = shortest.saturating_add(MARGIN);
        let room = bytes_in(self.cap.bytes_per_s, reach).saturating_add(self.mtu.saturating_mul(2));
        room.clamp(WINDOW_MIN, WINDOW_MAX)
    }

    fn congested(&self) -> u64 {
        self.allowed.unwrap_or(u64::MAX).min(self.limit())
    }

    fn answered(&mut self, now: Instant, sent: Instant, bytes: u64) {
        let took = now.saturating_duration_since(sent);
        self.silence.answered(sent, bytes);
        self.batch = Some(self.batch.map_or(took, |quickest| quickest.min(took)));
        // Under congestion a reading must show the window in force, else its change would be made twice.
        if self.allowed.is_none() || self.round.covers(sent) {
            let (quickest, so_far) = self.of_round.unwrap_or((took, 0));
            self.of_round = Some((quickest.min(took), so_far.saturating_add(bytes)));
        }
    }

    fn end_batch(&mut self, now: Instant) {
        let (quickest, of_round) = (self.batch.take(), self.of_round.take());
        if let Some(took) = quickest {
            self.base.record(now, took);
        }
        let (Some((took, bytes)), Some(base)) = (of_round, self.base.shortest()) else {
            return;
        };
        let acks_min = match self.allowed {
            None => WATCHING_ACKS,
            Some(_) => STEERING_ACKS,
        };
        if let Some(reading) = self.round.record(now, took, bytes, base, acks_min) {
            self.steer(now, reading);
        }
    }

    /// Begins congestion when a queue stands, and then moves the window by what the queue holds too much or too little.
    fn steer(&mut self, now: Instant, reading: Reading) {
        let begins = self.allowed.is_none();
        let stands = self.stands(reading.surely());
        match self.allowed {
            Some(allowed) => self.allow(self.steered(allowed, reading)),
            None if stands => {
                self.fast_until = 0;
                let shortest = self.base.shortest().unwrap_or(Duration::ZERO);
                // a queue stands: what was answered is what the path can carry
                let carried = bytes_in(reading.bytes_per_s, shortest.saturating_add(TARGET));
                self.allow(carried.saturating_add(self.mtu.saturating_mul(2)));
            }
            None => {}
        }
        let look = self.allowed.is_some() && (begins || self.base.is_ageing(now));
        self.given_up = match look {
            true => bytes_in(reading.bytes_per_s, TARGET.saturating_mul(2)),
            false => 0,
        };
    }

    /// Whether a queue is congestion: it is long for the second time and does not drain.
    fn stands(&mut self, queue: Duration) -> bool {
        let before = self.standing.take();
        self.standing = Some(queue).filter(|queue| *queue > STANDING);
        let remains = |before| queue.saturating_add(DRAINING) > before;
        self.standing.is_some() && before.is_some_and(remains)
    }

    fn steered(&self, allowed: u64, reading: Reading) -> u64 {
        let queue = reading.excess;
        match TARGET.checked_sub(queue) {
            Some(_) if allowed < self.fast_until => allowed.saturating_add(allowed / 2),
            Some(lacking) => allowed.saturating_add(bytes_in(reading.bytes_per_s, lacking) / 2),
            None => {
                let excess = queue.saturating_sub(TARGET);
                allowed.saturating_sub(bytes_in(reading.bytes_per_s, excess))
            }
        }
    }

    fn allow(&mut self, bytes: u64) {
        self.allowed = (bytes < self.limit()).then_some(bytes.max(WINDOW_MIN));
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
        self.silence.sent(now, bytes);
    }

    fn on_ack(
        &mut self,
        now: Instant,
        sent: Instant,
        bytes: u64,
        _app_limited: bool,
        _rtt: &RttEstimator,
    ) {
        self.answered(now, sent, bytes);
    }

    fn on_end_acks(
        &mut self,
        now: Instant,
        in_flight: u64,
        _app_limited: bool,
        _largest_packet_num_acked: Option<u64>,
    ) {
        self.end_batch(now);
        if self.silence.heard(now, in_flight) {
            self.round = Round::new(now);
        }
    }

    fn on_congestion_event(
        &mut self,
        now: Instant,
        sent: Instant,
        is_persistent_congestion: bool,
        lost_bytes: u64,
    ) {
        self.silence.lost(lost_bytes);
        if self.silence.of_silence(sent) || self.shrunk.is_some_and(|shrunk| sent <= shrunk) {
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
        let room = self.mtu.saturating_mul(2);
        let left = self.congested().saturating_sub(self.given_up);
        self.silence.widen(left.max(WINDOW_MIN / 2), room)
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

/// What passes in `time` at a rate.
fn bytes_in(bytes_per_s: u64, time: Duration) -> u64 {
    let bytes = u128::from(bytes_per_s).saturating_mul(time.as_micros()) / 1_000_000;
    u64::try_from(bytes).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests;
