//! The points of the delay experiment: which architecture, over which network, how stiff.
//!
//! Only what is run; never what came of it.

use mmt_client::operator::scripted::VisualFeedback;
use mmt_server::repeats::Repeats;
use mmt_shared::channel::rate_control::StretchMax;

use crate::architecture::{ComparedArchitecture, DelayRow};
use crate::experiment::findings::ExperimentError;
use crate::experiment::grid;
use crate::experiments::loss::{Loss, link};
use crate::world::WorldConfig;
use crate::worlds::SIZE_NOISE_M;

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

/// What is known of the object's size when it is first touched: the slave starts from a side of 40 cm, and it is 36.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Size {
    /// Nothing, and the operator pushes all the same.
    Unknown,
    /// Nothing, and the operator nudges each new face and rests until the answer must have come.
    Nudged,
    /// What images show of it.
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

/// A point with the rows of its seeds.
pub(super) type Group = grid::Group<GridPoint, DelayRow>;

/// Where in the grid a run stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct GridPoint {
    pub(super) architecture: ComparedArchitecture,
    pub(super) one_way_ms: u64,
    pub(super) jitter_ms: u64,
    pub(super) loss: Loss,
    pub(super) k_p: u64,
    pub(super) visual_feedback: VisualFeedback,
    pub(super) size: Size,
}

impl GridPoint {
    pub(super) const fn plain(architecture: ComparedArchitecture, one_way_ms: u64) -> Self {
        Self {
            architecture,
            one_way_ms,
            jitter_ms: 0,
            loss: Loss::NONE,
            k_p: 1000,
            visual_feedback: VisualFeedback::Model,
            size: Size::Unknown,
        }
    }

    /// The world at this point.
    pub(super) fn world(&self) -> Result<WorldConfig, ExperimentError> {
        let mut words = format!("delay {}ms", self.one_way_ms);
        if self.jitter_ms > 0 {
            words += &format!(" {}ms", self.jitter_ms);
        }
        let link = link(&words, self.loss)?;
        let mut config = WorldConfig::over(link);
        config.stiffness_n_per_m = Some(self.k_p as f64);
        config.operator.view = self.visual_feedback;
        match self.size {
            Size::Unknown => {}
            // a round trip, and a second to see what it did
            Size::Nudged => config.operator.dwell_s = 2e-3 * self.one_way_ms as f64 + 1.0,
            Size::Known => config.slave.sensing.vision.size_noise_m = Some(SIZE_NOISE_M),
        }
        // what the other architectures do not have either
        config.slave.repeats_ms = Repeats::NONE;
        Ok(config.stretched(StretchMax::OFF, StretchMax::OFF))
    }
}

/// What an architecture did over the delay at a stiffness, without jitter and loss.
pub(super) fn sweep(
    groups: &[Group],
    architecture: ComparedArchitecture,
    k_p: u64,
) -> impl Iterator<Item = &Group> {
    groups.iter().filter(move |group| {
        let point = &group.case;
        let clean = point.jitter_ms == 0 && point.loss == Loss::NONE;
        clean && point.architecture == architecture && point.k_p == k_p
    })
}

/// The default grid.
pub(super) fn some_points() -> Vec<GridPoint> {
    let mut points = Vec::new();
    for architecture in ComparedArchitecture::ALL {
        points.extend(DELAYS_MS.map(|ms| GridPoint::plain(architecture, ms)));
        for k_p in STIFFNESSES.into_iter().filter(|k_p| *k_p != 1000) {
            points.extend(STIFF_MS.map(|ms| GridPoint {
                k_p,
                ..GridPoint::plain(architecture, ms)
            }));
        }
        let impairments = [
            (10, Loss::NONE),
            (30, Loss::NONE),
            (0, Loss::TWENTY_PERCENT),
            (10, Loss::TWENTY_PERCENT),
            (0, Loss::BURSTS_30_MS),
            (0, Loss::BURSTS_100_MS),
        ];
        for (jitter_ms, loss) in impairments {
            points.extend(IMPAIRED_MS.map(|ms| GridPoint {
                jitter_ms,
                loss,
                ..GridPoint::plain(architecture, ms)
            }));
        }
    }
    points
}

/// The whole grid: every delay, jitter, loss and stiffness.
pub(super) fn all_points() -> Vec<GridPoint> {
    let mut points = Vec::new();
    for architecture in ComparedArchitecture::ALL {
        for k_p in STIFFNESSES {
            for jitter_ms in JITTERS_MS {
                for loss in Loss::ALL {
                    points.extend(DELAYS_MS.map(|ms| GridPoint {
                        jitter_ms,
                        loss,
                        k_p,
                        ..GridPoint::plain(architecture, ms)
                    }));
                }
            }
        }
    }
    points
}

/// Replay, with the operator looking at the local model or at the delayed picture; and what the object's size does.
pub(super) fn view_points() -> Vec<GridPoint> {
    let of = |(visual_feedback, size)| {
        PICTURE_MS.map(|ms| GridPoint {
            visual_feedback,
            size,
            ..GridPoint::plain(ComparedArchitecture::REPLAY, ms)
        })
    };
    [
        (VisualFeedback::Model, Size::Unknown),
        (VisualFeedback::Model, Size::Nudged),
        (VisualFeedback::Model, Size::Known),
        (VisualFeedback::Delayed, Size::Unknown),
    ]
    .map(of)
    .concat()
}
