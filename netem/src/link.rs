//! One direction of an emulated path, as a pure state machine: a packet goes in, and later it comes out.
//!
//! [`Link::offer`] takes a packet at the time of its arrival. [`Link::poll`] hands out what has left or was
//! dropped by now, and [`Link::poll_timeout`] returns when to poll next. No departure is promised at the offer:
//! packets wait before the bottleneck and leave at the rate of the moment. The order of the stages is that of
//! a real path: MTU, copy, loss, limit, corruption, bottleneck with its queue, propagation with jitter, order,
//! slots. Links in a chain ([`LinkConfig::then`]) stand one behind the other. All times are theoretical: lateness of
//! whoever polls changes none of them, so it does not add up.
//!
//! It must never sleep, read a clock or touch a socket.

use mmt_shared::time::Time;

use crate::config::{ConfigError, LinkConfig};
use crate::counters::LinkCounters;
pub use crate::direction::{Direction, LinkId};
use crate::packet::{Departure, Packet};

mod bottleneck;
mod by_time;
mod chances;
mod codel;
mod correlated;
mod cross;
mod loss_model;
mod propagation;
mod slots;
mod stages;
mod streams;
mod timeline;

use by_time::ByTime;
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
    /// The link behind this one.
    next: Option<Box<Link<T>>>,
    /// Seed and name of the draws of a link behind this one.
    behind: (u64, LinkId),
}

/// How far apart the paths of neighbouring links in a chain are, whose draws are independent.
const NEXT_PATH: u64 = 1 << 32;

impl<T: Clone> Link<T> {
    /// A link with these settings. The draws depend on the seed (`seed`, or that of the settings if they have
    /// one) and `id` alone. Its time begins at [`Time::ZERO`]; see [`Self::set_origin`].
    ///
    /// # Errors
    /// A setting out of its range.
    pub fn try_new(config: LinkConfig, seed: u64, id: LinkId) -> Result<Self, ConfigError> {
        config.check()?;
        Ok(Self::new(Time::ZERO, config, seed, id))
    }

    fn new(origin: Time, config: LinkConfig, seed: u64, id: LinkId) -> Self {
        let seed = config.seed.unwrap_or(seed);
        let path = id.path.wrapping_add(NEXT_PATH);
        let behind = (seed, LinkId { path, ..id });
        let next = config.then.as_deref();
        let next = next.map(|then| Box::new(Self::new(origin, then.clone(), seed, behind.1)));
        let mut stages = Stages::new(seed, id, config.limit.packets);
        stages.followed = next.is_some();
        Self {
            behind,
            stages,
            timeline: Timeline::new(origin, config),
            next,
        }
    }

    /// Takes in the packet that arrives at `now`. Poll first: what is due and not polled yet still counts
    /// against the limit.
    ///
    /// `now` is the theoretical time of arrival: for a link behind another one, [`Departure::due`].
    pub fn offer(&mut self, now: Time, packet: Packet<T>) {
        let backlog = self.in_flight();
        self.stages.offer(&self.timeline, now, packet, backlog);
    }

    /// The next packet that has left or was dropped by `now`: by time, then by order of offer.
    ///
    /// A drop of a copy is counted, and not handed out.
    pub fn poll(&mut self, now: Time) -> Option<Departure<T>> {
        self.poll_in_chain(now).map(|out| out.departure)
    }

    fn poll_in_chain(&mut self, now: Time) -> Option<ByTime<T>> {
        let Some(next) = &mut self.next else {
            return self.stages.poll(&self.timeline, now);
        };
        loop {
            // what has left by the time when something comes leaves first
            let comes = self.stages.next_due(&self.timeline, now);
            if let Some(out) = next.poll_in_chain(comes.unwrap_or(now)) {
                return Some(out);
            }
            let came = self.stages.poll_next(&self.timeline, comes?)?;
            next.stages.receive(&next.timeline, came);
        }
    }

    /// The next packet that came through by `now`, see [`Self::poll`].
    pub fn poll_delivered(&mut self, now: Time) -> Option<Departure<T>> {
        std::iter::from_fn(|| self.poll(now)).find(Departure::is_delivered)
    }

    /// When to poll next; `None` while nothing is on the link. At that time something leaves, is dropped, or
    /// goes on to the next stage.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Time> {
        let next = self.next.as_ref().and_then(|next| next.poll_timeout());
        let own = self.stages.next_event(&self.timeline);
        own.into_iter().chain(next).min()
    }

    /// Nothing that is offered from `now` on leaves before this, as far as the settings and the order show. A bound: it may
    /// well leave later.
    #[must_use]
    pub fn earliest_of_later(&self, now: Time) -> Time {
        let own = self.stages.earliest_of_later(&self.timeline, now);
        self.next
            .as_ref()
            .map_or(own, |next| next.earliest_of_later(own))
    }

    /// Takes new settings from `now` on. What waits before the bottleneck is sent at the new rate and then
    /// takes the new delay; what has passed the bottleneck keeps its time. Counters and random streams go on,
    /// and under [`crate::Order::Fifo`] no packet overtakes an earlier one, not even one of the old settings.
    /// Time is still counted from the origin, and a seed among the new settings changes nothing. A link that the
    /// new chain has no more passes everything at once; one that the old chain did not have begins now.
    ///
    /// # Errors
    /// A setting out of its range; the old settings stay.
    pub fn reconfigure(&mut self, now: Time, config: LinkConfig) -> Result<(), ConfigError> {
        config.check()?;
        self.change(now, config);
        Ok(())
    }

    fn change(&mut self, now: Time, config: LinkConfig) {
        self.stages.settle(&self.timeline, now);
        let then = config.then.as_deref().cloned();
        if let Some(next) = &mut self.next {
            while let Some(came) = self.stages.poll_next(&self.timeline, now) {
                next.stages.receive(&next.timeline, came);
            }
            next.change(now, then.unwrap_or_default());
        } else if let Some(then) = then {
            let (seed, id) = self.behind;
            self.next = Some(Box::new(Self::new(self.timeline.origin, then, seed, id)));
            self.stages.followed = true;
        }
        self.timeline = Timeline::new(self.timeline.origin, config);
    }
}

impl<T> Link<T> {
    /// Sets when the time of the link begins, before the first offer: profiles, outages, replays and all that
    /// is correlated in time count from there.
    pub fn set_origin(&mut self, origin: Time) {
        self.timeline.origin = origin;
        if let Some(next) = &mut self.next {
            next.set_origin(origin);
        }
    }

    /// The settings, with all that they have for later.
    #[must_use]
    pub fn config(&self) -> &LinkConfig {
        &self.timeline.config
    }

    /// Packets and copies on the link.
    #[must_use]
    pub fn in_flight(&self) -> usize {
        let next = self.next.as_ref().map_or(0, |next| next.in_flight());
        self.stages.in_flight.saturating_add(next)
    }

    /// What became of the packets so far.
    #[must_use]
    pub fn counters(&self) -> LinkCounters {
        let own = self.stages.counters;
        match &self.next {
            Some(next) => own.followed_by(next.counters()),
            None => own,
        }
    }
}

#[cfg(test)]
mod tests;
