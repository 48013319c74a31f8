//! The slave's end of the link: commands in, updates out. Pure.

use mmt_shared::link_end::{LinkEnd, Outgoing, SealError};
use mmt_shared::time::Time;
use mmt_shared::wire::{Command, Matter, Side, Update};

/// The slave's end of the link.
#[derive(Clone, Debug)]
pub struct SlaveLink {
    end: LinkEnd,
    newest_acknowledged: u32,
    samples: u64,
}

impl SlaveLink {
    /// A link from `now` on.
    #[must_use]
    pub fn new(now: Time) -> Self {
        Self {
            end: LinkEnd::new(Side::Slave, now),
            newest_acknowledged: 0,
            samples: 0,
        }
    }

    /// The end itself: round trip, loss, counts.
    #[must_use]
    pub fn end(&self) -> &LinkEnd {
        &self.end
    }

    /// The newest update that the master has said it has.
    #[must_use]
    pub fn newest_acknowledged(&self) -> u32 {
        self.newest_acknowledged
    }

    /// HIP samples received.
    #[must_use]
    pub fn samples_received(&self) -> u64 {
        self.samples
    }

    /// Takes in a datagram that arrived at `now`; its samples are for the play-out buffer.
    pub fn handle(&mut self, now: Time, bytes: &[u8]) -> Option<Command> {
        let Matter::Command(command) = self.end.open(now, bytes)? else {
            return None;
        };
        self.newest_acknowledged = self.newest_acknowledged.max(command.newest_update);
        self.samples += command.samples.len() as u64;
        Some(command)
    }

    /// Writes an update to `out`; it is completed with the newest command seen. Returns its length.
    ///
    /// # Errors
    /// When it cannot be sealed.
    pub fn send_update(
        &mut self,
        now: Time,
        update: &Update,
        out: &mut [u8],
    ) -> Result<usize, SealError> {
        let update = Update {
            newest_command: self.end.peer().newest(),
            ..*update
        };
        self.end.seal(now, Outgoing::Update(&update), out)
    }

    /// A heartbeat, if nothing has been sent for long enough.
    ///
    /// # Errors
    /// When no datagram number is left.
    pub fn heartbeat(&mut self, now: Time, out: &mut [u8]) -> Result<Option<usize>, SealError> {
        if now < self.end.heartbeat_due() {
            return Ok(None);
        }
        self.end.seal(now, Outgoing::Heartbeat, out).map(Some)
    }
}
