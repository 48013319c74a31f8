//! How packets are lost where loss is a dimension of the grid.

use mmt_netem::config::LinkConfig;
use mmt_netem::words::ParseError;

use crate::experiment::findings::ExperimentError;

/// How packets are lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Loss {
    None,
    FivePercent,
    TwentyPercent,
    Bursts30Ms,
    Bursts100Ms,
}

impl Loss {
    pub(super) const ALL: [Self; 5] = [
        Self::None,
        Self::FivePercent,
        Self::TwentyPercent,
        Self::Bursts30Ms,
        Self::Bursts100Ms,
    ];

    /// As files spell it: a share, or the bursts' mean length.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::None => "0",
            Self::FivePercent => "0.05",
            Self::TwentyPercent => "0.2",
            Self::Bursts30Ms => "burst30ms",
            Self::Bursts100Ms => "burst100ms",
        }
    }

    /// In the words of a link. Bursts take 5 % of the time.
    pub(super) fn words(self) -> &'static str {
        match self {
            Self::None => "",
            Self::FivePercent => "loss 5%",
            Self::TwentyPercent => "loss 20%",
            Self::Bursts30Ms => "loss burst 5% 30ms",
            Self::Bursts100Ms => "loss burst 5% 100ms",
        }
    }
}

/// The link of some words, with this loss.
///
/// # Errors
/// When the words are not accepted.
pub(super) fn link(words: &str, loss: Loss) -> Result<LinkConfig, ExperimentError> {
    let words = format!("{words} {}", loss.words());
    let link = words.trim().parse();
    link.map_err(|error: ParseError| ExperimentError::network(&words, error))
}
