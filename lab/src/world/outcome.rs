//! What a run of a world came to, and what it sent.

use mmt_netem::counters::Tally;
use mmt_shared::channel::datagram_channel::DatagramChannel;
use mmt_shared::metrics::{
    AgeOfInformation, ContactBreaks, ForcePeak, PoseError, Staleness, UpdateCounts,
};
use mmt_shared::report::{MessagesReport, UpDown, WireReport};

use crate::baselines::message::OVERHEAD_BYTES;

/// What a run came to.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Updates by cause, per second and per second of contact.
    pub updates: UpdateCounts,
    /// Age of the update that the master's model rests on.
    pub age: AgeOfInformation,
    /// How long updates took to become known at the master.
    pub staleness: Staleness,
    /// Error of the master's pose against the truth, at the same HIP sample.
    pub pose: PoseError,
    /// Breaks of contact at the master.
    pub breaks: ContactBreaks,
    /// Force on the hand.
    pub on_hand: ForcePeak,
    /// Energy that updates added to the master's model beyond what its tank paid, J.
    pub energy_injected_j: f64,
    /// The least that the passivity observer at the hand ever showed, J.
    pub observer_min_j: f64,
    /// Packets with a force of the tool.
    pub forces: u64,
}

/// The three packet rates of a world, as sent.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WorldTraffic {
    /// Messages by kind.
    pub messages: UpDown<MessagesReport>,
    /// Repeats of updates, by the cause of what they repeat.
    pub repeated: UpdateCounts,
    /// Datagrams, and bits per second with headers.
    pub wire: UpDown<WireReport>,
}

impl WorldTraffic {
    /// Of both ends' channels, master and slave, the slave's repeats and the datagrams of both directions. Every
    /// message is a datagram of its own here; its headers are those of IPv4, UDP and QUIC, whose own packets a world
    /// does not have.
    pub(super) fn of(
        (master, slave): (&DatagramChannel, &DatagramChannel),
        repeated: UpdateCounts,
        [up, down]: [Tally; 2],
        duration_s: f64,
    ) -> Self {
        let repeats = repeated.total();
        let wire =
            |of: Tally| WireReport::new(of.packets, of.bytes, OVERHEAD_BYTES as u64, duration_s);
        Self {
            messages: UpDown {
                up: MessagesReport::up(&master.counts().sent, duration_s),
                down: MessagesReport::down(&slave.counts().sent, repeats, duration_s),
            },
            repeated,
            wire: UpDown {
                up: wire(up),
                down: wire(down),
            },
        }
    }
}
