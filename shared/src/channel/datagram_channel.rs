//! One end of the session's datagrams, the same on both sides: numbers, echoes, loss, round trip, rate control, counts.
//!
//! Pure: bytes and the time are arguments, so that the lab's link and QUIC's datagrams pass through the
//! same code. Everything is counted where it happens.

use std::time::Duration;

use crate::channel::peer::{Arrival, NumbersSpent, Peer};
use crate::channel::rate_control::{RateController, StretchMax};
use crate::stats::session::ChannelCounts;
use crate::time::Time;
use crate::wire::{Datagram, Flags, Message, Side, ToolState};

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

/// One end of the channel.
#[derive(Clone, Debug)]
pub struct DatagramChannel {
    side: Side,
    peer: Peer,
    counts: ChannelCounts,
    began: Time,
    last_sent: Time,
    rate: RateController,
    /// What the datagrams of this side show of it, and what the other's newest shows.
    flags: Flags,
    other: Flags,
}

impl DatagramChannel {
    /// The end of `side`, from `now` on, that never sends less because of congestion.
    pub fn new(side: Side, now: Time) -> Self {
        Self::with_rate_control(side, now, StretchMax::OFF)
    }

    /// The end of `side`, from `now` on, that asks for at most this stretch under congestion.
    pub fn with_rate_control(side: Side, now: Time, stretch_max: StretchMax) -> Self {
        Self {
            side,
            peer: Peer::default(),
            counts: ChannelCounts::default(),
            began: now,
            last_sent: now,
            rate: RateController::new(stretch_max),
            flags: Flags::default(),
            other: Flags::default(),
        }
    }

    /// Reads a datagram that arrived at `now`. None, and counted, if it does not decode, was received before
    /// or is too old to judge.
    pub fn handle(&mut self, now: Time, bytes: &[u8]) -> Option<Received> {
        let Ok(datagram) = Datagram::decode(bytes, self.side.other()) else {
            self.counts.datagrams_malformed += 1;
            return None;
        };
        let Datagram {
            flags,
            envelope,
            message,
        } = datagram;
        let measured = self.peer.round_trip().histogram().total();
        let arrival = self.peer.handle(now, &envelope);
        match arrival {
            Arrival::Newest | Arrival::Reordered => self.counts.received.count(message.kind()),
            Arrival::Duplicate => self.counts.datagrams_duplicate += 1,
            Arrival::TooOld => self.counts.datagrams_too_old += 1,
            Arrival::Implausible => self.counts.datagrams_implausible += 1,
        }
        if self.peer.round_trip().histogram().total() > measured {
            self.control_rate(now);
        }
        if arrival == Arrival::Newest {
            self.other = flags;
        }
        matches!(arrival, Arrival::Newest | Arrival::Reordered).then_some(Received {
            message,
            is_newest: arrival == Arrival::Newest,
        })
    }

    fn control_rate(&mut self, now: Time) {
        let round_trip = self.peer.round_trip();
        if let (Some(latest), Some(least)) = (round_trip.latest(), round_trip.least(now)) {
            self.rate.observe(now, latest, least);
        }
    }

    /// By how much to stretch the times between messages, 1 without congestion ([`RateController`]).
    pub fn stretch(&self) -> f64 {
        self.rate.stretch()
    }

    /// Writes a datagram to be sent at `now`; returns its length. None, and counted, if the message breaks a rule of the
    /// wire.
    ///
    /// # Errors
    /// The session has used up its datagram numbers.
    pub fn encode(
        &mut self,
        now: Time,
        message: Message,
        out: &mut [u8],
    ) -> Result<Option<usize>, NumbersSpent> {
        let envelope = self.peer.stamp(now)?;
        let datagram = Datagram {
            flags: self.flags,
            envelope,
            message,
        };
        let Ok(length) = datagram.encode(out) else {
            self.counts.messages_unsendable += 1;
            return Ok(None);
        };
        self.counts.sent.count(message.kind());
        self.last_sent = now;
        Ok(Some(length))
    }

    /// Sets or clears this side's emergency stop, which every datagram from now on carries.
    pub fn stop(&mut self, stopped: bool) {
        self.flags.stopped = stopped;
    }

    /// What the tool does, which every datagram from now on carries: the slave's side alone has one.
    pub fn show_tool(&mut self, tool: ToolState, energy_holds: bool) {
        self.flags.tool = tool;
        self.flags.energy_holds = energy_holds;
    }

    /// What the newest datagram of the other side shows of it.
    pub fn other(&self) -> Flags {
        self.other
    }

    /// Whose emergency stop is set, this side's before the other's, as far as its newest datagram shows; none if neither's.
    pub fn stopped_by(&self) -> Option<Side> {
        let other = self.other.stopped.then(|| self.side.other());
        if self.flags.stopped {
            Some(self.side)
        } else {
            other
        }
    }

    /// When a heartbeat must go out if nothing else does before.
    pub fn heartbeat_due(&self) -> Time {
        self.last_sent + HEARTBEAT
    }

    /// For how long one of the two ways has been silent: since a datagram of the other side last arrived (or since the
    /// beginning), or since a new answer was due. The longer of the two.
    pub fn silence(&self, now: Time) -> Duration {
        let since_arrival = now.saturating_since(self.last_arrival());
        since_arrival.max(self.peer.unanswered(now))
    }

    /// When a datagram of the other side last arrived, or the beginning.
    pub fn last_arrival(&self) -> Time {
        self.peer.last_arrival().unwrap_or(self.began)
    }

    /// When this end began.
    pub fn began(&self) -> Time {
        self.began
    }

    /// Round trip, loss, reordering.
    pub fn peer(&self) -> &Peer {
        &self.peer
    }

    /// What it sent, received and dropped.
    pub fn counts(&self) -> &ChannelCounts {
        &self.counts
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
        let length = up.encode(now, Message::Heartbeat, &mut buffer);
        let length = length.unwrap().unwrap();
        let opened = down.handle(now, &buffer[..length]).unwrap();
        assert_eq!(
            (opened.message, opened.is_newest),
            (Message::Heartbeat, true)
        );
        assert_eq!(down.handle(now, &buffer[..length]), None, "a duplicate");
        assert_eq!(down.handle(now, &buffer[..length - 1]), None, "cut short");
        let counts = down.counts();
        assert_eq!(counts.received.heartbeats, 1);
        let dropped = (counts.datagrams_duplicate, counts.datagrams_malformed);
        assert_eq!(dropped, (1, 1));
        assert_eq!(up.counts().sent.heartbeats, 1);
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
