//! What one side knows of the link and of the other side: numbers, loss, reordering, round trip.
//!
//! Used by both sides on every datagram that decodes. Pure and of fixed size: time comes as an argument.
//! Loss is counted by the application's own numbers; what the transport declares lost is not loss.

mod departures;
mod round_trip;
mod window;

use std::time::Duration;

use serde::{Deserialize, Serialize};

pub use round_trip::RoundTrip;
pub use window::{Freshness, SequenceWindow, WINDOW};

use crate::time::{Time, duration_nanos};
use crate::wire::{Echo, Envelope};
use departures::Departures;
use window::Window;

/// The last number that a datagram or an update may have. Numbers never wrap: at 2 kHz they last for
/// 24 days, and a session that has used them up must end.
pub const NUMBER_LAST: u32 = u32::MAX;

/// What a round trip may take before one has been measured: the longest that the history can replay.
const PATH_UNKNOWN: Duration = Duration::from_secs(4);
/// An answer may be later than the path's least by this, two heartbeats and some jitter, before what it would answer
/// counts as missing.
const ANSWER_LATE: Duration = Duration::from_millis(120);

/// All numbers of a session have been used: it must end, and a new one begin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the session has used up all {NUMBER_LAST} datagram numbers: end it and begin a new one")]
pub struct NumbersSpent;

/// What a datagram is to the ones before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arrival {
    /// The newest so far.
    Newest,
    /// Older than the newest, seen for the first time: what it carries may still be new.
    Reordered,
    /// Seen before: drop it.
    Duplicate,
    /// So old that nobody knows whether it was received before: drop it. It stays counted as lost.
    TooOld,
    /// So far beyond the newest that one datagram alone does not show that the numbers have gone on: drop it.
    Implausible,
}

/// What has been counted in one direction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct Loss {
    /// Datagrams that were numbered up to the newest one known.
    pub expected: u32,
    /// How many of them arrived.
    pub received: u32,
}

impl Loss {
    /// How many did not arrive, or not yet.
    pub fn lost(&self) -> u32 {
        self.expected.saturating_sub(self.received)
    }

    /// What the path did: without the datagrams that their sender left unsent, and with those that reached the host and
    /// that nobody there read.
    #[must_use]
    pub fn on_the_path(self, unsent: u64, unread: u64) -> Self {
        let count = |n: u64| u32::try_from(n).unwrap_or(u32::MAX);
        let received = self.received.saturating_add(count(unread));
        let expected = self.expected.saturating_sub(count(unsent));
        Self {
            expected: expected.max(received),
            received,
        }
    }

    /// Share that did not arrive, 0 to 1; none before the first.
    pub fn share(&self) -> Option<f64> {
        let share = f64::from(self.lost()) / f64::from(self.expected);
        (self.expected > 0).then_some(share)
    }
}

/// The newest datagram from the other side.
#[derive(Clone, Copy, Debug)]
struct Newest {
    number: u32,
    sent: Time,
    arrived: Time,
}

/// One side's knowledge of the other: at first nothing is sent and nothing received.
#[derive(Clone, Debug, Default)]
pub struct Peer {
    sent: u32,
    departures: Departures,
    /// Number of the newest datagram that the other side has answered.
    answered: u32,
    /// When that answer came.
    answered_at: Option<Time>,
    window: Window,
    newest: Option<Newest>,
    last_arrival: Option<Time>,
    received: u32,
    their_report: Loss,
    echoes_implausible: u64,
    round_trip: RoundTrip,
}

impl Peer {
    /// The envelope of the next outgoing datagram: its number, `now`, and the echo.
    ///
    /// # Errors
    /// After [`NUMBER_LAST`] datagrams there is no number left.
    pub fn stamp(&mut self, now: Time) -> Result<Envelope, NumbersSpent> {
        self.sent = self.sent.checked_add(1).ok_or(NumbersSpent)?;
        self.departures.note(self.sent, now);
        Ok(Envelope {
            number: self.sent,
            sent: now,
            echo: self.echo(now),
        })
    }

    /// The answer to the newest datagram from the other side; none before the first.
    pub fn echo(&self, now: Time) -> Option<Echo> {
        let newest = self.newest?;
        Some(Echo {
            number: newest.number,
            sent: newest.sent,
            held_ns: duration_nanos(now.saturating_since(newest.arrived)),
            received: self.received,
        })
    }

