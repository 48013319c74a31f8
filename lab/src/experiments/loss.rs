//! How packets are lost where loss is a dimension of the grid.

use mmt_netem::config::LinkConfig;
use mmt_netem::words::ParseError;

use crate::experiment::findings::ExperimentError;

/// How packets are lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Loss {
    /// As files spell it: a share, or the bursts' mean length.
    pub(super) name: &'static str,
    /// In the words of a link. Bursts take 5 % of the time.
    pub(super) words: &'static str,
}

impl Loss {
    pub(super) const NONE: Self = Self::new("0", "");
    pub(super) const FIVE_PERCENT: Self = Self::new("0.05", "loss 5%");
    pub(super) const TWENTY_PERCENT: Self = Self::new("0.2", "loss 20%");
    pub(super) const BURSTS_30_MS: Self = Self::new("burst30ms", "loss burst 5% 30ms");
    pub(super) const BURSTS_100_MS: Self = Self::new("burst100ms", "loss burst 5% 100ms");

    pub(super) const ALL: [Self; 5] = [
        Self::NONE,
        Self::FIVE_PERCENT,
        Self::TWENTY_PERCENT,
        Self::BURSTS_30_MS,
        Self::BURSTS_100_MS,
    ];

    const fn new(name: &'static str, words: &'static str) -> Self {
        Self { name, words }
    }
}

/// The link of some words, with this loss.
///
/// # Errors
/// When the words are not accepted.
pub(super) fn link(words: &str, loss: Loss) -> Result<LinkConfig, ExperimentError> {
    let words = format!("{words} {}", loss.words);
    let link = words.trim().parse();
    link.map_err(|error: ParseError| ExperimentError::network(&words, error))
}
