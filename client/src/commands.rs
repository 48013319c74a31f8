//! How samples become commands: packed, repeated, and fewer under congestion.
//!
//! Pure and of fixed size. A sample is never sent in another form than it was first.

use mmt_shared::channel::rate_control::StretchMax;
use mmt_shared::model::architecture::Architecture;
use mmt_shared::model::sample::HipSample;
use mmt_shared::range::{OutOfRange, all_in_range};
use mmt_shared::wire::{SAMPLES_MAX, SampleBlock};
use serde::{Deserialize, Serialize};

/// Most ticks from one packed sample to the next: play-out takes its velocity from samples of 5 ms.
const SPACING_MAX: u32 = 4;

/// How commands are made.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CommandConfig {
    /// New samples in a command, 1 to 32.
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

    /// Checks the numbers; that of [`StretchMax`] is checked by its type.
    ///
    /// # Errors
    /// Names the one that is out of range.
    pub fn check(&self) -> Result<(), OutOfRange> {
        let most = SAMPLES_MAX as f64;
        let (new, repeats) = (self.samples_per_command, self.repeat_samples);
        all_in_range([
            ("samples per command", "", f64::from(new), (1.0, most)),
            ("repeat samples", "", f64::from(repeats), (0.0, most - 1.0)),
        ])
    }

    /// The most samples that a command can have.
    pub fn samples_at_most(&self) -> usize {
        let new = usize::from(self.samples_per_command).max(1);
        (new * (1 + usize::from(self.repeat_samples))).min(SAMPLES_MAX)
    }
}

/// Packs samples into commands.
#[derive(Clone, Debug)]
pub(crate) struct CommandPacker {
    config: CommandConfig,
    block: SampleBlock,
    /// Samples of the commands before, newest last.
    repeated: SampleBlock,
    /// Samples that congestion leaves out until the next one is packed.
    to_skip: u32,
    off_grid: u64,
    skipped: u64,
}

impl CommandPacker {
    pub(crate) fn new(config: CommandConfig) -> Self {
        Self {
            config,
            block: SampleBlock::default(),
            repeated: SampleBlock::default(),
            to_skip: 0,
            off_grid: 0,
            skipped: 0,
        }
    }

    /// Samples that are in no command: stamps that did not increase, left out under congestion, still waiting for the
    /// command to be full.
    pub(crate) fn drops(&self) -> [(&'static str, u64); 3] {
        [
            ("samples_off_grid", self.off_grid),
            ("samples_skipped", self.skipped),
            ("samples_unsent", self.block.len() as u64),
        ]
    }

    /// Packs a sample. Under congestion (`stretch` above 1) only every second, third, … sample is packed.
    pub(crate) fn push(&mut self, sample: HipSample, stretch: f64) {
        if self.to_skip > 0 {
            self.to_skip -= 1;
            self.skipped += 1;
            return;
        }
        self.to_skip = (libm::ceil(stretch) as u32).min(SPACING_MAX) - 1;
        if self.block.push(sample).is_err() {
            self.push_off_grid(sample);
        }
    }

    /// A later stamp that is off the grid of those before begins a new command: else all that follow it would be off the grid.
    fn push_off_grid(&mut self, sample: HipSample) {
        let is_later = self.block.last().map(|last| last.stamp) < Some(sample.stamp);
        if !is_later {
            self.off_grid += 1;
            return;
        }
        self.off_grid += self.block.len() as u64;
        self.block.clear();
        // an empty block takes any
        self.off_grid += u64::from(self.block.push(sample).is_err());
    }

    /// The samples of a command once it is full: the new ones behind those that are repeated; no repeats under
    /// congestion.
    pub(crate) fn take_full(&mut self, stretch: f64) -> Option<SampleBlock> {
        let full = self.block.len() >= usize::from(self.config.samples_per_command).max(1);
        if !full && !self.block.is_full() {
            return None;
        }
        let samples = self.with_repeats(stretch);
        self.block.clear();
        Some(samples)
    }

    fn with_repeats(&mut self, stretch: f64) -> SampleBlock {
        if self.config.repeat_samples == 0 {
            return self.block;
        }
        let new = self.block.len();
        let all = if stretch > 1.0 {
            new
        } else {
            self.config.samples_at_most()
        };
        let whole = joined(&self.repeated, &self.block, all);
        let keep = new * usize::from(self.config.repeat_samples);
        self.repeated = joined(&self.repeated, &self.block, keep.min(SAMPLES_MAX));
        whole
    }
}

/// The newest `most` samples of `older` and then `newer`, all of which are newer. Where the stamps of the two do not
/// fit together, those of `newer` alone.
fn joined(older: &SampleBlock, newer: &SampleBlock, most: usize) -> SampleBlock {
    let skip = (older.len() + newer.len()).saturating_sub(most);
    let all = older.as_slice().iter().chain(newer.as_slice()).skip(skip);
    let mut block = SampleBlock::default();
    match all.copied().try_for_each(|sample| block.push(sample)) {
        Ok(()) => block,
        Err(_) => *newer,
    }
}

#[cfg(test)]
mod tests;