    /// Takes note of a datagram that arrived at `now`.
    pub fn handle(&mut self, now: Time, envelope: &Envelope) -> Arrival {
        let arrival = match self.window.note(envelope.number) {
            window::WindowPosition::Ahead => Arrival::Newest,
            window::WindowPosition::Gap => Arrival::Reordered,
            window::WindowPosition::Taken => Arrival::Duplicate,
            window::WindowPosition::Behind => Arrival::TooOld,
            window::WindowPosition::Implausible => Arrival::Implausible,
        };
        if matches!(arrival, Arrival::Newest | Arrival::Reordered) {
            self.received = self.received.saturating_add(1);
            self.last_arrival = self.last_arrival.max(Some(now));
            if let Some(echo) = envelope.echo {
                self.handle_echo(now, &echo, arrival);
            }
        }
        if arrival == Arrival::Newest {
            self.newest = Some(Newest {
                number: envelope.number,
                sent: envelope.sent,
                arrived: now,
            });
        }
        arrival
    }

    /// Learns from an echo the round trip and the other side's count, unless it cannot be true.
    fn handle_echo(&mut self, now: Time, echo: &Echo, arrival: Arrival) {
        if echo.number > self.sent || echo.received > echo.number {
            self.echoes_implausible += 1;
            return;
        }
        // a clock that runs faster makes the holding longer than the whole way, and an answer all the same
        if echo.number > self.answered {
            (self.answered, self.answered_at) = (echo.number, Some(now));
        }
        let away = now.as_nanos().checked_sub(echo.sent.as_nanos());
        let Some(round_trip) = away.and_then(|away| away.checked_sub(echo.held_ns)) else {
            self.echoes_implausible += 1;
            return;
        };
        self.round_trip.note(now, Duration::from_nanos(round_trip));
        if arrival == Arrival::Newest {
            self.their_report = Loss {
                expected: echo.number,
                received: echo.received,
            };
        }
    }

    /// Number of the newest datagram received, 0 before the first.
    fn newest(&self) -> u32 {
        self.newest.map_or(0, |newest| newest.number)
    }

    /// When a datagram last arrived, duplicates and too old ones left out: what liveness goes by.
    pub fn last_arrival(&self) -> Option<Time> {
        self.last_arrival
    }

    /// Echoes that cannot be true: of a number never sent, or held for longer than it was away.
    pub fn echoes_implausible(&self) -> u64 {
        self.echoes_implausible
    }

    /// Loss from the other side to this one. Reordering is no loss once the late ones are there.
    pub fn incoming(&self) -> Loss {
        Loss {
            expected: self.newest(),
            received: self.received,
        }
    }

    /// Loss from this side to the other, by the other's report.
    pub fn outgoing(&self) -> Loss {
        self.their_report
    }

    /// The same as it looks at `now`: while answers stay away, what should have been answered by now is missing.
    pub fn outgoing_at(&self, now: Time) -> Loss {
        if self.unanswered(now) < ANSWER_LATE {
            return self.their_report;
        }
        let wait = self.path(now) + ANSWER_LATE;
        let due = now
            .as_nanos()
            .checked_sub(duration_nanos(wait))
            .map_or(0, |then| self.departures.newest_by(Time::from_nanos(then)));
        Loss {
            expected: self.their_report.expected.max(due),
            ..self.their_report
        }
    }

    /// How long an answer has been due and no new one has come. It grows when the way there is lost although datagrams still
    /// come. Answers that come later and later are answers: a path that becomes slower is not silent.
    pub fn unanswered(&self, now: Time) -> Duration {
        let sent = self.departures.first_after(self.answered);
        sent.map_or(Duration::ZERO, |sent| {
            let newest = self.answered_at.unwrap_or_default();
            now.saturating_since(newest.max(sent + self.path(now)))
        })
    }

    /// The least round trip of late.
    fn path(&self, now: Time) -> Duration {
        self.round_trip.least(now).unwrap_or(PATH_UNKNOWN)
    }

    /// The round trip without the time that the other side held the answer.
    pub fn round_trip(&self) -> &RoundTrip {
        &self.round_trip
    }
}

#[cfg(test)]
mod tests;
