//! The state machine of a session: operations on both ends, on the network between them and on their clocks.
//!
//! An input is a head of 8 bytes, what the session is made of, and operations of 4 bytes each. Both ends are driven as the live
//! loops and the lab drive them: datagrams in, a tick, datagrams out. Nothing that a link, a peer, a device or a clock does may
//! break what `judge` asserts, and after the last operation a session works, the same one or a new one.

mod bench;
mod bytes;
mod enemy;
mod judge;

use std::time::Duration;

use mmt_shared::model::geometry::Vec2;
use mmt_shared::rng::Substream;
use mmt_shared::wire::Side;

use super::outcome::Outcome;
use bench::{Bench, Network};
pub(super) use bytes::HEAD;
use bytes::place;

const OPERATION: usize = 4;

/// What is done to a session.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Op {
    /// Both ends tick so often.
    Ticks(u32),
    /// One end ticks so often, the other's process stands.
    TicksOf(Side, u32),
    /// The device reads this place, m.
    Reading(Vec2),
    /// From now on the reading goes on with this velocity, m a tick.
    Velocity(Vec2),
    /// What becomes of datagrams.
    Network(Network),
    /// What the network holds back arrives: in order, the other way round, each twice, or every second one.
    Flush(u8),
    /// A datagram of this side arrives again; the how-manieth from the newest.
    Replayed(Side, u8),
    /// The same with bytes changed.
    Mutated(Side, u8),
    /// A datagram of this side with numbers of an enemy.
    Forged(Side, u8),
    /// A datagram arrives at its own sender, or one of an earlier session arrives.
    Foreign(Side, u8),
    /// Bytes that are nothing.
    Garbage(Side, u8),
    /// A clock goes on without ticks.
    Jump(Side, Duration),
    /// An emergency stop.
    Stop(Side, bool),
    /// Whether a hand holds the device.
    Hold(bool),
    /// The session ends at the master.
    Release,
    /// A farewell of the other end, whole or broken, by its length.
    Farewell(u8),
    /// A new session: whether the slave's process remembers, and where the hello would like to be.
    Again(bool, Vec2),
}

fn side(byte: u8) -> Side {
    if byte.is_multiple_of(2) {
        Side::Master
    } else {
        Side::Slave
    }
}

impl Op {
    fn of([code, a, b, c]: [u8; OPERATION]) -> Self {
        let from = side(a);
        match code % 24 {
            0..=5 => Self::Ticks(1 + u32::from(a % 24)),
            6 => Self::TicksOf(from, 1 + u32::from(b % 60)),
            7 => Self::Reading(match a % 12 {
                0 => Vec2::new(200.0 * f64::from(b), -100.0),
                1 => Vec2::new(f64::NAN, 0.0),
                2 => Vec2::new(0.0, f64::INFINITY),
                3 => Vec2::new(5e-324, -0.0),
                4 => Vec2::new(f64::MAX, f64::MIN),
                _ => place(b, c),
            }),
            8 => Self::Velocity(place(b, c) * 1e-3),
            9 => Self::Network(Network::of(a, b)),
            10 => Self::Flush(a),
            11 => Self::Replayed(from, b),
            12 => Self::Mutated(from, b),
            13 | 14 => Self::Forged(from, b),
            15 => Self::Foreign(from, b),
            16 => Self::Garbage(from, b),
            17 => Self::Jump(
                from,
                match c {
                    255 => Duration::from_secs(3600 * u64::from(b)),
                    c => Duration::from_micros(u64::from(b) * 10_000 + u64::from(c) * 37),
                },
            ),
            18 => Self::Stop(from, b < 128),
            19 => Self::Hold(b < 160),
            20 if a.is_multiple_of(4) => Self::Release,
            20 => Self::Farewell(b),
            21 => Self::Again(a.is_multiple_of(2), place(b, c) * 6.0),
            // time passes more often than anything happens
            _ => Self::Ticks(12),
        }
    }
}

/// Runs a sequence and judges every tick of it.
pub(super) fn sequence(input: &[u8]) -> Outcome {
    let Some((head, operations)) = input.split_first_chunk::<HEAD>() else {
        return Outcome::refused(&"no head");
    };
    let mut bench = Bench::new(*head);
    let (operations, _) = operations.as_chunks::<OPERATION>();
    for (number, operation) in (0..).zip(operations) {
        let draws = Substream::new(u64::from(u32::from_le_bytes(*operation)), "fuzz/op", number);
        step(&mut bench, Op::of(*operation), draws);
    }
    bench.judge_all();
    // some sequences, for it takes as long as all the others
    if head[7].is_multiple_of(16) {
        bench.recover();
        bench.judge_all();
    }
    Outcome::taken(bench.seen())
}

