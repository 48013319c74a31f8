//! How many bytes may be on their way: a window for small periodic messages of which only the newest counts.
//!
//! quinn's own controllers grow only while the application fills the window, and take every reordering for
//! congestion; at 1 kHz both end in seconds of queue. This one starts from what the sender may use,
//! `clamp(rate cap × (min RTT + margin) + 2 MTU, 8 kB, 256 kB)`, so that no more than the margin can ever
//! wait in the network. A queue that stands is steered to a target: the window moves by what the queue holds too
//! much or too little, read once a round (cf. LEDBAT, RFC 6817). ECN-CE (RFC 3168) and persistent congestion (RFC
//! 9002, section 7.6) shrink it. Isolated loss is a matter of the radio, not of a queue, and does not; nor does the
//! loss of what was sent into an outage. It must never stay below 8 kB: quinn needs a whole MTU of room for the
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

/// Whether the path is congested.
#[derive(Clone, Copy, Debug)]
enum State {
    /// No queue stands: the window is the path's limit.
    Open,
    /// A queue stands, a mark came, or everything was lost.
    Congested {
        /// What congestion leaves of the window, bytes (RFC 5681's name).
        cwnd: u64,
        /// Up to here the window grows by half a round instead of by what the queue lacks, bytes.
        ssthresh: u64,
        /// What the window makes way with for one round, so that the shortest round trip is seen again, bytes.
        probe_reduction: u64,
    },
}

/// The controller of one path.
#[derive(Clone, Debug)]
pub struct Window {
    cap: RateCap,
    mtu: u64,
    state: State,
    base: Base,
    round: Round,
    silence: Silence,
    /// The quickest answer of the acknowledgement that is being processed.
    quickest: Option<Duration>,
    /// The quickest of those that belong to the round, and the bytes of all of these.
    quickest_of_round: Option<(Duration, u64)>,
    /// The queue of the last round, if it stood.
    standing: Option<Duration>,
    /// When a mark or a loss last shrunk the window: the loss of what was sent before is the same event.
    recovery_start: Option<Instant>,
}

impl Window {
    fn new(cap: RateCap, now: Instant, mtu: u16) -> Self {
        Self {
            cap,
            mtu: u64::from(mtu),
            state: State::Open,
            base: Base::new(now),
            round: Round::new(now),
            silence: Silence::new(now),
            quickest: None,
            quickest_of_round: None,
            standing: None,
            recovery_start: None,
        }
    }

    /// The window on a path without congestion: cap × (base + MARGIN) + 2 MTU, within its bounds.
    fn limit(&self) -> u64 {
        let reach = self.base_round_trip().saturating_add(MARGIN);
        let room = bytes_in(self.cap.bytes_per_s, reach).saturating_add(self.mtu.saturating_mul(2));
        room.clamp(WINDOW_MIN, WINDOW_MAX)
    }

    fn base_round_trip(&self) -> Duration {
        self.base.shortest().unwrap_or(Duration::ZERO)
    }

    /// What congestion leaves of the window, and what of that makes way in this round.
    fn cwnd(&self) -> (u64, u64) {
        match self.state {
            State::Open => (self.limit(), 0),
            State::Congested {
                cwnd,
                probe_reduction,
                ..
            } => (cwnd.min(self.limit()), probe_reduction),
        }
    }

    /// Takes the answer to a packet of `bytes` that was sent at `sent`.
    fn answered(&mut self, now: Instant, sent: Instant, bytes: u64) {
        let took = now.saturating_duration_since(sent);
        self.silence.answered(sent, bytes);
        self.quickest = Some(self.quickest.map_or(took, |quickest| quickest.min(took)));
        // Under congestion a reading must show the window in force, else its change would be made twice.
        if matches!(self.state, State::Open) || self.round.covers(sent) {
            let (quickest, so_far) = self.quickest_of_round.unwrap_or((took, 0));
            self.quickest_of_round = Some((quickest.min(took), so_far.saturating_add(bytes)));
        }
    }

