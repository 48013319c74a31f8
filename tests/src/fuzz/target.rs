//! A fuzz target.

use super::outcome::Outcome;

/// A fuzz target.
#[derive(Clone, Copy)]
pub struct Target {
    /// Its name, also that of its folder in `tests/fuzz/corpus`.
    pub name: &'static str,
    /// What it decodes.
    pub about: &'static str,
    /// Decodes and judges an input.
    ///
    /// It panics where a promise does not hold.
    pub run: fn(&[u8]) -> Outcome,
    /// Inputs to begin with.
    pub seeds: fn() -> Vec<Vec<u8>>,
    /// Words that its inputs are made of.
    pub words: &'static [&'static str],
    /// The longest input, bytes.
    pub longest: usize,
    /// Its share of the inputs of all decoders, in thousandths; 0 of the session, which is counted by itself.
    pub share: u32,
    /// Memory that it may take at once beyond 64 times the length of its input, kB.
    pub room_kb: u64,
}

/// A target with the usual bounds.
pub(super) const fn target(
    name: &'static str,
    about: &'static str,
    run: fn(&[u8]) -> Outcome,
    seeds: fn() -> Vec<Vec<u8>>,
) -> Target {
    Target {
        name,
        about,
        run,
        seeds,
        words: &[],
        longest: 1100,
        share: 40,
        room_kb: 1024,
    }
}

impl Target {
    pub(super) const fn words(mut self, words: &'static [&'static str]) -> Self {
        self.words = words;
        self
    }

    pub(super) const fn longest(mut self, longest: usize) -> Self {
        self.longest = longest;
        self
    }

    pub(super) const fn share(mut self, share: u32) -> Self {
        self.share = share;
        self
    }

    pub(super) const fn room_kb(mut self, room_kb: u64) -> Self {
        self.room_kb = room_kb;
        self
    }

    /// Whether its inputs are sequences of operations on a session, not bytes of a decoder.
    #[must_use]
    pub fn is_session(&self) -> bool {
        self.share == 0
    }
}
