//! One direction of the swarm's network: the emulated link, and what faults do to it.

use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

use mmt_netem::config::ConfigError;
use mmt_netem::link::LinkId;
use mmt_netem::{Link, LinkConfig, Packet};
use mmt_shared::rng::Substream;
use mmt_shared::time::{Time, duration_nanos};
use mmt_shared::wire::Side;

use super::faults::{Fault, Now};
use super::hostile::{forged, mutated};
use crate::check::Way as Checked;

/// Datagrams that an eavesdropper has.
const CAPTURED: usize = 64;
/// Half of a period of flapping.
const FLAP: Duration = Duration::from_millis(100);
/// The latest that [`Fault::Late`] makes a datagram, ms.
const LATE_MS: f64 = 400.0;

/// One direction.
pub(super) struct Way {
    from: Side,
    link: Link<Vec<u8>>,
    /// What faults hold back, by when it arrives.
    held: BTreeMap<(Time, u64), Vec<u8>>,
    count: u64,
    captured: VecDeque<Vec<u8>>,
    draws: Substream,
}

impl Way {
    /// `seed` is that of the session.
    pub(super) fn try_new(from: Side, config: &LinkConfig, seed: u64) -> Result<Self, ConfigError> {
        let (id, name) = match from {
            Side::Master => (LinkId::UP, "swarm/up"),
            Side::Slave => (LinkId::DOWN, "swarm/down"),
        };
        Ok(Self {
            from,
            link: Link::try_new(config.clone(), seed, id)?,
            held: BTreeMap::new(),
            count: 0,
            captured: VecDeque::new(),
            draws: Substream::new(seed, name, 0),
        })
    }

    pub(super) fn offer(&mut self, now: Time, bytes: &[u8]) {
        self.link
            .offer(now, Packet::new(bytes.len(), bytes.to_vec()));
        if self.captured.len() == CAPTURED {
            self.captured.pop_front();
        }
        self.captured.push_back(bytes.to_vec());
    }

    /// What arrives by `now`, with when. What an enemy made is shown to the judges.
    pub(super) fn arrivals(
        &mut self,
        now: Time,
        faults: &Now,
        checked: &mut Checked,
    ) -> Vec<(Time, Vec<u8>)> {
        while let Some(packet) = self.link.poll_delivered(now) {
            if packet.is_corrupted() || self.loses(now, faults) {
                continue;
            }
            let late_ms = faults.strength(Fault::Late).unwrap_or_default() * LATE_MS;
            let late_ms = self.draws.uniform() * late_ms;
            let at = packet.due + Duration::from_nanos((late_ms * 1e6) as u64);
            self.hold(at, packet.payload);
        }
        self.attack(now, faults, checked);
        let later = self.held.split_off(&(now + Duration::from_nanos(1), 0));
        let due = std::mem::replace(&mut self.held, later);
        due.into_iter()
            .map(|((at, _), bytes)| (at, bytes))
            .collect()
    }

    fn hold(&mut self, at: Time, bytes: Vec<u8>) {
        self.count += 1;
        self.held.insert((at, self.count), bytes);
    }

    fn loses(&mut self, now: Time, faults: &Now) -> bool {
        let silent = match self.from {
            Side::Master => Fault::UpSilent,
            Side::Slave => Fault::DownSilent,
        };
        let away = (now.as_nanos() / duration_nanos(FLAP)).is_multiple_of(2);
        faults.has(silent)
            || faults.has(Fault::BothSilent)
            || (faults.has(Fault::Flapping) && away)
            || (faults.has(Fault::Burst) && self.draws.chance(0.5))
    }

    /// Now and then a copy, a mutation or a forgery arrives.
    fn attack(&mut self, now: Time, faults: &Now, checked: &mut Checked) {
        for fault in [Fault::Replayed, Fault::Mutated, Fault::Forged] {
            let Some(strength) = faults.strength(fault) else {
                continue;
            };
            if !self.draws.chance(0.2 * strength) || self.captured.is_empty() {
                continue;
            }
            let place = self.draws.bits() as usize % self.captured.len();
            let copy = self.captured.get(place).cloned().unwrap_or_default();
            let made = match fault {
                Fault::Mutated => Some(mutated(&copy, &mut self.draws)),
                Fault::Forged => forged(&copy, self.from, &mut self.draws),
                _ => Some(copy),
            };
            let Some(bytes) = made else {
                continue;
            };
            if fault != Fault::Replayed {
                checked.forged(&bytes);
            }
            self.hold(now, bytes);
        }
    }
}
