//! The master's end of the link: updates in, commands out.
//!
//! Pure. An update passes the sequence window and `accept` here or never reaches the model. A sample is never sent
//! in another form than it was first.

use mmt_shared::channel::datagram_channel::{LinkEnd, SealError};
use mmt_shared::channel::peer::{Freshness, SequenceWindow};
use mmt_shared::channel::rate_control::StretchMax;
use mmt_shared::model::contact::Coupling;
use mmt_shared::model::sample::HipSample;
use mmt_shared::model::tool::{HandPort, Scene, Tool};
use mmt_shared::model::update::Update;
use mmt_shared::stats::session::UpdateDrops;
use mmt_shared::time::Time;
use mmt_shared::wire::{Architecture, Command, Message, SAMPLES_MAX, SampleBlock, Side};
use serde::{Deserialize, Serialize};

/// Most ticks from one packed sample to the next: play-out takes its velocity from samples of 5 ms.
const SPACING_MAX: u32 = 4;

/// How commands are made.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CommandConfig {
    /// New samples in a command, 1 to 32; at least one whatever it says.
    pub samples_per_command: u8,
    /// How many commands before it each command repeats the samples of, as far as 32 samples hold them.
    pub repeat_samples: u8,
    /// By how much congestion may stretch the time between two samples, and so between two commands; 1: not at all.
    pub stretch_max: StretchMax,
}

impl Default for CommandConfig {
    /// Ten samples, none repeated: repeats of samples buy no force error (docs/traffic.md). Congestion may leave
    /// two of three samples out.
    fn default() -> Self {
        Self {
            samples_per_command: 10,
            repeat_samples: 0,
            stretch_max: StretchMax::RECOMMENDED,
        }
    }
}

impl CommandConfig {
    /// The same for a hand that feels this architecture: the tool's force cannot wait for a packet to be full, so that
    /// each sample goes alone, and the next packet comes a tick later, so that none is repeated.
    #[must_use]
    pub fn for_architecture(self, architecture: Architecture) -> Self {
        if architecture.feels_tool() {
            Self {
                samples_per_command: 1,
                repeat_samples: 0,
                ..self
            }
        } else {
            self
        }
    }

    /// The most samples that a command can have.
    #[must_use]
    pub fn samples_at_most(&self) -> usize {
        let news = usize::from(self.samples_per_command).max(1);
        (news * (1 + usize::from(self.repeat_samples))).min(SAMPLES_MAX)
    }
}

/// What came from the slave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FromSlave {
    /// An accepted update, newer than all before.
    Update(Update),
    /// What the slave sees, newer than all before.
    Scene(Scene),
    /// What the tool feels, newer than all before.
    Tool(Tool),
}

/// The master's end of the link.
#[derive(Clone, Debug)]
pub struct MasterLink {
    end: LinkEnd,
    coupling: Coupling,
    window: SequenceWindow,
    rejected: u32,
    config: CommandConfig,
    block: SampleBlock,
    /// Samples of the commands before, newest last.
    told: SampleBlock,
    /// Samples that congestion leaves out until the next one is packed.
    to_skip: u32,
    samples_refused: u32,
    samples_skipped: u32,
}

impl MasterLink {
    /// A link from `now` on to a slave that knows the device's `coupling`.
    #[must_use]
    pub fn new(now: Time, coupling: Coupling, config: CommandConfig) -> Self {
        Self {
            end: LinkEnd::with_rate_control(Side::Master, now, config.stretch_max),
            coupling,
            window: SequenceWindow::new(),
            rejected: 0,
            config,
            block: SampleBlock::new(),
            told: SampleBlock::new(),
            to_skip: 0,
            samples_refused: 0,
            samples_skipped: 0,
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

    /// Samples that congestion left out on purpose.
    #[must_use]
    pub fn samples_skipped(&self) -> u32 {
        self.samples_skipped
    }

    /// Samples that wait for the command to be full.
    #[must_use]
    pub fn pending(&self) -> usize {
        self.block.len()
    }

    /// Takes in a datagram that arrived at `now`.
    pub fn handle(&mut self, now: Time, bytes: &[u8]) -> Option<FromSlave> {
        let opened = self.end.open(now, bytes)?;
        match opened.message {
            Message::Update(raw) => {
                if self.window.offer(raw.sequence) != Freshness::Fresh {
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
            Message::Scene(scene) => opened.is_newest.then_some(FromSlave::Scene(scene)),
            Message::Tool(tool) => opened.is_newest.then_some(FromSlave::Tool(tool)),
            Message::Command(_) | Message::Heartbeat => None,
        }
    }

    /// Packs a sample; once the command is full it is written to `out` with the hand's `port`, and its length returned.
    /// Under congestion only every second, third, … sample is packed.
    ///
    /// # Errors
    /// When the command cannot be sealed; its samples are lost then.
    pub fn send(
        &mut self,
        now: Time,
        sample: HipSample,
        port: Option<HandPort>,
        out: &mut [u8],
    ) -> Result<Option<usize>, SealError> {
        if self.to_skip > 0 {
            self.to_skip -= 1;
            self.samples_skipped = self.samples_skipped.saturating_add(1);
            return Ok(None);
        }
        self.to_skip = self.spacing() - 1;
        if self.block.push(sample).is_err() {
            self.samples_refused = self.samples_refused.saturating_add(1);
        }
        let full = self.block.len() >= usize::from(self.config.samples_per_command);
        if !full && !self.block.is_full() {
            return Ok(None);
        }
        let command = Command {
            newest_update: self.window.newest(),
            samples: self.with_repeats(),
            port,
        };
        self.block.clear();
        self.end.seal(now, Message::Command(command), out).map(Some)
    }

    /// Ticks from one packed sample to the next.
    fn spacing(&self) -> u32 {
        (libm::ceil(self.end.stretch()) as u32).min(SPACING_MAX)
    }

    /// The new samples behind those that are repeated, which are kept for the next command; no repeats while the
    /// path is congested.
    fn with_repeats(&mut self) -> SampleBlock {
        if self.config.repeat_samples == 0 {
            return self.block;
        }
        let news = self.block.len();
        let all = match self.end.stretch() > 1.0 {
            true => news,
            false => self.config.samples_at_most(),
        };
        let whole = joined(&self.told, &self.block, all);
        let keep = news * usize::from(self.config.repeat_samples);
        self.told = joined(&self.told, &self.block, keep.min(SAMPLES_MAX));
        whole
    }

    /// A heartbeat, if nothing has been sent for long enough.
    ///
    /// # Errors
    /// When no datagram number is left.
    pub fn heartbeat(&mut self, now: Time, out: &mut [u8]) -> Result<Option<usize>, SealError> {
        if now < self.end.heartbeat_due() {
            return Ok(None);
        }
        self.end.seal(now, Message::Heartbeat, out).map(Some)
    }
}

/// The newest `most` samples of `older` and then `newer`, all of which are newer. Where the stamps of the two do not
/// fit together, those of `newer` alone.
fn joined(older: &SampleBlock, newer: &SampleBlock, most: usize) -> SampleBlock {
    let skip = (older.len() + newer.len()).saturating_sub(most);
    let all = older.as_slice().iter().chain(newer.as_slice()).skip(skip);
    let mut block = SampleBlock::new();
    match all.copied().try_for_each(|sample| block.push(sample)) {
        Ok(()) => block,
        Err(_) => *newer,
    }
}

#[cfg(test)]
mod tests;