fn step(bench: &mut Bench, op: Op, mut draws: Substream) {
    match op {
        Op::Ticks(ticks) => (0..ticks).for_each(|_| bench.tick()),
        Op::TicksOf(side, ticks) => (0..ticks).for_each(|_| bench.tick_of(side)),
        Op::Reading(place) => bench.reading = place,
        Op::Velocity(velocity) => bench.velocity = velocity,
        Op::Network(network) => bench.path.network = network,
        Op::Flush(how) => bench.flush(how),
        Op::Replayed(from, which) => {
            if let Some(bytes) = bench.path.captured(from, which) {
                bench.arrives(from.other(), bytes);
            }
        }
        Op::Mutated(from, which) => {
            if let Some(bytes) = bench.path.captured(from, which) {
                bench.arrives_forged(from.other(), enemy::mutated(bytes, &mut draws));
            }
        }
        Op::Forged(from, which) => {
            if let Some(bytes) = bench
                .path
                .captured(from, which)
                .and_then(|bytes| enemy::forged(&bytes, from, &mut draws))
            {
                bench.arrives_forged(from.other(), bytes);
            }
        }
        Op::Foreign(from, which) => {
            if let Some(bytes) = bench
                .path
                .of_earlier(from, which)
                .or_else(|| bench.path.captured(from.other(), which))
            {
                bench.arrives_forged(from.other(), bytes);
            }
        }
        Op::Garbage(from, length) => {
            let bytes = (0..length).map(|_| draws.bits() as u8).collect();
            bench.arrives(from.other(), bytes);
        }
        Op::Jump(side, by) => bench.jump(side, by),
        Op::Stop(side, stops) => bench.stops[usize::from(side == Side::Slave)] = stops,
        Op::Hold(held) => bench.engaged = held,
        Op::Release => bench.releasing = true,
        Op::Farewell(length) => bench.farewell(length),
        Op::Again(remembers, hip) => bench.begin_again(remembers, hip),
    }
}

/// Sequences to begin with: pushes, outages, stops, jumps, enemies, and one session after another.
pub(super) fn seeds() -> Vec<Vec<u8>> {
    let head = |world: u8, hello: u8| vec![world, hello, 0, 0, 0, 0, 0, 1];
    let run = |world, hello, operations: &[[u8; OPERATION]]| {
        let mut bytes = head(world, hello);
        bytes.extend(operations.as_flattened());
        bytes
    };
    // to the face, and on
    let push = [
        [8, 0, 25, 0],
        [0, 23, 0, 0],
        [0, 23, 0, 0],
        [0, 23, 0, 0],
        [0, 23, 0, 0],
        [0, 23, 0, 0],
        [0, 23, 0, 0],
    ];
    let with = |world, hello, middle: &[[u8; OPERATION]]| {
        run(world, hello, &[&push[..], middle, &push[1..4]].concat())
    };
    let mut seeds = vec![run(0, 0, &[])];
    for world in 0..5 {
        for hello in [0, 1, 7, 12] {
            seeds.push(with(world, hello, &[]));
        }
    }
    let middles: [&[[u8; OPERATION]]; 12] = [
        &[[9, 1, 0, 0], [0, 20, 0, 0], [6, 0, 59, 0], [9, 0, 0, 0]],
        &[[9, 2, 0, 0], [0, 23, 0, 0], [6, 1, 59, 0], [9, 0, 0, 0]],
        &[[9, 4, 0, 0], [0, 23, 0, 0], [10, 1, 0, 0], [9, 0, 0, 0]],
        &[[9, 5, 40, 0], [0, 23, 0, 0], [0, 23, 0, 0]],
        &[[18, 0, 0, 0], [0, 20, 0, 0], [18, 0, 200, 0], [0, 20, 0, 0]],
        &[[18, 1, 0, 0], [0, 20, 0, 0], [18, 1, 200, 0]],
        &[[17, 0, 100, 0], [0, 9, 0, 0], [17, 1, 200, 0], [0, 9, 0, 0]],
        &[
            [11, 0, 3, 0],
            [11, 1, 3, 0],
            [12, 0, 1, 5],
            [12, 1, 1, 6],
            [16, 0, 60, 0],
        ],
        &[
            [13, 0, 0, 1],
            [0, 3, 0, 0],
            [13, 1, 0, 2],
            [0, 3, 0, 0],
            [13, 1, 1, 3],
        ],
        &[[19, 0, 200, 0], [0, 23, 0, 0], [19, 0, 0, 0]],
        &[[20, 0, 0, 0], [0, 23, 0, 0], [21, 0, 220, 0], [0, 23, 0, 0]],
        &[
            [7, 1, 0, 0],
            [0, 5, 0, 0],
            [7, 0, 9, 0],
            [0, 5, 0, 0],
            [7, 6, 200, 0],
            [21, 1, 10, 0],
            [15, 0, 2, 0],
        ],
    ];
    for (number, middle) in (0_u8..).zip(middles) {
        seeds.push(with(number % 5, number, middle));
        if number.is_multiple_of(5) {
            let mut recovers = with(0, 0, middle);
            recovers[7] = 0;
            seeds.push(recovers);
        }
    }
    seeds
}
