//! The way of a hand's events to the haptic loop: bounded, never waits, and counts what finds no room.
//!
//! A full ring is a loop that stands: what is lost ends as silence, which releases the hand.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use rtrb::{Consumer, Producer, RingBuffer};

use crate::operator::pointer::HandEvent;

/// Where a person's or a device's thread puts what the hand does.
#[derive(Debug)]
pub struct HandEventSender {
    ring: Producer<HandEvent>,
    lost: Arc<AtomicU64>,
}

/// The loop's end.
#[derive(Debug)]
pub struct HandEvents {
    ring: Consumer<HandEvent>,
    lost: Arc<AtomicU64>,
}

/// A way with room for so many events.
#[must_use]
pub fn hand_events(room: usize) -> (HandEventSender, HandEvents) {
    let (producer, consumer) = RingBuffer::new(room);
    let lost = Arc::new(AtomicU64::new(0));
    let sender = HandEventSender {
        ring: producer,
        lost: Arc::clone(&lost),
    };
    let ring = consumer;
    (sender, HandEvents { ring, lost })
}

impl HandEventSender {
    /// Gives the loop an event; it is lost, and counted, where there is no room.
    pub fn send(&mut self, event: HandEvent) {
        if self.ring.push(event).is_err() {
            self.lost.fetch_add(1, Ordering::Relaxed);
        }
    }
}

impl HandEvents {
    /// The next event.
    pub fn next_event(&mut self) -> Option<HandEvent> {
        self.ring.pop().ok()
    }

    /// How many found no room.
    pub fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_finds_no_room_is_lost_and_counted() {
        let (mut sender, mut events) = hand_events(2);
        for paused in [true, false, true] {
            sender.send(HandEvent::Pause(paused));
        }
        assert_eq!(events.lost(), 1);
        let came = [events.next_event(), events.next_event()];
        assert_eq!(came, [true, false].map(|p| Some(HandEvent::Pause(p))));
        assert_eq!(events.next_event(), None);
    }
}
