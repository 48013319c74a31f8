//! What lies between the two ends: datagrams on their way, and what an eavesdropper has of them.

use std::collections::VecDeque;
use std::time::Duration;

use mmt_shared::time::Time;
use mmt_shared::wire::Side;

/// Datagrams of each side that an eavesdropper has.
const CAPTURED: usize = 64;
/// What the network holds back at most.
const HELD: usize = 256;

/// What becomes of datagrams.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in crate::fuzz::session) enum Network {
    /// They arrive at once.
    #[default]
    Direct,
    /// Those of one side are lost, or those of both.
    Silent(bool, bool),
    /// They are held back.
    Holds,
    /// They take so long.
    Slow(Duration),
}

impl Network {
    pub(in crate::fuzz::session) fn of(kind: u8, number: u8) -> Self {
        match kind % 6 {
            0 => Self::Direct,
            1 => Self::Silent(true, false),
            2 => Self::Silent(false, true),
            3 => Self::Silent(true, true),
            4 => Self::Holds,
            _ => Self::Slow(Duration::from_millis(u64::from(number) * 2)),
        }
    }
}

/// The network with what it holds.
#[derive(Default)]
pub(in crate::fuzz::session) struct Path {
    pub(in crate::fuzz::session) network: Network,
    /// On their way: to whom, when by the master's clock, what.
    held: VecDeque<(Side, Time, Vec<u8>)>,
    /// What left in this session, and in the one before.
    left: [VecDeque<Vec<u8>>; 2],
    earlier: [VecDeque<Vec<u8>>; 2],
}

impl Path {
    /// The network takes a datagram.
    pub(super) fn offer(&mut self, now: Time, from: Side, bytes: Vec<u8>) {
        let captured = &mut self.left[usize::from(from == Side::Slave)];
        if captured.len() == CAPTURED {
            captured.pop_front();
        }
        captured.push_back(bytes.clone());
        let due = match self.network {
            Network::Direct => now,
            Network::Silent(up, down) => {
                let lost = if from == Side::Master { up } else { down };
                if lost {
                    return;
                }
                now
            }
            Network::Holds => Time::MAX,
            Network::Slow(by) => now + by,
        };
        if self.held.len() == HELD {
            self.held.pop_front();
        }
        self.held.push_back((from.other(), due, bytes));
    }

    /// Takes off what is due, in order, and to whom.
    pub(super) fn take_due(&mut self, now: Time) -> Vec<(Side, Vec<u8>)> {
        let (due, held) = self.held.drain(..).partition(|(_, due, _)| *due <= now);
        self.held = held;
        let due: VecDeque<_> = due;
        due.into_iter().map(|(to, _, bytes)| (to, bytes)).collect()
    }

    /// What belongs to a session that is over.
    pub(super) fn begin_again(&mut self) {
        self.held.clear();
        self.earlier = std::mem::take(&mut self.left);
    }

    /// A datagram that left this side, the how-manieth from the newest.
    pub(in crate::fuzz::session) fn captured(&self, from: Side, which: u8) -> Option<Vec<u8>> {
        chosen(&self.left[usize::from(from == Side::Slave)], which)
    }

    /// The same of a session that is over.
    pub(in crate::fuzz::session) fn of_earlier(&self, from: Side, which: u8) -> Option<Vec<u8>> {
        chosen(&self.earlier[usize::from(from == Side::Slave)], which)
    }
}

fn chosen(of: &VecDeque<Vec<u8>>, which: u8) -> Option<Vec<u8>> {
    let back = usize::from(which) % of.len().max(1);
    of.len()
        .checked_sub(1 + back)
        .and_then(|at| of.get(at))
        .cloned()
}
