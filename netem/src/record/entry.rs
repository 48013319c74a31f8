//! What is on record of a packet, and of the run that it is of.
//!
//! It depends on neither form of a record.

use mmt_shared::time::Time;
use serde::{Deserialize, Serialize};

use crate::direction::Direction;
use crate::packet::{Departure, DropCause, Fate};

/// Why a heading is none.
pub(super) const NO_LINE: &str = "the words of a link in the heading are not one line";

/// What a record holds of its run.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Heading {
    /// The seed of both links.
    pub seed: u64,
    /// The link up, in words.
    pub up: String,
    /// The link down, in words.
    pub down: String,
}

impl Heading {
    /// Whether the words of both links are a line each, as in CSV: no control character is among them.
    pub(super) fn is_of_lines(&self) -> bool {
        let words = self.up.chars().chain(self.down.chars());
        !words.into_iter().any(char::is_control)
    }
}

/// One packet, or one copy of one; `T` is how times are given.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Entry<T = Time> {
    /// Which way it went.
    pub direction: Direction,
    /// The how-manieth offer it was, from 0.
    pub number: u64,
    /// When it was offered, counted from the start of the record.
    pub offered: T,
    /// Its length, bytes.
    pub bytes: u32,
    /// Packets in flight and waiting in this direction when it came.
    pub backlog: u32,
    /// What became of it.
    pub end: End<T>,
}

impl Entry {
    /// What is on record of a packet that was sent at the very time when it was due.
    #[must_use]
    pub fn of<T>(direction: Direction, departure: &Departure<T>) -> Self {
        let end = match departure.fate {
            Fate::Dropped(cause) => End::Dropped(cause),
            Fate::Delivered { corrupted_bit, .. } => End::Sent {
                due: departure.due,
                sent: departure.due,
                copy: departure.copy,
                corrupted: corrupted_bit.is_some(),
            },
        };
        Self {
            direction,
            number: departure.number,
            offered: departure.offered_at,
            bytes: u32::try_from(departure.bytes).unwrap_or(u32::MAX),
            backlog: departure.backlog,
            end,
        }
    }

    /// The same with its times counted from `origin`.
    #[must_use]
    pub fn since(self, origin: Time) -> Self {
        let from_origin = |time: Time| Time::ZERO + time.saturating_since(origin);
        self.with_times(from_origin(self.offered), |due, sent| {
            (from_origin(due), from_origin(sent))
        })
    }
}

impl<T: Copy> Entry<T> {
    /// The same with another time of offer, and with what `sending` makes of the times `due` and `sent`.
    pub(super) fn with_times<U>(
        self,
        offered: U,
        sending: impl FnOnce(T, T) -> (U, U),
    ) -> Entry<U> {
        let end = match self.end {
            End::Dropped(cause) => End::Dropped(cause),
            End::Unsent => End::Unsent,
            End::Sent {
                due,
                sent,
                copy,
                corrupted,
            } => {
                let (due, sent) = sending(due, sent);
                End::Sent {
                    due,
                    sent,
                    copy,
                    corrupted,
                }
            }
        };
        Entry {
            direction: self.direction,
            number: self.number,
            offered,
            bytes: self.bytes,
            backlog: self.backlog,
            end,
        }
    }
}

/// What became of a packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum End<T = Time> {
    /// It was sent on.
    Sent {
        /// When it was due by the settings.
        due: T,
        /// When it really was sent; the difference is the lateness of the host.
        sent: T,
        /// Whether it is a copy.
        copy: bool,
        /// Whether a bit of it was turned over.
        corrupted: bool,
    },
    /// The link dropped it.
    Dropped(DropCause),
    /// It came through the link, and the host could not send it.
    Unsent,
}

impl End {
    /// Fate and reason as the CSV spells them.
    pub(super) fn words(&self) -> (&'static str, &'static str) {
        match self {
            Self::Sent {
                copy, corrupted, ..
            } => (
                if *copy { "copy" } else { "sent" },
                if *corrupted { "corrupt" } else { "" },
            ),
            Self::Dropped(cause) => ("dropped", cause.name()),
            Self::Unsent => ("dropped", "socket"),
        }
    }

    /// The other way; none if these do not go together.
    pub(super) fn from_words(
        fate: &str,
        reason: &str,
        due: Option<Time>,
        sent: Option<Time>,
    ) -> Option<Self> {
        if fate == "dropped" {
            if reason == "socket" {
                return Some(Self::Unsent);
            }
            let mut causes = DropCause::ALL.into_iter();
            return causes
                .find(|cause| cause.name() == reason)
                .map(Self::Dropped);
        }
        let copy = match fate {
            "sent" => false,
            "copy" => true,
            _ => return None,
        };
        let corrupted = match reason {
            "" => false,
            "corrupt" => true,
            _ => return None,
        };
        let (due, sent) = (due?, sent?);
        Some(Self::Sent {
            due,
            sent,
            copy,
            corrupted,
        })
    }
}
