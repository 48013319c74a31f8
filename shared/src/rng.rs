//! The one source of randomness: `ChaCha8`, named and pinned, cut into independent substreams.
//!
//! A substream is a pure function of (seed, name, index). Drawing from one leaves every other alone, so
//! switching one feature on does not change what another draws, and two runs of one seed are equal to
//! the bit. There is no global generator.

use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};

/// One stream of random numbers, named after what it is for.
#[derive(Clone, Debug)]
pub struct Substream(ChaCha8Rng);

impl Substream {
    /// The substream of `seed` for the feature `name` (its first 24 bytes count), number `index`.
    ///
    /// The `ChaCha8` key is the seed in little endian followed by the name, padded with zeros; the index
    /// is the stream number (RFC 8439's nonce, 64-bit variant).
    pub fn new(seed: u64, name: &str, index: u64) -> Self {
        let mut key = [0u8; 32];
        let named = seed.to_le_bytes().into_iter().chain(name.bytes());
        for (slot, byte) in key.iter_mut().zip(named) {
            *slot = byte;
        }
        let mut rng = ChaCha8Rng::from_seed(key);
        rng.set_stream(index);
        Self(rng)
    }

    /// Goes to where `draws` numbers of 64 bits have been drawn, forwards or back.
    pub fn seek(&mut self, draws: u64) {
        // in words of 32 bits
        self.0.set_word_pos(u128::from(draws) * 2);
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// Uniform in [0, 1), 53 bits.
    pub fn uniform(&mut self) -> f64 {
        (self.bits() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Uniform in [low, high).
    pub fn uniform_in(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    /// True with the given probability; always takes one draw, whatever the probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.uniform() < probability
    }

    /// Standard normal, Box–Muller. Always takes two draws, so that the position in the stream depends
    /// on the number of calls alone.
    pub fn normal(&mut self) -> f64 {
        let (cos, _) = self.normal_pair();
        cos
    }

    /// Two independent standard normals from two draws, Box–Muller.
    pub fn normal_pair(&mut self) -> (f64, f64) {
        // 1 - u lies in (0, 1]: the logarithm is finite.
        let radius = (-2.0 * libm::log(1.0 - self.uniform())).sqrt();
        let (sin, cos) = libm::sincos(std::f64::consts::TAU * self.uniform());
        (radius * cos, radius * sin)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn same_seed_name_and_index_give_the_same_numbers_and_any_other_do_not() {
        let first = |seed, name, index| Substream::new(seed, name, index).bits();
        assert_eq!(first(1, "netem/up/loss", 0), first(1, "netem/up/loss", 0));
        assert_ne!(first(1, "netem/up/loss", 0), first(2, "netem/up/loss", 0));
        assert_ne!(first(1, "netem/up/loss", 0), first(1, "netem/down/loss", 0));
        assert_ne!(first(1, "netem/up/loss", 0), first(1, "netem/up/loss", 1));
    }

    #[test]
    fn a_draw_is_found_by_its_number() {
        let mut stream = Substream::new(1, "netem/up/loss", 0);
        let drawn: Vec<u64> = (0..300).map(|_| stream.bits()).collect();
        for number in [299, 0, 1, 150, 31, 32, 33] {
            stream.seek(number as u64);
            assert_eq!(stream.bits(), drawn[number]);
        }
    }

    #[test]
    fn the_generator_is_pinned() {
        // A change of generator, key layout or stream layout changes every figure: it must be noticed.
        let mut stream = Substream::new(42, "pin", 7);
        assert_eq!(
            [stream.bits(), stream.bits()],
            [3_506_490_058_682_571_402, 2_104_265_172_425_707_152]
        );
    }

    #[test]
    fn moments_are_those_of_the_named_distributions() {
        let mut stream = Substream::new(3, "moments", 0);
        let n = 200_000;
        let (mut u, mut g, mut g2) = (0.0, 0.0, 0.0);
        for _ in 0..n {
            u += stream.uniform();
            let x = stream.normal();
            g += x;
            g2 += x * x;
        }
        let n = f64::from(n);
        // four standard errors: 0.289, 1 and sqrt(2) over sqrt(n)
        assert!((u / n - 0.5).abs() < 4.0 * 0.289 / n.sqrt());
        assert!((g / n).abs() < 4.0 / n.sqrt());
        assert!((g2 / n - 1.0).abs() < 4.0 * 1.4143 / n.sqrt());
    }
}
