//! Numbers that break things, in bytes and in words.

use mmt_shared::rng::Substream;

/// Doubles at the edges, subnormal ones among them.
const DOUBLES: [f64; 24] = [
    0.0,
    -0.0,
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::MAX,
    f64::MIN,
    f64::MIN_POSITIVE,
    5e-324,
    -5e-324,
    1e-310,
    f64::EPSILON,
    1.0,
    -1.0,
    1e-9,
    1e9,
    1e18,
    -1e18,
    1.797e308,
    -1e300,
    4_294_967_296.0,
    9_007_199_254_740_993.0,
    0.05,
    200.0,
];

/// Whole numbers at the edges.
const WHOLES: [u64; 16] = [
    0,
    1,
    2,
    0x7f,
    0x80,
    0xff,
    0x7fff,
    0xffff,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_ffff,
    0x1_0000_0000,
    0x7fff_ffff_ffff_ffff,
    0x8000_0000_0000_0000,
    0xffff_ffff_ffff_fffe,
    u64::MAX,
];

/// The same and worse, as people and machines write them.
pub(super) const WRITTEN: &[&str] = &[
    "0",
    "-0",
    "1",
    "-1",
    "+1",
    "00",
    "0x10",
    "1e0",
    "1e308",
    "1e309",
    "-1e309",
    "5e-324",
    "1e-320",
    "1e-400",
    "nan",
    "NaN",
    "-nan",
    "inf",
    "-inf",
    "infinity",
    "null",
    "127",
    "128",
    "255",
    "256",
    "65535",
    "65536",
    "2147483647",
    "2147483648",
    "-2147483649",
    "4294967295",
    "4294967296",
    "9223372036854775807",
    "-9223372036854775808",
    "18446744073709551615",
    "18446744073709551616",
    "1_000",
    "1,5",
    ".5",
    "5.",
    "1e",
    "0.1e-5",
    "99999999999999999999999",
    "100000",
    "-1e11",
    "1e-9",
];

/// A varint of the greatest number, one that is over-long, one that never ends, and small ones.
const VARINTS: [&[u8]; 6] = [
    &[0xff, 0xff, 0xff, 0xff, 0x0f],
    &[0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x01],
    &[0x80, 0x00],
    &[0xff; 11],
    &[0x80, 0x80, 0x80, 0x80, 0x10],
    &[0x7f],
];

/// One of these.
pub(super) fn pick<'a, T>(draws: &mut Substream, of: &'a [T]) -> &'a T {
    &of[below(draws, of.len())]
}

/// A number below `most`; 0 where there is none.
pub(super) fn below(draws: &mut Substream, most: usize) -> usize {
    draws.bits() as usize % most.max(1)
}

/// A double that breaks things: an edge, a subnormal one, any bits, or one next to a common one.
pub(super) fn double(draws: &mut Substream) -> f64 {
    match draws.bits() % 8 {
        0 => f64::from_bits(draws.bits() >> 12),
        1 => f64::from_bits(draws.bits()),
        2 => pick(draws, &DOUBLES).next_up(),
        3 => pick(draws, &DOUBLES).next_down(),
        _ => *pick(draws, &DOUBLES),
    }
}

/// The bytes of a whole number at the edge, of 2, 4 or 8 bytes in either order.
pub(super) fn whole(draws: &mut Substream, out: &mut Vec<u8>) {
    let number = *pick(draws, &WHOLES);
    let number = match draws.bits() % 4 {
        0 => number.wrapping_add(draws.bits() % 5).wrapping_sub(2),
        _ => number,
    };
    let bytes = number.to_le_bytes();
    let bytes = &bytes[..[2, 4, 8][below(draws, 3)]];
    out.extend(bytes);
    if draws.chance(0.3) {
        out.reverse();
    }
}

/// A varint at the edge.
pub(super) fn varint(draws: &mut Substream) -> &'static [u8] {
    let varint: &&[u8] = pick(draws, &VARINTS);
    varint
}
