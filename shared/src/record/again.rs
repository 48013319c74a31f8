//! What runs a recorded session again, at either end.

use super::messages::{Arrival, Message, Session};

/// Which input of a record a tick is, and what it gave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TickInput {
    /// Number of the session in the record.
    pub session: u32,
    /// Number of the input in its session, from 0.
    pub index: u64,
    /// Digest of all that the session gave before this tick's datagrams.
    pub digest: u64,
}

/// An end of a recorded session at work again: the same inputs give the same bits.
pub trait EndAgain: Sized {
    /// Its name, and the first part of its topics.
    const SIDE: &'static str;
    /// A recorded tick of it.
    type Tick: Message;
    /// Why it cannot begin.
    type Error;

    /// The end at the beginning of a session.
    ///
    /// # Errors
    /// The record lacks a part of what it is made of, or holds a number that is not accepted.
    fn try_new(session: &Session) -> Result<Self, Self::Error>;

    /// Handles a datagram that arrived.
    fn arrival(&mut self, arrival: &Arrival);

    /// Runs a tick; returns the digest of all that was given before its datagrams, which is to be the recorded one.
    fn tick(&mut self, tick: &Self::Tick) -> u64;

    /// Which input of the record the tick is.
    fn input(tick: &Self::Tick) -> TickInput;
}
