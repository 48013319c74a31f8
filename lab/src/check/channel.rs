//! One end's datagrams: numbers, stamps, echoes, the heartbeat, and for how long either way has been silent.

use std::collections::VecDeque;
use std::time::Duration;

use mmt_shared::channel::datagram_channel::DatagramChannel;
use mmt_shared::time::Time;
use mmt_shared::wire::{Datagram, Side};

use super::both::Totals;
use super::intake::Intake;
use super::{Invariant, Verdict};

/// At least this often something leaves.
const HEARTBEAT: Duration = Duration::from_millis(50);
/// An end remembers its departures 10 ms apart: the first without an answer may be this much older than the one it remembers.
const DEPARTURES: Duration = Duration::from_millis(20);
const TENTH: Duration = Duration::from_millis(100);
/// The path before a round trip has been measured.
const PATH_UNKNOWN: Duration = Duration::from_secs(4);

/// What arrived last.
#[derive(Clone, Copy)]
struct Newest {
    number: u32,
    sent: Time,
    stopped: bool,
}

/// One end's datagrams.
pub(super) struct ChannelChecks {
    side: Side,
    began: Time,
    /// Number and time of what left last.
    left: (u32, Time),
    /// Those that have no answer, oldest first.
    unanswered: VecDeque<(u32, Time)>,
    answered_at: Option<Time>,
    answered: u32,
    /// Round trips of the last 10 s: the least and the longest of each tenth of a second that has any, by its beginning.
    round_trips: VecDeque<(Time, Duration, Duration)>,
    latest: Option<Duration>,
    intake: Intake,
    newest: Option<Newest>,
    received: u32,
    /// All that arrived, datagrams or not.
    handled: u64,
    /// What the end had counted as sent by the last tick.
    sent: u64,
    last_arrival: Option<Time>,
    /// When the last tick's datagrams left.
    polled: Time,
}

impl ChannelChecks {
    pub(super) fn new(side: Side, began: Time) -> Self {
        Self {
            side,
            began,
            left: (0, began),
            unanswered: VecDeque::new(),
            answered_at: None,
            answered: 0,
            round_trips: VecDeque::new(),
            latest: None,
            intake: Intake::default(),
            newest: None,
            received: 0,
            handled: 0,
            sent: 0,
            last_arrival: None,
            polled: began,
        }
    }

    /// A datagram that arrived at `at`; returns it if it is to be handled.
    pub(super) fn arrived(&mut self, at: Time, bytes: &[u8]) -> Option<Datagram> {
        self.handled += 1;
        let datagram = Datagram::decode(bytes, self.side.other()).ok()?;
        let number = datagram.envelope.number;
        if !self.intake.takes(number) {
            return None;
        }
        self.received += 1;
        self.last_arrival = self.last_arrival.max(Some(at));
        self.answer(at, &datagram);
        if self.intake.newest == number {
            self.newest = Some(Newest {
                number,
                sent: datagram.envelope.sent,
                stopped: datagram.flags.stopped,
            });
        }
        Some(datagram)
    }

    fn answer(&mut self, at: Time, datagram: &Datagram) {
        let Some(echo) = datagram.envelope.echo else {
            return;
        };
        // an end takes no answer to what never left
        if echo.number > self.left.0 || echo.received > echo.number {
            return;
        }
        if echo.number > self.answered {
            (self.answered, self.answered_at) = (echo.number, Some(at));
            while self
                .unanswered
                .front()
                .is_some_and(|(number, _)| *number <= echo.number)
            {
                self.unanswered.pop_front();
            }
        }
        let away = at.as_nanos().checked_sub(echo.sent.as_nanos());
        if let Some(round_trip) = away.and_then(|away| away.checked_sub(echo.held_ns)) {
            self.measured(at, Duration::from_nanos(round_trip));
        }
    }

    fn measured(&mut self, at: Time, round_trip: Duration) {
        self.latest = Some(round_trip);
        match self.round_trips.back_mut() {
            Some((then, least, most)) if at < *then + TENTH => {
                (*least, *most) = ((*least).min(round_trip), (*most).max(round_trip));
            }
            _ => self.round_trips.push_back((at, round_trip, round_trip)),
        }
        let long_ago = at - Duration::from_secs(11);
        while self
            .round_trips
            .front()
            .is_some_and(|(then, ..)| *then < long_ago)
        {
            self.round_trips.pop_front();
        }
    }

    /// A tick begins: something must have left not long ago. `polled` is when its own datagrams leave.
    pub(super) fn ticked(&mut self, now: Time, polled: Time, verdict: &mut Verdict) {
        let quiet = now.saturating_since(self.left.1);
        let between = now.saturating_since(self.polled);
        let most = HEARTBEAT + between;
        let holds = quiet <= most;
        verdict.judge(Invariant::Heartbeat, now, holds, || {
            format!("nothing left for {quiet:?}, {between:?} after the tick before")
        });
        self.polled = polled;
    }

