//! The places of the delay experiment: which architecture, over which network, how stiff.
//!
//! Only what is run; never what came of it.

use std::time::Duration;

use mmt_client::operator::scripted::Picture;
use mmt_server::link::Repeats;
use mmt_shared::channel::rate_control::StretchMax;
use mmt_shared::model::settings::PoseCorrection;

use super::Duel;
use crate::architecture::Architecture;
use crate::reproduce::ReproduceError;
use crate::world::WorldConfig;

/// One-way delays, ms.
const DELAYS_MS: [u64; 13] = [0, 1, 2, 5, 10, 14, 20, 50, 100, 250, 500, 1000, 2000];
/// Jitter, ms.
const JITTERS_MS: [u64; 3] = [0, 10, 30];
/// Virtual stiffness k_p, N/m.
pub(super) const STIFFNESSES: [u64; 3] = [500, 1000, 3000];
/// Delays at which jitter and loss are tried in the default grid, ms.
const IMPAIRED_MS: [u64; 3] = [50, 250, 500];
/// Delays at which other stiffnesses are tried in the default grid, ms.
const STIFF_MS: [u64; 8] = [0, 2, 5, 10, 14, 20, 50, 250];
/// Delays at which the operator's picture is compared, ms.
const PICTURE_MS: [u64; 4] = [250, 500, 1000, 2000];

/// How packets are lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::reproduce) enum Loss {
    None,
    FivePercent,
    TwentyPercent,
    Bursts30Ms,
    Bursts100Ms,
}

impl Loss {
    pub(in crate::reproduce) const ALL: [Self; 5] = [
        Self::None,
        Self::FivePercent,
        Self::TwentyPercent,
        Self::Bursts30Ms,
        Self::Bursts100Ms,
    ];

    /// As `delay.csv` spells it: a share, or the bursts' mean length.
    pub(in crate::reproduce) fn name(self) -> &'static str {
        match self {
            Self::None => "0",
            Self::FivePercent => "0.05",
            Self::TwentyPercent => "0.2",
            Self::Bursts30Ms => "burst30ms",
            Self::Bursts100Ms => "burst100ms",
        }
    }

    /// In the words of a link. Bursts take 5 % of the time.
    pub(in crate::reproduce) fn words(self) -> &'static str {
        match self {
            Self::None => "",
            Self::FivePercent => "loss 5%",
            Self::TwentyPercent => "loss 20%",
            Self::Bursts30Ms => "loss burst 5% 30ms",
            Self::Bursts100Ms => "loss burst 5% 100ms",
        }
    }
}

/// What is known of the object's size when it is first touched: the slave starts from a side of 40 cm, and it is 36.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Size {
    /// Nothing, and the operator pushes all the same.
    Unknown,
    /// Nothing, and the operator nudges each new face and rests until the answer must have come.
    Nudged,
    /// Vision has told it.
    Known,
}

impl Size {
    /// As `delay-view.csv` spells it.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Unknown => "unknown",
            Self::Nudged => "nudged",
            Self::Known => "known",
        }
    }
}

/// Where in the grid a run stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Place {
    pub(super) architecture: Architecture,
    pub(super) one_way_ms: u64,
    pub(super) jitter_ms: u64,
    pub(super) loss: Loss,
    pub(super) k_p: u64,
    pub(super) picture: Picture,
    pub(super) size: Size,
}

impl Place {
    pub(super) const fn plain(architecture: Architecture, one_way_ms: u64) -> Self {
        Self {
            architecture,
            one_way_ms,
            jitter_ms: 0,
            loss: Loss::None,
            k_p: 1000,
            picture: Picture::Model,
            size: Size::Unknown,
        }
    }

    pub(super) fn duel(&self, seed: u64, duration: Duration) -> Result<Duel, ReproduceError> {
        let mut words = format!("delay {}ms", self.one_way_ms);
        if self.jitter_ms > 0 {
            words += &format!(" {}ms", self.jitter_ms);
        }
        let words = format!("{words} {}", self.loss.words());
        let link = words
            .trim()
            .parse()
            .map_err(|error| ReproduceError::Network {
                name: words.clone(),
                why: format!("{error}"),
            });
        let link: mmt_netem::config::LinkConfig = link?;
        let mut config = WorldConfig {
            up: link.clone(),
            down: link,
            stiffness_n_per_m: Some(self.k_p as f64),
            ..WorldConfig::default()
        };
        config.operator.view = self.picture;
        match self.size {
            Size::Unknown => {}
            // a round trip, and a second to see what it did
            Size::Nudged => config.operator.dwell_s = 2e-3 * self.one_way_ms as f64 + 1.0,
            Size::Known => config.slave.start.side_m = config.slave.environment.side_m,
        }
        // what the other architectures do not have either
        config.slave.repeats_ms = Repeats::NONE;
        config.slave.stretch_max = StretchMax::OFF;
        config.stretch_max = StretchMax::OFF;
        Ok(Duel {
            architecture: self.architecture,
            config: config.seeded(seed),
            duration,
        })
    }
}

/// The default grid.
pub(super) fn some_places() -> Vec<Place> {
    let mut places = Vec::new();
    for architecture in Architecture::ALL {
        places.extend(DELAYS_MS.map(|ms| Place::plain(architecture, ms)));
        for k_p in STIFFNESSES.into_iter().filter(|k_p| *k_p != 1000) {
            places.extend(STIFF_MS.map(|ms| Place {
                k_p,
                ..Place::plain(architecture, ms)
            }));
        }
        let impairments = [
            (10, Loss::None),
            (30, Loss::None),
            (0, Loss::TwentyPercent),
            (10, Loss::TwentyPercent),
            (0, Loss::Bursts30Ms),
            (0, Loss::Bursts100Ms),
        ];
        for (jitter_ms, loss) in impairments {
            places.extend(IMPAIRED_MS.map(|ms| Place {
                jitter_ms,
                loss,
                ..Place::plain(architecture, ms)
            }));
        }
    }
    places
}

/// The whole grid of the issue: every delay, jitter, loss and stiffness.
pub(super) fn all_places() -> Vec<Place> {
    let mut places = Vec::new();
    for architecture in Architecture::ALL {
        for k_p in STIFFNESSES {
            for jitter_ms in JITTERS_MS {
                for loss in Loss::ALL {
                    places.extend(DELAYS_MS.map(|ms| Place {
                        jitter_ms,
                        loss,
                        k_p,
                        ..Place::plain(architecture, ms)
                    }));
                }
            }
        }
    }
    places
}

/// Replay, with the operator looking at the local model or at the delayed picture; and what the object's size does.
pub(super) fn picture_places() -> Vec<Place> {
    let replay = Architecture::Mediated(PoseCorrection::Replay);
    let of = |(picture, size)| {
        PICTURE_MS.map(|ms| Place {
            picture,
            size,
            ..Place::plain(replay, ms)
        })
    };
    [
        (Picture::Model, Size::Unknown),
        (Picture::Model, Size::Nudged),
        (Picture::Model, Size::Known),
        (Picture::Delayed, Size::Unknown),
    ]
    .map(of)
    .concat()
}
