//! Inputs that are records: the messages of a short session, with the digests that it gives, and its file.

mod kept;
mod session;

use session::recorded;

/// Names of topics, in the order in which the first byte of a message means them.
pub(in crate::fuzz) const TOPICS: [&str; 11] = [
    "/master/ticks",
    "/slave/ticks",
    "/master/session",
    "/slave/session",
    "/master/arrivals",
    "/slave/arrivals",
    "/master/packets",
    "/slave/parameters",
    "/master/link",
    "/slave/loop",
    "/master/readings",
];

fn number_of(topic: &str) -> Option<u8> {
    TOPICS
        .iter()
        .position(|known| *known == topic)
        .map(|number| number as u8)
}

/// One message each, behind the number of its topic.
pub(in crate::fuzz) fn messages() -> Vec<Vec<u8>> {
    let mut seeds = Vec::new();
    let mut seen = [false; TOPICS.len()];
    for (topic, message) in recorded().0 {
        let Some(number) = number_of(topic) else {
            continue;
        };
        let short =
            message.len() < 1400 && !std::mem::replace(&mut seen[usize::from(number)], true);
        if short {
            seeds.push([&[number], message.as_slice()].concat());
        }
    }
    seeds
}

/// Whole files.
pub(in crate::fuzz) fn records() -> Vec<Vec<u8>> {
    let (_, file) = recorded();
    let cut = file[..file.len() * 2 / 3].to_vec();
    vec![file, cut]
}

/// All messages of a session, each behind the number of its topic and its length.
pub(in crate::fuzz) fn recorded_sessions() -> Vec<Vec<u8>> {
    let mut whole = Vec::new();
    for (topic, message) in recorded().0 {
        if let Some(number) = number_of(topic) {
            whole.push(number);
            whole.extend((message.len() as u16).to_le_bytes());
            whole.extend(message);
        }
    }
    vec![whole]
}

/// The messages of such an input.
pub(in crate::fuzz) fn messages_of(
    mut input: &[u8],
) -> impl Iterator<Item = (&'static str, &[u8])> {
    std::iter::from_fn(move || {
        let (head, rest) = input.split_first_chunk::<3>()?;
        let length = usize::from(u16::from_le_bytes([head[1], head[2]]));
        let (message, behind) = rest.split_at(length.min(rest.len()));
        input = behind;
        Some((TOPICS[usize::from(head[0]) % TOPICS.len()], message))
    })
}
