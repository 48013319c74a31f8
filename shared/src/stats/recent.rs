//! What happened in the last seconds: one value for each second, forgotten when its second is too long ago.

use crate::time::Time;

/// One slice of the window, ns.
const SLICE_NS: u64 = 1_000_000_000;

/// One `T` for each of the last `N` seconds of the clock, the running one included.
#[derive(Clone, Debug)]
pub struct Recent<T, const N: usize> {
    empty: T,
    slices: [T; N],
    /// Number of the running second since the clock's epoch.
    newest: u64,
}

impl<T: Copy, const N: usize> Recent<T, N> {
    /// A window whose slices are `empty` until something is put into them.
    pub fn new(empty: T) -> Self {
        Self {
            empty,
            slices: [empty; N],
            newest: 0,
        }
    }

    /// Lets time pass: the seconds that begin by `now` are empty. A time before the newest one changes nothing.
    pub fn advance(&mut self, now: Time) {
        let number = now.as_nanos() / SLICE_NS;
        let begun = number.saturating_sub(self.newest).min(N as u64);
        self.newest = self.newest.max(number);
        for passed in 0..begun {
            let empty = self.empty;
            if let Some(slice) = self.slice(number - passed) {
                *slice = empty;
            }
        }
    }

    /// The slice of the second of `now`; of the newest second if `now` is before it.
    pub fn at(&mut self, now: Time) -> Option<&mut T> {
        self.advance(now);
        self.slice(self.newest)
    }

    /// All slices, as of the newest time.
    pub fn iter(&self) -> impl Iterator<Item = &T> {
        self.slices.iter()
    }

    /// Those slices that are not forgotten at `now`, which is not before the newest time.
    pub fn iter_at(&self, now: Time) -> impl Iterator<Item = &T> {
        let number = now.as_nanos() / SLICE_NS;
        let first = (number + 1).saturating_sub(N as u64);
        let remembered = (first..=self.newest).rev().take(N);
        remembered.filter_map(|number| self.slices.get((number % N as u64) as usize))
    }

    fn slice(&mut self, number: u64) -> Option<&mut T> {
        self.slices.get_mut((number % N as u64) as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(s: u64) -> Time {
        Time::from_millis(1000 * s)
    }

    fn values(recent: &Recent<u32, 3>) -> Vec<u32> {
        let mut values: Vec<_> = recent.iter().copied().filter(|&value| value > 0).collect();
        values.sort_unstable();
        values
    }

    #[test]
    fn a_value_lives_for_its_second_and_the_two_after_it() {
        let mut recent = Recent::<u32, 3>::new(0);
        for s in 1..=3 {
            *recent.at(at(s)).unwrap() = s as u32;
        }
        assert_eq!(values(&recent), [1, 2, 3]);
        recent.advance(at(4));
        assert_eq!(values(&recent), [2, 3]);
        let seen: Vec<_> = recent.iter_at(at(5)).copied().collect();
        assert_eq!(seen, [0, 3], "the running second is not there yet");
        assert_eq!(recent.iter_at(at(7)).count(), 0);
        recent.advance(at(1000));
        assert_eq!(values(&recent), [0; 0]);
    }

    #[test]
    fn a_late_time_counts_as_the_newest() {
        let mut recent = Recent::<u32, 3>::new(0);
        recent.advance(at(9));
        *recent.at(at(1)).unwrap() = 7;
        recent.advance(at(11));
        assert_eq!(values(&recent), [7]);
        recent.advance(at(12));
        assert_eq!(values(&recent), [0; 0]);
    }
}
