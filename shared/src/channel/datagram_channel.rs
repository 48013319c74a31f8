//! One end of the session's datagrams, the same on both sides: numbers, echoes, loss, round trip, rate control, counts.
//!
//! Pure: bytes and the time are arguments, so that the lab's link and QUIC's datagrams pass through the
//! same code. Everything is counted where it happens.

use std::time::Duration;

use crate::channel::peer::{Arrival, NumbersSpent, Peer};
use crate::channel::rate_control::{RateController, StretchMax};
use crate::stats::session::{KindCounts, Traffic};
use crate::time::Time;
use crate::wire::{Datagram, EncodeError, Message, Side};

/// Each side sends at least this often: what is needed to call a link dead within a second and to keep
/// the round-trip time fresh, and twenty small packets a second at the most.
pub const HEARTBEAT: Duration = Duration::from_millis(50);

/// What a datagram brought.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Received {
    /// What it is about.
    pub message: Message,
    /// Whether no later datagram had arrived before it.
    pub is_newest: bool,
}

/// Why nothing could be sent.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SendError {
    /// The session has used up its datagram numbers.
    #[error(transparent)]
    Numbers(#[from] NumbersSpent),
    /// The message breaks a rule of the wire.
    #[error(transparent)]
    Encode(#[from] EncodeError),
}

/// One end of the channel.
#[derive(Clone, Debug)]
pub struct DatagramChannel {
    side: Side,
    peer: Peer,
    sent: KindCounts,
    received: KindCounts,
    malformed: u32,
    began: Time,
    last_sent: Time,
    rate: RateController,
}

impl DatagramChannel {
    /// The end of `side`, from `now` on, that never says less because of congestion.
    #[must_use]
    pub fn new(side: Side, now: Time) -> Self {
        Self::with_rate_control(side, now, StretchMax::OFF)
    }

    /// The end of `side`, from `now` on, that asks for at most this stretch under congestion.
    #[must_use]
    pub fn with_rate_control(side: Side, now: Time, stretch_max: StretchMax) -> Self {
        Self {
            side,
            peer: Peer::new(),
            sent: KindCounts::default(),
            received: KindCounts::default(),
            malformed: 0,
            began: now,
            last_sent: now,
            rate: RateController::new(stretch_max),
        }
    }

    /// Reads a datagram that arrived at `now`. None, and counted, if it does not decode, was seen before
    /// or is too old to tell.
    pub fn handle(&mut self, now: Time, bytes: &[u8]) -> Option<Received> {
        let Ok(Datagram { envelope, message }) = Datagram::decode(bytes, self.side.other()) else {
            self.malformed = self.malformed.saturating_add(1);
            return None;
        };
        let measured = self.peer.round_trip().histogram().total();
        let is_newest = match self.peer.handle(now, &envelope, bytes.len()) {
            Arrival::Newest => true,
            Arrival::Reordered => false,
            Arrival::Duplicate | Arrival::TooOld => return None,
        };
        if self.peer.round_trip().histogram().total() > measured {
            self.control_rate(now);
        }
        self.received.count(message.kind());
        Some(Received { message, is_newest })
    }

    fn control_rate(&mut self, now: Time) {
        let round_trip = self.peer.round_trip();
        if let (Some(latest), Some(least)) = (round_trip.latest(), round_trip.least(now)) {
            self.rate.observe(now, latest, least);
        }
    }

    /// By how much to stretch what is said, 1 without congestion ([`RateController`]).
    #[must_use]
    pub fn stretch(&self) -> f64 {
        self.rate.stretch()
    }

    /// Writes a datagram to be sent at `now`; returns its length.
    ///
    /// # Errors
    /// When no number is left or the message breaks a rule of the wire.
    pub fn encode(
        &mut self,
        now: Time,
        message: Message,
        out: &mut [u8],
    ) -> Result<usize, SendError> {
        let envelope = self.peer.stamp(now)?;
        let length = Datagram { envelope, message }.encode(out)?;
        self.sent.count(message.kind());
        self.last_sent = now;
        Ok(length)
    }

    /// When a heartbeat must go out if nothing else does before.
    #[must_use]
    pub fn heartbeat_due(&self) -> Time {
        self.last_sent + HEARTBEAT
    }

    /// Time since the other side was last heard, or since the beginning.
    #[must_use]
    pub fn silence(&self, now: Time) -> Duration {
        now.saturating_since(self.last_heard())
    }

    /// When the other side was last heard, or the beginning.
    #[must_use]
    pub fn last_heard(&self) -> Time {
        self.peer.last_arrival().unwrap_or(self.began)
    }

    /// When this end began.
    #[must_use]
    pub fn began(&self) -> Time {
        self.began
    }

    /// Round trip, loss, reordering.
    #[must_use]
    pub fn peer(&self) -> &Peer {
        &self.peer
    }

    /// Messages sent and received so far; what the socket counts is not known here and 0.
    #[must_use]
    pub fn traffic(&self) -> Traffic {
        Traffic {
            sent: self.sent,
            received: self.received,
            duplicates: self.peer.duplicates(),
            too_old: self.peer.too_old(),
            malformed: self.malformed,
            ..Traffic::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::DATAGRAM_MAX;

    #[test]
    fn what_one_end_sends_the_other_receives_once_and_counts() {
        let (mut up, mut down) = (
            DatagramChannel::new(Side::Master, Time::ZERO),
            DatagramChannel::new(Side::Slave, Time::ZERO),
        );
        let mut buffer = [0; DATAGRAM_MAX];
        let now = Time::from_millis(5);
        let length = up.encode(now, Message::Heartbeat, &mut buffer).unwrap();
        let opened = down.handle(now, &buffer[..length]).unwrap();
        assert_eq!(
            (opened.message, opened.is_newest),
            (Message::Heartbeat, true)
        );
        assert_eq!(down.handle(now, &buffer[..length]), None, "a duplicate");
        assert_eq!(down.handle(now, &buffer[..length - 1]), None, "cut short");
        let traffic = down.traffic();
        assert_eq!(traffic.received.heartbeats, 1);
        assert_eq!((traffic.duplicates, traffic.malformed), (1, 1));
        assert_eq!(up.traffic().sent.heartbeats, 1);
        // the master's own messages do not open at the master
        assert_eq!(up.handle(now, &buffer[..length - 1]), None);
    }

    #[test]
    fn a_heartbeat_is_due_fifty_milliseconds_after_anything_was_sent() {
        let mut end = DatagramChannel::new(Side::Slave, Time::from_millis(100));
        assert_eq!(end.heartbeat_due(), Time::from_millis(150));
        let mut buffer = [0; DATAGRAM_MAX];
        end.encode(Time::from_millis(120), Message::Heartbeat, &mut buffer)
            .unwrap();
        assert_eq!(end.heartbeat_due(), Time::from_millis(170));
        assert_eq!(
            end.silence(Time::from_millis(130)),
            Duration::from_millis(30)
        );
    }
}