    /// Ends an acknowledgement, and with it perhaps a round.
    fn end_acks(&mut self, now: Instant) {
        let of_round = self.quickest_of_round.take();
        if let Some(took) = self.quickest.take() {
            self.base.record(now, took);
        }
        let (Some((took, bytes)), Some(base)) = (of_round, self.base.shortest()) else {
            return;
        };
        let acks_min = match self.state {
            State::Open => WATCHING_ACKS,
            State::Congested { .. } => STEERING_ACKS,
        };
        if let Some(reading) = self.round.record(now, took, bytes, base, acks_min) {
            self.end_round(now, reading);
        }
    }

    /// Begins congestion when a queue stands, and then steers the window.
    fn end_round(&mut self, now: Instant, reading: Reading) {
        let stands = self.stands(reading.queue);
        let probe = bytes_in(reading.bytes_per_s, TARGET.saturating_mul(2));
        self.state = match self.state {
            State::Open if !stands => State::Open,
            State::Open => {
                // What was answered is what the path can carry: cwnd = rate × (base + TARGET) + 2 MTU
                let reach = self.base_round_trip().saturating_add(TARGET);
                let carried = bytes_in(reading.bytes_per_s, reach);
                self.congested(carried.saturating_add(self.mtu.saturating_mul(2)), 0, probe)
            }
            State::Congested { cwnd, ssthresh, .. } => {
                let probe = if self.base.is_ageing(now) { probe } else { 0 };
                self.congested(steered(cwnd, ssthresh, reading), ssthresh, probe)
            }
        };
    }

    /// Congestion that leaves `cwnd`; none if that is as much as the path's limit.
    fn congested(&self, cwnd: u64, ssthresh: u64, probe_reduction: u64) -> State {
        if cwnd >= self.limit() {
            return State::Open;
        }
        State::Congested {
            cwnd: cwnd.max(WINDOW_MIN),
            ssthresh,
            probe_reduction,
        }
    }

    /// Whether a queue is congestion: it is long for the second time and does not drain.
    fn stands(&mut self, queue: Duration) -> bool {
        let before = self.standing.take();
        self.standing = Some(queue).filter(|queue| *queue > STANDING);
        let remains = |before| queue.saturating_add(DRAINING) > before;
        self.standing.is_some() && before.is_some_and(remains)
    }
}

/// The window after a round under congestion; `off` is how far the queue is from its target.
fn steered(cwnd: u64, ssthresh: u64, reading: Reading) -> u64 {
    let off = bytes_in(reading.bytes_per_s, reading.excess.abs_diff(TARGET));
    if reading.excess > TARGET {
        // cwnd −= rate × (queue − TARGET)
        cwnd.saturating_sub(off)
    } else if cwnd < ssthresh {
        // cwnd += cwnd / 2
        cwnd.saturating_add(cwnd / 2)
    } else {
        // cwnd += rate × (TARGET − queue) / 2
        cwnd.saturating_add(off / 2)
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
        self.end_acks(now);
        if self.silence.end_acks(now, in_flight) {
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
        let is_known = self.recovery_start.is_some_and(|start| sent <= start);
        if self.silence.of_silence(sent) || is_known {
            return;
        }
        let (left, probe_reduction) = self.cwnd();
        let (cwnd, ssthresh) = if is_persistent_congestion {
            // RFC 9002, section 7.6.2: cwnd = the smallest, ssthresh = cwnd / 2
            (WINDOW_MIN, left / 2)
        } else if lost_bytes == 0 {
            // No bytes lost means a mark (ECN-CE): cwnd = 3/4 cwnd
            ((left / 4 * 3).max(WINDOW_MIN), 0)
        } else {
            return;
        };
        self.state = State::Congested {
            cwnd,
            ssthresh,
            probe_reduction,
        };
        self.recovery_start = Some(now);
    }

    fn on_mtu_update(&mut self, new_mtu: u16) {
        self.mtu = u64::from(new_mtu);
    }

    fn window(&self) -> u64 {
        let room = self.mtu.saturating_mul(2);
        let (cwnd, probe_reduction) = self.cwnd();
        let left = cwnd.saturating_sub(probe_reduction);
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
