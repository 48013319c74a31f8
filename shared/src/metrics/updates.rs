//! How many updates were sent and why: the paper's packet rate.

use crate::model::update::Cause;
use crate::time::TICK_S;

/// Counts updates by cause, and the time that rates are taken over. Fixed size, no allocation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct UpdateCounts {
    by_cause: [u64; Cause::ALL.len()],
    ticks: u64,
    contact_ticks: u64,
}

impl UpdateCounts {
    /// One slave tick T passed, with or without contact of the tool.
    pub fn tick(&mut self, slave_in_contact: bool) {
        self.ticks += 1;
        self.contact_ticks += u64::from(slave_in_contact);
    }

    /// An update was sent.
    pub fn sent(&mut self, cause: Cause) {
        for (slot, of) in self.by_cause.iter_mut().zip(Cause::ALL) {
            *slot += u64::from(of == cause);
        }
    }

    /// Both counts together: one side counted the ticks, the other what was sent.
    #[must_use]
    pub fn plus(mut self, other: &Self) -> Self {
        for (slot, more) in self.by_cause.iter_mut().zip(other.by_cause) {
            *slot += more;
        }
        self.ticks += other.ticks;
        self.contact_ticks += other.contact_ticks;
        self
    }

    /// Updates sent for a cause.
    pub fn of(&self, cause: Cause) -> u64 {
        self.by_cause()
            .find(|(of, _)| *of == cause)
            .map_or(0, |(_, n)| n)
    }

    /// Every cause with its number of updates, in the wire's order; zeros included.
    pub fn by_cause(&self) -> impl Iterator<Item = (Cause, u64)> + '_ {
        Cause::ALL.into_iter().zip(self.by_cause.iter().copied())
    }

    /// Updates sent.
    pub fn total(&self) -> u64 {
        self.by_cause.iter().sum()
    }

    /// Time that passed, s.
    pub fn duration_s(&self) -> f64 {
        self.ticks as f64 * TICK_S
    }

    /// Time in contact, s.
    pub fn contact_s(&self) -> f64 {
        self.contact_ticks as f64 * TICK_S
    }

    /// Updates per second of the run; absent before the first tick.
    pub fn rate_hz(&self) -> Option<f64> {
        (self.ticks > 0).then(|| self.total() as f64 / self.duration_s())
    }

    /// All updates of the run per second of contact; absent without contact.
    pub fn contact_rate_hz(&self) -> Option<f64> {
        (self.contact_ticks > 0).then(|| self.total() as f64 / self.contact_s())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_of_a_hand_computed_case() {
        let mut counts = UpdateCounts::default();
        for tick in 0..4000 {
            counts.tick(tick >= 3000);
        }
        for _ in 0..5 {
            counts.sent(Cause::Deadband);
        }
        counts.sent(Cause::ContactLost);
        assert_eq!((counts.total(), counts.of(Cause::Deadband)), (6, 5));
        assert!((counts.rate_hz().unwrap() - 1.5).abs() < 1e-12);
        assert!((counts.contact_rate_hz().unwrap() - 6.0).abs() < 1e-12);
    }

    #[test]
    fn what_two_counted_apart_is_what_one_would_have_counted() {
        let [mut ticks, mut sent, mut all] = [UpdateCounts::default(); 3];
        for tick in 0..100 {
            ticks.tick(tick < 40);
            all.tick(tick < 40);
        }
        for cause in Cause::ALL {
            sent.sent(cause);
            all.sent(cause);
        }
        assert_eq!(ticks.plus(&sent), all);
    }

    #[test]
    fn every_cause_is_counted_under_its_own_name() {
        let mut counts = UpdateCounts::default();
        for (n, cause) in (1..).zip(Cause::ALL) {
            (0..n).for_each(|_| counts.sent(cause));
        }
        for ((cause, n), (expected, of)) in counts.by_cause().zip((1..).zip(Cause::ALL)) {
            assert_eq!((cause, n, counts.of(of)), (of, expected, expected));
        }
    }

    #[test]
    fn a_rate_without_its_time_is_absent() {
        let mut counts = UpdateCounts::default();
        counts.sent(Cause::Timer);
        assert_eq!((counts.rate_hz(), counts.contact_rate_hz()), (None, None));
        counts.tick(false);
        assert!(counts.rate_hz().is_some());
        assert_eq!(counts.contact_rate_hz(), None);
        counts.tick(true);
        assert!(counts.contact_rate_hz().is_some());
    }
}
