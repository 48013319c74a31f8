//! What a broken or malicious peer sends: bytes that were changed, and datagrams that keep the wire's rules and no other.

use std::time::Duration;

use mmt_shared::model::sample::{ForceCounts, HipCounts};
use mmt_shared::model::tool::HandPort;
use mmt_shared::rng::Substream;
use mmt_shared::time::Time;
use mmt_shared::wire::{DATAGRAM_MAX, Datagram, Echo, Message, SampleBlock, Side};

use crate::fuzz::numbers::{below, double, pick};

/// A copy with up to three parts changed, or cut off.
pub(super) fn mutated(mut bytes: Vec<u8>, draws: &mut Substream) -> Vec<u8> {
    if draws.chance(0.2) {
        bytes.truncate(below(draws, bytes.len()));
        return bytes;
    }
    for _ in 0..=draws.bits() % 3 {
        let at = below(draws, bytes.len());
        let over = draws.bits().to_le_bytes();
        let length = 1 + below(draws, 4);
        for (place, byte) in bytes.iter_mut().skip(at).zip(&over[..length]) {
            *place = *byte;
        }
    }
    bytes
}

/// A datagram like this one whose numbers are those of an enemy; none where the wire refuses them.
pub(super) fn forged(bytes: &[u8], from: Side, draws: &mut Substream) -> Option<Vec<u8>> {
    let mut datagram = Datagram::decode(bytes, from).ok()?;
    let envelope = &mut datagram.envelope;
    envelope.number = match draws.bits() % 10 {
        0 => u32::MAX,
        1 => draws.bits() as u32,
        2 => envelope.number,
        _ => envelope
            .number
            .saturating_add(1 + draws.bits() as u32 % 100),
    };
    if draws.chance(0.2) {
        envelope.sent = time(envelope.sent, draws);
    }
    envelope.echo = envelope.echo.map(|echo| false_echo(echo, draws));
    datagram.flags.stopped ^= draws.chance(0.05);
    datagram.message = match datagram.message {
        Message::Command(mut command) => {
            command.newest_update = sequence(command.newest_update, draws);
            command.samples = samples(&command.samples, draws);
            if draws.chance(0.3) {
                command.port = Some(HandPort {
                    in_j: double(draws).abs(),
                });
            }
            Message::Command(command)
        }
        Message::Update(mut update) => {
            update.sequence = sequence(update.sequence, draws);
            update.answers = time(update.answers, draws);
            Message::Update(update)
        }
        Message::Scene(mut scene) => {
            scene.object.angle = double(draws);
            scene.force.x = double(draws);
            Message::Scene(scene)
        }
        Message::Tool(mut tool) => {
            tool.in_j = double(draws).abs();
            tool.answers = time(tool.answers, draws);
            tool.force = ForceCounts {
                x: draws.bits() as i32,
                y: i32::MIN,
            };
            Message::Tool(tool)
        }
        Message::Heartbeat => Message::Heartbeat,
    };
    let is_update = matches!(datagram.message, Message::Update(_));
    let mut out = [0; DATAGRAM_MAX];
    let length = datagram.encode(&mut out).ok()?;
    let mut made = out.get(..length)?.to_vec();
    if is_update {
        state(&mut made, draws);
    }
    Some(made)
}

fn time(honest: Time, draws: &mut Substream) -> Time {
    match draws.bits() % 6 {
        0 => Time::MAX,
        1 => Time::ZERO,
        2 => Time::from_nanos(draws.bits()),
        3 => honest + Duration::from_millis(draws.bits() % 5000),
        _ => honest - Duration::from_millis(draws.bits() % 5000),
    }
}

fn false_echo(echo: Echo, draws: &mut Substream) -> Echo {
    match draws.bits() % 5 {
        0 => Echo {
            number: u32::MAX,
            ..echo
        },
        1 => Echo {
            held_ns: draws.bits() >> (draws.bits() % 64),
            ..echo
        },
        2 => Echo {
            sent: time(echo.sent, draws),
            ..echo
        },
        3 => Echo {
            received: draws.bits() as u32,
            ..echo
        },
        _ => echo,
    }
}

fn sequence(honest: u32, draws: &mut Substream) -> u32 {
    match draws.bits() % 4 {
        0 => u32::MAX,
        1 => honest.saturating_add(draws.bits() as u32 % 100),
        2 => draws.bits() as u32,
        _ => honest,
    }
}

/// The same samples at another time and another place.
fn samples(honest: &SampleBlock, draws: &mut Substream) -> SampleBlock {
    let ahead = match draws.bits() % 6 {
        0 => Duration::from_secs(draws.bits() % 4000),
        1 => Duration::from_millis(draws.bits() % 2000),
        2 => Duration::from_nanos(draws.bits()),
        _ => Duration::ZERO,
    };
    let far = (draws.bits() as i32) >> (draws.bits() % 32);
    let mut made = SampleBlock::default();
    for sample in honest.as_slice() {
        let mut sample = *sample;
        sample.stamp += ahead;
        sample.hip = HipCounts {
            x: sample.hip.x.wrapping_add(far),
            y: far,
        };
        sample.force = ForceCounts {
            x: far,
            y: i32::MAX,
        };
        // the first alone where the others do not fit
        if made.push(sample).is_err() {
            break;
        }
    }
    made
}

/// Numbers of the state that an update ends with, one or all of them: extreme, or near what was there.
fn state(update: &mut [u8], draws: &mut Substream) {
    const EDGES: [f64; 10] = [
        0.0, 5e-324, 3e-6, 0.05, 50.0, 200.0, 34.0, 1.0, -5.0, 6283.0,
    ];
    let all = draws.chance(0.2);
    let from = update.len().saturating_sub(15 * 8);
    let (numbers, _) = update[from..].as_chunks_mut::<8>();
    for bytes in numbers {
        let honest = f64::from_le_bytes(*bytes);
        let number = match draws.bits() % if all { 4 } else { 24 } {
            0 => *pick(draws, &EDGES),
            1 => double(draws),
            2 => honest * draws.uniform_in(0.5, 2.0),
            _ => honest,
        };
        *bytes = number.to_le_bytes();
    }
}
