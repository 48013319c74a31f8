//! What each side counts of a session's messages and updates.

use serde::{Deserialize, Serialize};

use crate::wire::Kind;

/// Messages in datagrams, by type.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct KindCounts {
    /// Commands.
    pub commands: u32,
    /// Updates, repeats included.
    pub updates: u32,
    /// Scenes.
    pub scenes: u32,
    /// Heartbeats.
    pub heartbeats: u32,
    /// What the tool feels.
    pub tools: u32,
}

impl KindCounts {
    /// One more of this type; what is never in a datagram is not counted.
    pub fn count(&mut self, kind: Kind) {
        let count = match kind {
            Kind::Command => &mut self.commands,
            Kind::Update => &mut self.updates,
            Kind::Scene => &mut self.scenes,
            Kind::Heartbeat => &mut self.heartbeats,
            Kind::Tool => &mut self.tools,
            Kind::Hello | Kind::Welcome | Kind::Refused | Kind::Farewell => return,
        };
        *count = count.saturating_add(1);
    }

    /// All of them.
    #[must_use]
    pub fn total(&self) -> u64 {
        u64::from(self.commands)
            + u64::from(self.updates)
            + u64::from(self.scenes)
            + u64::from(self.heartbeats)
            + u64::from(self.tools)
    }
}

/// What a side sent and received. `received` counts each datagram once.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct Traffic {
    /// Messages sent in datagrams.
    pub sent: KindCounts,
    /// Messages received in datagrams, duplicates and too old ones left out.
    pub received: KindCounts,
    /// Datagrams dropped because their number had been received before.
    pub duplicates: u32,
    /// Datagrams dropped because their number was too old to tell.
    pub too_old: u32,
    /// Datagrams dropped because they did not decode.
    pub malformed: u32,
    /// The socket's UDP datagrams sent: QUIC's own packets included.
    pub udp_datagrams_sent: u64,
    /// Their payload, bytes, without UDP and IP headers.
    pub udp_bytes_sent: u64,
    /// The socket's UDP datagrams received.
    pub udp_datagrams_received: u64,
    /// Their payload, bytes, without UDP and IP headers.
    pub udp_bytes_received: u64,
}

/// Updates that the master received and did not apply, by cause.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct UpdateDrops {
    /// Its sequence number had been seen: a repeat did its work, or the network duplicated.
    pub duplicate: u32,
    /// A newer one had been seen.
    pub stale: u32,
    /// Its numbers were not accepted.
    pub rejected: u32,
    /// A newer one took its place before a tick could apply it.
    pub superseded: u32,
    /// The session's state did not allow it.
    pub frozen: u32,
}

impl UpdateDrops {
    /// Each cause by its name in reports.
    #[must_use]
    pub fn by_name(&self) -> [(&'static str, u64); 5] {
        [
            ("duplicate", self.duplicate),
            ("stale", self.stale),
            ("rejected", self.rejected),
            ("superseded", self.superseded),
            ("frozen", self.frozen),
        ]
        .map(|(name, count)| (name, u64::from(count)))
    }
}
