//! One direction of an emulated path, as a pure state machine: a packet goes in, and later it comes out.
//!
//! [`Link::offer`] takes a packet at the time of its arrival. [`Link::poll`] hands out what has left or was
//! dropped by now, and [`Link::poll_timeout`] returns when to poll next. No departure is promised at the offer:
//! packets wait before the bottleneck and leave at the rate of the moment. The order of the stages is that of
//! a real path: MTU, copy, loss, limit, corruption, bottleneck with its queue, propagation with jitter, order,
//! slots. All times are theoretical: lateness of whoever polls changes none of them, so it does not add up.
//!
//! It must never sleep, read a clock or touch a socket.

use mmt_shared::time::Time;

use crate::config::{ConfigError, LinkConfig};
use crate::counters::LinkCounters;
pub use crate::direction::{Direction, LinkId};
use crate::packet::{Departure, Packet};

mod bottleneck;
mod by_time;
mod codel;
mod correlated;
mod loss_model;
mod propagation;
mod slots;
mod stages;
mod streams;
mod timeline;

use stages::Stages;
use timeline::Timeline;

/// One direction of an emulated path with the packets on it. A pure function of its settings, its seed and
/// the calls.
///
/// The law that holds at any moment: offered + duplicated = dropped + in flight + delivered.
#[derive(Clone, Debug)]
pub struct Link<T> {
    timeline: Timeline,
    stages: Stages<T>,
}

impl<T: Clone> Link<T> {
    /// A link with these settings. The draws depend on the seed (`seed`, or that of the settings if they have
    /// one) and `id` alone. Its time begins at [`Time::ZERO`]; see [`Self::set_origin`].
    ///
    /// # Errors
    /// A setting out of its range.
    pub fn try_new(config: LinkConfig, seed: u64, id: LinkId) -> Result<Self, ConfigError> {
        config.check()?;
        let seed = config.seed.unwrap_or(seed);
        Ok(Self {
            stages: Stages::new(seed, id, config.limit.packets),
            timeline: Timeline::new(Time::ZERO, config),
        })
    }

    /// Takes in the packet that arrives at `now`. Poll first: what is due and not polled yet still counts
    /// against the limit.
    ///
    /// `now` is the theoretical time of arrival: for a link behind another one, [`Departure::due`].
    pub fn offer(&mut self, now: Time, packet: Packet<T>) {
        self.stages.offer(&self.timeline, now, packet);
    }

    /// The next packet that has left or was dropped by `now`: by time, then by order of offer.
    ///
    /// A drop of a copy is counted, and not handed out.
    pub fn poll(&mut self, now: Time) -> Option<Departure<T>> {
        self.stages.poll(&self.timeline, now)
    }

    /// The next packet that came through by `now`, see [`Self::poll`].
    pub fn poll_delivered(&mut self, now: Time) -> Option<Departure<T>> {
        std::iter::from_fn(|| self.poll(now)).find(Departure::is_delivered)
    }

    /// When to poll next; `None` while nothing is on the link. At that time something leaves, is dropped, or
    /// goes on to the next stage.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Time> {
        self.stages.next_event(&self.timeline)
    }

    /// Takes new settings from `now` on. What waits before the bottleneck is sent at the new rate and then
    /// takes the new delay; what has passed the bottleneck keeps its time. Counters and random streams go on,
    /// and under [`crate::Order::Fifo`] no packet overtakes an earlier one, not even one of the old settings.
    /// Time is still counted from the origin, and a seed among the new settings changes nothing.
    ///
    /// # Errors
    /// A setting out of its range; the old settings stay.
    pub fn reconfigure(&mut self, now: Time, config: LinkConfig) -> Result<(), ConfigError> {
        config.check()?;
        self.stages.settle(&self.timeline, now);
        self.timeline = Timeline::new(self.timeline.origin, config);
        Ok(())
    }
}

impl<T> Link<T> {
    /// Sets when the time of the link begins, before the first offer: profiles, outages, replays and all that
    /// is correlated in time count from there.
    pub fn set_origin(&mut self, origin: Time) {
        self.timeline.origin = origin;
    }

    /// The settings, with all that they have for later.
    #[must_use]
    pub fn config(&self) -> &LinkConfig {
        &self.timeline.config
    }

    /// Packets and copies on the link.
    #[must_use]
    pub fn in_flight(&self) -> usize {
        self.stages.in_flight
    }

    /// What became of the packets so far.
    #[must_use]
    pub fn counters(&self) -> LinkCounters {
        self.stages.counters
    }
}

#[cfg(test)]
mod tests;
