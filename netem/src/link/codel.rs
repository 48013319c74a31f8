//! Controlled delay (RFC 8289): drops from the head of a queue that has been long for too long.
//!
//! RFC 8289 also spares a queue that holds less than one MTU when a packet is taken out. Instead the target
//! is never below the time that one MTU takes to send, as RFC 8290, section 5.2.1, advises for slow links.

use std::time::Duration;

use mmt_shared::time::duration_nanos;

/// The variables of RFC 8289, section 5.3.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct CodelState {
    first_above: Option<Duration>,
    dropping: bool,
    drop_next: Duration,
    count: u32,
    last_count: u32,
    /// A drop of the dropping state whose successor is not decided yet.
    unsettled: bool,
}

impl CodelState {
    /// The queue has run empty.
    pub(super) fn idle(&mut self) {
        (self.first_above, self.dropping) = (None, false);
    }

    /// Whether the packet taken out of the queue at `now`, after waiting for `wait`, is dropped.
    pub(super) fn drops(
        &mut self,
        target: Duration,
        interval: Duration,
        now: Duration,
        wait: Duration,
    ) -> bool {
        let long = self.has_been_long(target, interval, now, wait);
        if self.dropping {
            self.while_dropping(interval, now, long)
        } else if long {
            self.begin_dropping(interval, now);
            true
        } else {
            false
        }
    }

    fn has_been_long(
        &mut self,
        target: Duration,
        interval: Duration,
        now: Duration,
        wait: Duration,
    ) -> bool {
        if wait < target {
            self.first_above = None;
            return false;
        }
        let end = *self.first_above.get_or_insert(now.saturating_add(interval));
        now >= end
    }

    fn while_dropping(&mut self, interval: Duration, now: Duration, long: bool) -> bool {
        if !long {
            (self.dropping, self.unsettled) = (false, false);
            return false;
        }
        if std::mem::take(&mut self.unsettled) {
            self.drop_next = self.control_law(interval, self.drop_next);
        }
        if now < self.drop_next {
            return false;
        }
        self.count = self.count.saturating_add(1);
        self.unsettled = true;
        true
    }

    fn begin_dropping(&mut self, interval: Duration, now: Duration) {
        let recently = now.saturating_sub(self.drop_next) < interval.saturating_mul(16);
        let delta = self.count.saturating_sub(self.last_count);
        self.count = if delta > 1 && recently { delta } else { 1 };
        self.last_count = self.count;
        self.drop_next = self.control_law(interval, now);
        (self.dropping, self.unsettled) = (true, false);
    }

    /// The time of the next drop: `interval / sqrt(count)` after `from`.
    fn control_law(&self, interval: Duration, from: Duration) -> Duration {
        let nanos = duration_nanos(interval) as f64 / f64::from(self.count.max(1)).sqrt();
        from.saturating_add(Duration::from_nanos(nanos as u64))
    }
}
