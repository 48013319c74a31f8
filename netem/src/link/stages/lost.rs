//! What is lost on a link, as the links behind it see it: they draw for it, and it keeps its place in their order.

use std::cmp::Reverse;
use std::time::Duration;

use mmt_shared::time::Time;

use super::{Stages, Transit};
use crate::config::LinkConfig;
use crate::link::by_time::{Lost, Next};
use crate::link::chances::{Coming, Way};
use crate::link::timeline::Timeline;

/// So many are kept for who never polls.
const LOST_MAX: usize = 1 << 18;

impl<T> Transit<T> {
    /// This packet as one that is lost, and would have left at `due`.
    pub(super) fn as_lost(&self, due: Time, keeps_place: bool) -> Lost {
        Lost {
            due,
            place: self.place,
            copy: self.departure.copy,
            number: self.departure.number,
            lineage: self.lineage,
            bytes: self.departure.bytes,
            ecn_capable: self.ecn_capable,
            keeps_place,
        }
    }
}

impl<T> Stages<T> {
    /// When a packet that is lost would have left. Without a bottleneck it is lost at the end of its way, where it
    /// keeps its place in the order: a loss moves no other packet.
    pub(super) fn end_of_way(
        &mut self,
        settings: &LinkConfig,
        now: Duration,
        bytes: usize,
        replayed: Option<Duration>,
        way: Way,
    ) -> Option<Duration> {
        let free = settings.rate.is_none() && self.bottleneck.len() == 0;
        free.then(|| self.propagation.leave(settings, now, bytes, replayed, way))
    }

    /// Hands what is lost to the links behind this one, if there are any.
    pub(super) fn pass_on_lost(&mut self, lost: Lost) {
        if self.followed && self.lost.len() < LOST_MAX {
            self.lost.push(Reverse(lost));
        }
    }

    /// Takes in what an earlier link lost: nothing is counted and nothing comes out.
    pub(in crate::link) fn miss(&mut self, timeline: &Timeline, before: Lost) {
        let now = timeline.elapsed(before.due);
        while self.goes_on(timeline, now) {}
        let settings = timeline.at(now);
        let lineage = before.lineage << 1;
        let coming = Coming {
            number: before.number,
            bytes: before.bytes,
            ecn_capable: before.ecn_capable,
        };
        let (itself, copy) = self.draw(settings, now, coming, lineage);
        let place = self.next_place();
        let replayed = settings.replay.as_ref().map(|replay| replay.path.at(now));
        for (digit, lot) in [(0, Some(itself)), (1, copy)] {
            let Some(lot) = lot else {
                continue;
            };
            let end = if before.keeps_place && replayed != Some(None) {
                self.end_of_way(settings, now, before.bytes, replayed.flatten(), lot.way)
            } else {
                None
            };
            self.pass_on_lost(Lost {
                due: end.map_or(before.due, |end| timeline.time(end)),
                place,
                copy: before.copy || digit == 1,
                lineage: lineage | digit,
                keeps_place: end.is_some(),
                ..before
            });
        }
    }

    /// The next that goes on to the link behind this one by `now`: by time, then by order of arrival.
    pub(in crate::link) fn poll_next(&mut self, timeline: &Timeline, now: Time) -> Option<Next<T>> {
        let due = self.next_due(timeline, now)?;
        let out = self.out.peek().map(|Reverse(next)| next.key());
        let lost = self
            .lost
            .peek()
            .map(|Reverse(next)| (next.due, next.place, next.copy));
        if lost.is_some_and(|lost| out.is_none_or(|out| lost < out)) {
            return self.lost.pop().map(|Reverse(lost)| Next::Lost(lost));
        }
        self.poll(timeline, due).map(Next::Packet)
    }

    /// Takes in what came from the link before.
    pub(in crate::link) fn receive(&mut self, timeline: &Timeline, next: Next<T>)
    where
        T: Clone,
    {
        match next {
            Next::Packet(packet) => self.follow(timeline, packet),
            Next::Lost(lost) => self.miss(timeline, lost),
        }
    }
}
