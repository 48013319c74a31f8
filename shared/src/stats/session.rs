//! What each end of a session counts of messages and updates, each where it happens. A field's name is the name of what
//! it counts everywhere: in the code, in reports and on the screen.

use serde::{Deserialize, Serialize};

use crate::wire::Kind;

/// Messages in datagrams, by type.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct KindCounts {
    /// Commands.
    pub commands: u64,
    /// Updates, repeats included.
    pub updates: u64,
    /// Scenes.
    pub scenes: u64,
    /// Heartbeats.
    pub heartbeats: u64,
    /// What the tool feels.
    pub tools: u64,
}

impl KindCounts {
    /// One more of this type; what is never in a datagram is not counted.
    pub fn count(&mut self, kind: Kind) {
        *match kind {
            Kind::Command => &mut self.commands,
            Kind::Update => &mut self.updates,
            Kind::Scene => &mut self.scenes,
            Kind::Heartbeat => &mut self.heartbeats,
            Kind::Tool => &mut self.tools,
            Kind::Hello | Kind::Welcome | Kind::Refused | Kind::Farewell => return,
        } += 1;
    }

    /// All of them.
    pub fn total(&self) -> u64 {
        self.commands + self.updates + self.scenes + self.heartbeats + self.tools
    }
}

/// What one end of the datagram channel sent, received and dropped.
///
/// What arrived is [`received.total() + dropped()`](Self::dropped).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ChannelCounts {
    /// Messages sent.
    pub sent: KindCounts,
    /// Messages received, each once.
    pub received: KindCounts,
    /// Datagrams dropped because their number was received before.
    pub datagrams_duplicate: u64,
    /// Datagrams dropped because their number was too old to judge.
    pub datagrams_too_old: u64,
    /// Datagrams dropped because their number was too far ahead of the newest.
    pub datagrams_implausible: u64,
    /// Datagrams dropped because they did not decode.
    pub datagrams_malformed: u64,
    /// Messages that break a rule of the wire and were not sent.
    pub messages_unsendable: u64,
}

impl ChannelCounts {
    /// How many datagrams that arrived were dropped, whatever the cause.
    pub fn dropped(&self) -> u64 {
        self.datagrams_duplicate
            + self.datagrams_too_old
            + self.datagrams_implausible
            + self.datagrams_malformed
    }
}

/// Updates that the master received and did not apply, by cause.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct UpdateDrops {
    /// Its sequence number was received before: a repeat did its work, or the network duplicated.
    pub duplicate: u64,
    /// A newer one was received before.
    pub stale: u64,
    /// Its sequence number was too far ahead of the newest.
    pub implausible: u64,
    /// Its numbers were not accepted.
    pub rejected: u64,
    /// A newer one took its place before a tick could apply it.
    pub superseded: u64,
    /// It came while the link was stale.
    pub link_stale: u64,
    /// It answers a sample of too long ago.
    pub answer_too_old: u64,
    /// The hand had been released.
    pub hand_released: u64,
    /// The session ended before a tick could apply it.
    pub unapplied: u64,
}

impl UpdateDrops {
    /// Each cause by its name in reports.
    pub fn by_name(&self) -> [(&'static str, u64); 9] {
        [
            ("duplicate", self.duplicate),
            ("stale", self.stale),
            ("implausible", self.implausible),
            ("rejected", self.rejected),
            ("superseded", self.superseded),
            ("link_stale", self.link_stale),
            ("answer_too_old", self.answer_too_old),
            ("hand_released", self.hand_released),
            ("unapplied", self.unapplied),
        ]
    }
}
