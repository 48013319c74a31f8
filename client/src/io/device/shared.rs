//! What the device's thread and the process share: the newest tick in atomic numbers, and who listens to the device.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use mmt_shared::model::geometry::Vec2;
use mmt_shared::plug::PlugCounts;
use mmt_shared::time::Time;
use rtrb::Producer;

use crate::device::link::{HandOutput, Reading};
use crate::io::hand_events::HandEventSender;
use crate::operator::pointer::HandEvent;

/// What the newest tick gave, for another thread.
#[derive(Debug, Default)]
pub(super) struct Cell {
    /// The number of the tick, and the bits of its state below.
    pub(super) tick: AtomicU64,
    pub(super) force: AtomicU64,
    hip: AtomicU64,
}

/// Bits below the number of the tick.
pub(super) const STATE_BITS: u32 = 8;

impl Cell {
    pub(super) fn store(&self, output: &HandOutput) {
        let HandOutput {
            engaged,
            in_contact,
            stopped,
            link_late,
            ..
        } = *output;
        let state = [engaged, in_contact, stopped, link_late];
        let bits = state
            .iter()
            .rev()
            .fold(0, |bits, bit| bits << 1 | u64::from(*bit));
        self.force.store(packed(output.force), Ordering::Relaxed);
        self.hip.store(packed(output.hip), Ordering::Relaxed);
        // whoever sees this tick sees its force
        self.tick
            .store(output.tick << STATE_BITS | bits, Ordering::Release);
    }

    pub(super) fn load(&self) -> HandOutput {
        let tick = self.tick.load(Ordering::Acquire);
        let bit = |number: u32| tick >> number & 1 == 1;
        HandOutput {
            tick: tick >> STATE_BITS,
            force: unpacked(self.force.load(Ordering::Relaxed)),
            hip: unpacked(self.hip.load(Ordering::Relaxed)),
            engaged: bit(0),
            in_contact: bit(1),
            stopped: bit(2),
            link_late: bit(3),
        }
    }
}

/// Two numbers as the device gets them, in one.
pub(super) fn packed(v: Vec2) -> u64 {
    let [x, y] = [v.x, v.y].map(|n| u64::from((n as f32).to_bits()));
    x << 32 | y
}

pub(super) fn unpacked(bits: u64) -> Vec2 {
    let [x, y] = [bits >> 32, bits & u64::from(u32::MAX)].map(|n| f32::from_bits(n as u32).into());
    Vec2::new(x, y)
}

/// A reading as it came, and when.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// By the thread's own clock.
    pub at: Time,
    /// The reading.
    pub reading: Reading,
}

/// Who listens to the device.
#[derive(Debug, Default)]
pub(super) struct Listeners {
    pub(super) events: Option<HandEventSender>,
    pub(super) readings: Option<Producer<Seen>>,
    pub(super) counts: PlugCounts,
}

/// What the thread and the process share.
#[derive(Debug, Default)]
pub(super) struct Shared {
    pub(super) cell: Cell,
    /// No tick ever takes it.
    pub(super) listeners: Mutex<Listeners>,
    pub(super) ended: AtomicBool,
}

impl Shared {
    pub(super) fn listeners(&self) -> MutexGuard<'_, Listeners> {
        self.listeners
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }

    /// Hands over the events of what `take` takes in, with the newest reading and the counts that it returns.
    pub(super) fn take(
        &self,
        at: Time,
        take: impl FnOnce(&mut dyn FnMut(HandEvent)) -> (Option<Reading>, PlugCounts),
    ) {
        let mut listeners = self.listeners();
        let Listeners {
            events,
            readings,
            counts,
        } = &mut *listeners;
        let (reading, counted) = take(&mut |event| {
            if let Some(events) = events {
                events.send(event);
            }
        });
        *counts = counted;
        if let (Some(readings), Some(reading)) = (readings, reading) {
            let _ = readings.push(Seen { at, reading });
        }
    }

    pub(super) fn has_ended(&self) -> bool {
        self.ended.load(Ordering::Acquire)
    }
}
