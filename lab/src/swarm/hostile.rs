//! What a broken or malicious peer sends: bytes that were changed, and datagrams that keep the wire's rules and no other.

use std::time::Duration;

use mmt_shared::model::sample::{ForceCounts, HipCounts};
use mmt_shared::model::update::Update;
use mmt_shared::rng::Substream;
use mmt_shared::wire::{DATAGRAM_MAX, Datagram, Echo, Message, RawState, SampleBlock, Side};
use serde_json::json;

/// A copy with up to three bytes changed, or cut off.
pub(super) fn mutated(bytes: &[u8], draws: &mut Substream) -> Vec<u8> {
    let mut made = bytes.to_vec();
    if draws.chance(0.2) {
        made.truncate(draws.bits() as usize % bytes.len().max(1));
        return made;
    }
    for _ in 0..=draws.bits() % 3 {
        let place = draws.bits() as usize % made.len().max(1);
        if let Some(byte) = made.get_mut(place) {
            *byte = draws.bits() as u8;
        }
    }
    made
}

/// A datagram like this one whose numbers are those of an enemy; none where the wire refuses them.
pub(super) fn forged(bytes: &[u8], from: Side, draws: &mut Substream) -> Option<Vec<u8>> {
    let mut datagram = Datagram::decode(bytes, from).ok()?;
    let envelope = &mut datagram.envelope;
    // mostly one that the other side takes for the next
    envelope.number = match draws.bits() % 8 {
        0 => u32::MAX,
        1 => envelope.number.wrapping_add(draws.bits() as u32 % 5000),
        _ => envelope
            .number
            .saturating_add(1 + draws.bits() as u32 % 100),
    };
    envelope.echo = envelope.echo.map(|echo| false_echo(echo, draws));
    datagram.message = match datagram.message {
        Message::Command(mut command) => {
            command.newest_update = sequence(command.newest_update, draws);
            command.samples = samples(&command.samples, draws);
            Message::Command(command)
        }
        Message::Update(update) => Message::Update(Update {
            sequence: sequence(update.sequence, draws),
            answers: update.answers + Duration::from_millis(draws.bits() % 5000),
            state: state(&update.state, draws)?,
            ..update
        }),
        other => other,
    };
    let mut out = [0; DATAGRAM_MAX];
    let length = datagram.encode(&mut out).ok()?;
    out.get(..length).map(<[u8]>::to_vec)
}

fn false_echo(echo: Echo, draws: &mut Substream) -> Echo {
    match draws.bits() % 4 {
        0 => Echo {
            number: u32::MAX,
            ..echo
        },
        1 => Echo {
            held_ns: draws.bits() >> (draws.bits() % 64),
            ..echo
        },
        2 => Echo {
            sent: echo.sent + Duration::from_secs(draws.bits() % 100),
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
    let ahead = match draws.bits() % 4 {
        0 => Duration::from_secs(draws.bits() % 4000),
        1 => Duration::from_millis(draws.bits() % 2000),
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

/// Numbers that are extreme, one or all of them.
fn state(honest: &RawState, draws: &mut Substream) -> Option<RawState> {
    const EXTREME: [f64; 12] = [
        0.0,
        5e-324,
        1e-300,
        3e-6,
        0.05,
        50.0,
        200.0,
        1e9,
        f64::MAX,
        -f64::MAX,
        -1e-9,
        6283.0,
    ];
    let mut number = |honest: f64| {
        if draws.chance(0.2) {
            let place = draws.bits() as usize % EXTREME.len();
            EXTREME.get(place).copied().unwrap_or(honest)
        } else {
            honest * draws.uniform_in(0.5, 2.0)
        }
    };
    let mut value = serde_json::to_value(honest).ok()?;
    for (_, numbers) in value.as_object_mut()?.iter_mut() {
        for of in numbers.as_array_mut()? {
            let honest = of.as_f64()?;
            *of = json!(number(honest));
        }
    }
    serde_json::from_value(value).ok()
}