    /// What it counted so far.
    pub(super) fn totals(&self) -> Totals {
        Totals {
            sent: self.left.0,
            received: self.received,
            newest: self.newest.map_or(0, |newest| newest.number),
        }
    }

    /// Whatever arrived or left is counted once: as received, or as dropped under its name; what neither is, is lost.
    pub(super) fn balances(&mut self, now: Time, channel: &DatagramChannel, verdict: &mut Verdict) {
        let (counts, incoming) = (channel.counts(), channel.peer().incoming());
        let newest = self.newest.map_or(0, |newest| newest.number);
        let (sent, left) = (counts.sent.total(), u64::from(self.left.0));
        // a record shows an end after what left in the tick, the others show it before
        let sent_before = std::mem::replace(&mut self.sent, sent);
        let holds = counts.received.total() + counts.dropped() == self.handled
            && (sent_before..=sent).contains(&left)
            && (incoming.expected, incoming.received) == (newest, self.received)
            && counts.received.total() == u64::from(self.received);
        verdict.judge(Invariant::CountersBalance, now, holds, || {
            format!(
                "{} arrived, {} of them for the first time, the newest is {newest}, {left} left: {counts:?} {incoming:?}",
                self.handled, self.received
            )
        });
    }

    /// A datagram that leaves at `at` while this side's emergency stop is set or not; returns it.
    pub(super) fn left(
        &mut self,
        at: Time,
        bytes: &[u8],
        stops: bool,
        verdict: &mut Verdict,
    ) -> Option<Datagram> {
        let datagram = Datagram::decode(bytes, self.side).ok();
        let envelope = datagram.as_ref().map(|datagram| datagram.envelope);
        let number = self.left.0 + 1;
        let holds = datagram.as_ref().is_some_and(|datagram| {
            let envelope = &datagram.envelope;
            (envelope.number, envelope.sent, datagram.flags.stopped) == (number, at, stops)
        });
        verdict.judge(Invariant::Numbers, at, holds, || {
            format!("number {number} is due at {at:?} with stop {stops}, and {datagram:?} leaves")
        });
        self.left = (number, at);
        self.unanswered.push_back((number, at));
        let echo = envelope.and_then(|envelope| envelope.echo);
        let holds = echo.map(|echo| (echo.number, echo.sent, echo.received))
            == self
                .newest
                .map(|newest| (newest.number, newest.sent, self.received));
        verdict.judge(Invariant::EchoTrue, at, holds, || {
            let newest = self.newest.map(|newest| newest.number);
            format!(
                "{echo:?} leaves, {newest:?} is the newest of {}",
                self.received
            )
        });
        datagram
    }

    /// Whether the other side's emergency stop is set, as far as is known here.
    pub(super) fn other_stops(&self) -> bool {
        self.newest.is_some_and(|newest| newest.stopped)
    }

    /// For how long one of the ways has been silent at `now`: at least and at most. An end remembers its departures
    /// 10 ms apart and its least round trip by the second.
    pub(super) fn silence(&self, now: Time) -> (Duration, Duration) {
        let since_arrival = now.saturating_since(self.last_arrival.unwrap_or(self.began));
        let unanswered = |slack: Duration, window: Duration| {
            let Some((_, sent)) = self.unanswered.front() else {
                return Duration::ZERO;
            };
            let due = *sent + self.path(now, window) + slack;
            now.saturating_since(due.max(self.answered_at.unwrap_or_default()))
        };
        let least = unanswered(DEPARTURES, Duration::from_secs(9));
        let most = unanswered(Duration::ZERO, Duration::from_secs(10) + TENTH);
        (since_arrival.max(least), since_arrival.max(most))
    }

    /// The least round trip of the last seconds; the last one if there is none in that time.
    fn path(&self, now: Time, window: Duration) -> Duration {
        let from = now - window;
        let recent = self.round_trips.iter().filter(|(then, ..)| *then >= from);
        recent
            .map(|(_, least, _)| *least)
            .min()
            .or(self.latest)
            .unwrap_or(PATH_UNKNOWN)
    }

    /// The longest round trip of the last ten seconds.
    pub(super) fn longest_round_trip(&self) -> Option<Duration> {
        self.round_trips.iter().map(|(_, _, most)| *most).max()
    }

    /// The longest of the last 9 s, which no end has forgotten.
    pub(super) fn longest_remembered(&self, now: Time) -> Option<Duration> {
        let since = now - Duration::from_secs(9);
        let recent = self.round_trips.iter().filter(|(at, ..)| *at > since);
        recent.map(|(_, _, most)| *most).max()
    }
}
