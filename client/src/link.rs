//! The master's end of the link: updates in, commands out.
//!
//! Pure. An update passes the sequence window and `accept` here or never reaches the model.

use mmt_shared::contact::Coupling;
use mmt_shared::link_end::{LinkEnd, Outgoing, SealError};
use mmt_shared::peer::{Freshness, SequenceWindow};
use mmt_shared::time::Time;
use mmt_shared::wire::{Command, HipSample, Matter, SampleBlock, Scene, Side, Update, UpdateDrops};

/// What came from the slave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FromSlave {
    /// An accepted update, newer than all before.
    Update(Update),
    /// What the slave sees.
    Scene(Scene),
}

/// The master's end of the link.
#[derive(Clone, Debug)]
pub struct MasterLink {
    end: LinkEnd,
    coupling: Coupling,
    window: SequenceWindow,
    rejected: u32,
    block: SampleBlock,
    samples_per_command: usize,
    samples_refused: u32,
}

impl MasterLink {
    /// A link that packs `samples_per_command` samples (at least one) in a command.
    #[must_use]
    pub fn new(now: Time, coupling: Coupling, samples_per_command: u8) -> Self {
        Self {
            end: LinkEnd::new(Side::Master, now),
            coupling,
            window: SequenceWindow::new(),
            rejected: 0,
            block: SampleBlock::new(),
            samples_per_command: usize::from(samples_per_command).max(1),
            samples_refused: 0,
        }
    }

    /// The end itself: round trip, loss, counts.
    #[must_use]
    pub fn end(&self) -> &LinkEnd {
        &self.end
    }

    /// Updates that arrived and were stopped here, by cause.
    #[must_use]
    pub fn drops(&self) -> UpdateDrops {
        UpdateDrops {
            duplicate: self.window.duplicate(),
            stale: self.window.stale(),
            rejected: self.rejected,
            ..UpdateDrops::default()
        }
    }

    /// Samples that could not be packed because their stamps did not increase.
    #[must_use]
    pub fn samples_refused(&self) -> u32 {
        self.samples_refused
    }

    /// Samples that wait for the command to be full.
    #[must_use]
    pub fn pending(&self) -> usize {
        self.block.len()
    }

    /// Takes in a datagram that arrived at `now`.
    pub fn handle(&mut self, now: Time, bytes: &[u8]) -> Option<FromSlave> {
        match self.end.open(now, bytes)? {
            Matter::Update(raw) => {
                if self.window.offer(raw.sequence()) != Freshness::Fresh {
                    return None;
                }
                match raw.accept(&self.coupling) {
                    Ok(update) => Some(FromSlave::Update(update)),
                    Err(_) => {
                        self.rejected = self.rejected.saturating_add(1);
                        None
                    }
                }
            }
            Matter::Scene(scene) => Some(FromSlave::Scene(scene)),
            Matter::Command(_) | Matter::Heartbeat => None,
        }
    }

    /// Packs a sample; once the command is full it is written to `out` and its length returned.
    ///
    /// # Errors
    /// When the command cannot be sealed; its samples are lost then.
    pub fn send(
        &mut self,
        now: Time,
        sample: HipSample,
        out: &mut [u8],
    ) -> Result<Option<usize>, SealError> {
        if self.block.push(sample).is_err() {
            self.samples_refused = self.samples_refused.saturating_add(1);
        }
        if self.block.len() < self.samples_per_command && !self.block.is_full() {
            return Ok(None);
        }
        let command = Command {
            newest_update: self.window.newest(),
            samples: self.block,
        };
        self.block.clear();
        self.end
            .seal(now, Outgoing::Command(&command), out)
            .map(Some)
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
