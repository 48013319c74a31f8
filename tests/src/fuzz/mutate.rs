//! Makes inputs out of inputs: a deterministic mutator, seeded by the project's own generator.
//!
//! It changes several bytes at once as often as one: numbers of 2 to 8 bytes, doubles and singles, varints, words, numbers
//! in texts, ranges that are cut out, repeated, exchanged, or taken from another input.

use mmt_shared::rng::Substream;

use super::numbers::{WRITTEN, below, double, pick, varint, whole};

/// Characters of more than one byte: of two, three and four, marks of direction and a line separator among them.
const CHARACTERS: [&str; 8] = [
    "é", "世", "🦀", "\u{202e}", "\u{2028}", "\u{9b}", "\u{feff}", "\u{0}",
];
/// Bytes with a meaning in texts and in lengths.
const BYTES: &[u8] = b"\x00\x01\x02\x7f\x80\xff \n\r\t\x1b\",;:=[]{}()#-+.%/@eE0";

/// Makes inputs.
pub struct Mutator {
    draws: Substream,
    words: &'static [&'static str],
    longest: usize,
    /// For numbers on their way.
    spare: Vec<u8>,
}

impl Mutator {
    /// One that is a function of `seed`, the target's `name` and the `shard`.
    #[must_use]
    pub fn new(
        seed: u64,
        name: &str,
        shard: u64,
        words: &'static [&'static str],
        longest: usize,
    ) -> Self {
        Self {
            draws: Substream::new(seed, name, shard),
            words,
            longest,
            spare: Vec::new(),
        }
    }

    /// Makes the next input out of one of the pool, mostly of one of those that were `taken`, or out of nothing.
    pub fn next(&mut self, pool: &[Vec<u8>], taken: &[usize], out: &mut Vec<u8>) {
        out.clear();
        if pool.is_empty() || self.draws.bits().is_multiple_of(64) {
            let length = self.below(self.longest.min(96) + 1);
            self.random(length, out);
            return;
        }
        let base = if taken.is_empty() || self.draws.chance(0.3) {
            self.below(pool.len())
        } else {
            *pick(&mut self.draws, taken)
        };
        out.extend_from_slice(&pool[base]);
        // one change half of the time, up to ten
        let mut more = self.draws.bits();
        for _ in 0..10 {
            self.change(pool, out);
            more >>= 1;
            if more & 1 == 0 {
                break;
            }
        }
        out.truncate(self.longest);
    }

    fn below(&mut self, most: usize) -> usize {
        below(&mut self.draws, most)
    }

    fn random(&mut self, length: usize, out: &mut Vec<u8>) {
        while out.len() < length {
            out.extend(self.draws.bits().to_le_bytes());
        }
        out.truncate(length);
    }

    /// Begin and end of a range, mostly a short one.
    fn range(&mut self, length: usize) -> (usize, usize) {
        let from = self.below(length + 1);
        let most = if self.draws.chance(0.2) { length } else { 16 };
        let to = (from + 1 + self.below(most)).min(length);
        (from.min(to), to)
    }

    fn change(&mut self, pool: &[Vec<u8>], bytes: &mut Vec<u8>) {
        let length = bytes.len();
        let at = self.below(length);
        match self.draws.bits() % 20 {
            0 => self.set(bytes, at, |draws, byte| byte ^ 1 << (draws.bits() % 8)),
            1 => self.set(bytes, at, |draws, _| draws.bits() as u8),
            2 => self.set(bytes, at, |draws, _| *pick(draws, BYTES)),
            3 => {
                let room = 2 + self.below(15);
                self.spare.clear();
                let mut spare = std::mem::take(&mut self.spare);
                self.random(room, &mut spare);
                overwrite(bytes, at, &spare);
                self.spare = spare;
            }
            4 | 5 => {
                let number = double(&mut self.draws).to_le_bytes();
                let at = self.place_of(8, length, at);
                overwrite(bytes, at, &number);
            }
            6 => {
                let number = (double(&mut self.draws) as f32).to_le_bytes();
                let at = self.place_of(4, length, at);
                overwrite(bytes, at, &number);
            }
            7 => {
                let mut spare = std::mem::take(&mut self.spare);
                spare.clear();
                whole(&mut self.draws, &mut spare);
                overwrite(bytes, at, &spare);
                self.spare = spare;
            }
            8 => {
                let gone = self.below(3).min(length - at.min(length));
                let varint = varint(&mut self.draws);
                bytes.splice(at..at + gone, varint.iter().copied());
            }
            9 => bytes.truncate(at),
            10 => {
                let more = length + 1 + self.below(8);
                self.random(more, bytes);
            }
            11 => {
                let (from, to) = self.range(length);
                bytes.drain(from..to);
            }
            12 => {
                let (from, to) = self.range(length);
                let copy = bytes[from..to].to_vec();
                bytes.splice(at..at, copy);
            }
            13 => {
                let other = pick(&mut self.draws, pool);
                let from = below(&mut self.draws, other.len() + 1);
                bytes.truncate(at);
                bytes.extend_from_slice(&other[from..]);
            }
            14 => {
                let other = pick(&mut self.draws, pool).as_slice();
                let (from, to) = self.range(other.len());
                overwrite(bytes, at, &other[from..to]);
            }
            15 | 16 if !self.words.is_empty() => {
                let word = *pick(&mut self.draws, self.words);
                let gone = if self.draws.chance(0.5) {
                    word.len().min(length - at.min(length))
                } else {
                    0
                };
                bytes.splice(at..at + gone, word.bytes());
            }
            15..=17 => self.change_number(bytes, at),
            18 => {
                let (from, to) = self.range(length);
                let copy = bytes[from..to].to_vec();
                let times = 2 + self.below(40);
                while bytes.len() < self.longest.min(length + times * copy.len())
                    && !copy.is_empty()
                {
                    let at = to.min(bytes.len());
                    bytes.splice(at..at, copy.iter().copied());
                }
            }
            _ => {
                let character = *pick(&mut self.draws, &CHARACTERS);
                bytes.splice(at..at, character.bytes());
            }
        }
    }

    fn set(&mut self, bytes: &mut [u8], at: usize, to: impl FnOnce(&mut Substream, u8) -> u8) {
        if let Some(byte) = bytes.get_mut(at) {
            *byte = to(&mut self.draws, *byte);
        }
    }

    /// Where a number of so many bytes may stand: anywhere, or a whole number of them before the end, or behind the beginning.
    fn place_of(&mut self, width: usize, length: usize, at: usize) -> usize {
        match self.draws.bits() % 3 {
            0 => at,
            1 => length.saturating_sub(width * (1 + self.below(16))),
            _ => at - at % width,
        }
    }

    /// Exchanges the number that stands at `at` in a text, or next behind it, for another.
    fn change_number(&mut self, bytes: &mut Vec<u8>, at: usize) {
        let tail = bytes.get(at..).unwrap_or_default();
        let digit = tail.iter().position(u8::is_ascii_digit);
        let Some(from) = digit.map(|digit| at + digit) else {
            return;
        };
        let of_number = |byte: &u8| byte.is_ascii_digit() || b".eE+-".contains(byte);
        let length = bytes[from..].iter().position(|byte| !of_number(byte));
        let to = length.map_or(bytes.len(), |length| from + length);
        if self.draws.chance(0.4) {
            let small = self.draws.bits() % 200;
            let number = if self.draws.chance(0.5) {
                small.to_string()
            } else {
                (small as f64 / 64.0).to_string()
            };
            bytes.splice(from..to, number.into_bytes());
            return;
        }
        let number = *pick(&mut self.draws, WRITTEN);
        bytes.splice(from..to, number.bytes());
    }
}

/// Puts these bytes over those at `at`, as far as there are any.
fn overwrite(bytes: &mut [u8], at: usize, over: &[u8]) {
    for (place, byte) in bytes.iter_mut().skip(at).zip(over) {
        *place = *byte;
    }
}
