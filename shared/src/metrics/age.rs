//! Age of information: how old the update is that the master's model rests on.

use std::time::Duration;

use crate::time::Time;

/// Accumulates the age of the newest applied update, tick by tick. Fixed size, no allocation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AgeOfInformation {
    n: u64,
    sum_ns: u128,
    largest_ns: u64,
}

impl AgeOfInformation {
    /// Takes one master tick: the time and the stamp of the HIP sample that the newest applied update
    /// answers, both by the master's clock. The age therefore contains the whole round trip; under a
    /// deadband it is large as long as the model is right.
    pub fn push(&mut self, now: Time, answers: Time) {
        let age = crate::time::duration_nanos(now.saturating_since(answers));
        self.n += 1;
        self.sum_ns += u128::from(age);
        self.largest_ns = self.largest_ns.max(age);
    }

    /// Mean over the ticks since the first update; absent without one.
    pub fn mean(&self) -> Option<Duration> {
        let mean = self.sum_ns.checked_div(u128::from(self.n))?;
        Some(Duration::from_nanos(
            u64::try_from(mean).unwrap_or(u64::MAX),
        ))
    }

    /// Largest age; absent without an update.
    pub fn largest(&self) -> Option<Duration> {
        (self.n > 0).then(|| Duration::from_nanos(self.largest_ns))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_and_largest_age_of_a_hand_computed_case() {
        let mut age = AgeOfInformation::default();
        assert_eq!((age.mean(), age.largest()), (None, None));
        // an update that answers 10 ms, seen at 110, 111 and 112 ms, then a newer one
        for now in [110, 111, 112] {
            age.push(Time::from_millis(now), Time::from_millis(10));
        }
        age.push(Time::from_millis(113), Time::from_millis(14));
        assert_eq!(age.mean(), Some(Duration::from_micros(100_500)));
        assert_eq!(age.largest(), Some(Duration::from_millis(102)));
    }

    #[test]
    fn hostile_stamps_neither_panic_nor_go_below_zero() {
        let mut age = AgeOfInformation::default();
        age.push(Time::ZERO, Time::MAX);
        assert_eq!(age.largest(), Some(Duration::ZERO));
        for _ in 0..3 {
            age.push(Time::MAX, Time::ZERO);
        }
        assert_eq!(age.largest(), Some(Duration::from_nanos(u64::MAX)));
        assert!(age.mean() < age.largest());
    }
}
