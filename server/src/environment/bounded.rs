//! A short list with a fixed bound, held in place, so that a configuration stays `Copy`.
//!
//! Reads and writes as an ordinary sequence. It must never hold more than its bound.

use serde::{Deserialize, Serialize};

/// At most `N` items, in order.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[serde(
    try_from = "Vec<T>",
    into = "Vec<T>",
    bound(
        serialize = "T: Copy + Serialize",
        deserialize = "T: Copy + Default + Deserialize<'de>"
    )
)]
pub struct Bounded<T, const N: usize> {
    items: [T; N],
    length: usize,
}

/// More items than the list may hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a list of {given} is longer than the accepted {max}")]
pub struct TooLong {
    /// How many there were.
    pub given: usize,
    /// How many there may be.
    pub max: usize,
}

impl<T: Copy + Default, const N: usize> Bounded<T, N> {
    /// The list of these items.
    ///
    /// # Errors
    /// When there are more than `N`.
    pub fn try_new(items: &[T]) -> Result<Self, TooLong> {
        let mut list = Self::default();
        let given = items.len();
        let slots = list.items.get_mut(..given);
        slots
            .ok_or(TooLong { given, max: N })?
            .copy_from_slice(items);
        list.length = given;
        Ok(list)
    }
}

impl<T, const N: usize> Bounded<T, N> {
    /// The items.
    #[must_use]
    pub fn as_slice(&self) -> &[T] {
        self.items.get(..self.length).unwrap_or_default()
    }

    /// The items, to be changed in place.
    pub fn as_mut_slice(&mut self) -> &mut [T] {
        self.items.get_mut(..self.length).unwrap_or_default()
    }
}

impl<T: Copy + Default, const N: usize> Default for Bounded<T, N> {
    fn default() -> Self {
        Self {
            items: [T::default(); N],
            length: 0,
        }
    }
}

impl<T: PartialEq, const N: usize> PartialEq for Bounded<T, N> {
    fn eq(&self, other: &Self) -> bool {
        self.as_slice() == other.as_slice()
    }
}

impl<T: Copy + Default, const N: usize> TryFrom<Vec<T>> for Bounded<T, N> {
    type Error = TooLong;

    fn try_from(items: Vec<T>) -> Result<Self, TooLong> {
        Self::try_new(&items)
    }
}

impl<T: Copy, const N: usize> From<Bounded<T, N>> for Vec<T> {
    fn from(list: Bounded<T, N>) -> Self {
        list.as_slice().to_vec()
    }
}
