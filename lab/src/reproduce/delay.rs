//! At which delay each architecture stops being usable: one operator, one object, one network, every architecture.
//!
//! The plain sweep of the delay at k_p 1000 for all of them, the same at other stiffnesses up to the delays that
//! decide there, and jitter, loss and bursts at a few delays; the full grid on request. And what the operator's
//! picture does beyond 500 ms.

mod crossing;

use std::time::Duration;

use mmt_client::operator::scripted::Picture;
use mmt_server::link::Repeats;
use mmt_shared::rate_control::StretchMax;
use mmt_shared::settings::PoseCorrection;

use super::{Extent, Findings, Laboratory, ReproduceError};
use crate::architecture::{Architecture, DelayRow};
use crate::figure::{Axis, Colour, Dot, Figure, Legend, Mark, Panel, Series, Stroke};
use crate::statistics::{Interval, median};
use crate::table::{Cell, Table};
use crate::world::WorldConfig;

/// One-way delays, ms.
const DELAYS_MS: [u64; 13] = [0, 1, 2, 5, 10, 14, 20, 50, 100, 250, 500, 1000, 2000];
/// Jitter, ms.
const JITTERS_MS: [u64; 3] = [0, 10, 30];
/// Virtual stiffness k_p, N/m.
const STIFFNESSES: [u64; 3] = [500, 1000, 3000];
/// Delays at which jitter and loss are tried in the default grid, ms.
const IMPAIRED_MS: [u64; 3] = [50, 250, 500];
/// Delays at which other stiffnesses are tried in the default grid, ms.
const STIFF_MS: [u64; 8] = [0, 2, 5, 10, 14, 20, 50, 250];
/// Delays at which the operator's picture is compared, ms.
const PICTURE_MS: [u64; 4] = [250, 500, 1000, 2000];

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

    /// As `delay.csv` spells it: a share, or the bursts' mean length.
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

/// One run.
#[derive(Clone, Debug, PartialEq)]
pub struct Duel {
    /// What stands between hand and object.
    pub architecture: Architecture,
    /// The world.
    pub config: WorldConfig,
    /// How long it runs.
    pub duration: Duration,
}

/// Where in the grid a run stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Place {
    architecture: Architecture,
    one_way_ms: u64,
    jitter_ms: u64,
    loss: Loss,
    k_p: u64,
    picture: Picture,
}

impl Place {
    const fn plain(architecture: Architecture, one_way_ms: u64) -> Self {
        Self {
            architecture,
            one_way_ms,
            jitter_ms: 0,
            loss: Loss::None,
            k_p: 1000,
            picture: Picture::Model,
        }
    }

    fn duel(&self, seed: u64, duration: Duration) -> Result<Duel, ReproduceError> {
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
fn some_places() -> Vec<Place> {
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
fn all_places() -> Vec<Place> {
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

/// Replay, with the operator looking at the local model or at the delayed picture.
fn picture_places() -> Vec<Place> {
    let replay = Architecture::Mediated(PoseCorrection::Replay);
    let of = |picture| {
        PICTURE_MS.map(|ms| Place {
            picture,
            ..Place::plain(replay, ms)
        })
    };
    [of(Picture::Model), of(Picture::Delayed)].concat()
}

/// A place with the rows of its seeds.
type Group<'a> = (&'a Place, &'a [DelayRow]);

/// Runs the grid and keeps `delay.csv`, `delay-limits.csv`, `delay-view.csv`, `delay-crossing.csv` and `delay.svg`.
///
/// # Errors
/// As [`Laboratory::duel`] and [`Laboratory::keep`].
pub fn reproduce(
    laboratory: &dyn Laboratory,
    extent: Extent,
    full: bool,
) -> Result<Findings, ReproduceError> {
    let places = if full { all_places() } else { some_places() };
    let rows = run(laboratory, "delay", &places, extent)?;
    let seeds = extent.seeds.max(1) as usize;
    let groups: Vec<Group> = places.iter().zip(rows.chunks(seeds)).collect();
    laboratory.keep("delay.csv", &runs(&groups).to_csv())?;
    let limits = limits(&groups);
    laboratory.keep("delay-limits.csv", &limits.to_csv())?;
    laboratory.keep("delay.svg", figure(&groups).draw("delay.svg")?.as_bytes())?;

    let pictures = picture_places();
    let seen = run(laboratory, "delay-view", &pictures, extent)?;
    let seen: Vec<Group> = pictures.iter().zip(seen.chunks(seeds)).collect();
    let views = views(&seen);
    laboratory.keep("delay-view.csv", &views.to_csv())?;
    let near = crossing::reproduce(laboratory, extent)?;
    Ok(Findings {
        experiment: "delay",
        extent,
        digest: String::new(),
        configuration: vec![WorldConfig::default()],
        tables: [vec![replayed(&groups), limits, views], near.into()].concat(),
    })
}

fn run(
    laboratory: &dyn Laboratory,
    what: &str,
    places: &[Place],
    extent: Extent,
) -> Result<Vec<DelayRow>, ReproduceError> {
    let duels = places
        .iter()
        .flat_map(|place| (1..=extent.seeds).map(|seed| place.duel(seed, extent.duration)));
    let duels: Result<Vec<Duel>, ReproduceError> = duels.collect();
    laboratory.duel(what, &duels?)
}

fn runs(groups: &[Group]) -> Table {
    let mut table = Table::new(
        "Runs",
        &[
            ("architecture", 0),
            ("one_way_ms", 0),
            ("jitter_ms", 0),
            ("loss", 0),
            ("k_p", 0),
            ("seed", 0),
            ("packet_rate_hz", 1),
            ("wire_rate_hz", 1),
            ("pmse", 4),
            ("relative_error", 3),
            ("pose_rms_mm", 2),
            ("force_peak_n", 2),
            ("breaks_per_push", 2),
            ("energy_injected_j", 4),
            ("observer_min_j", 4),
            ("apparent_mass_ratio", 2),
            ("pushes", 0),
            ("wire_bytes_per_s", 0),
            ("playout_delay_ms", 1),
        ],
    );
    for (place, rows) in groups {
        for (row, seed) in rows.iter().zip(1_u64..) {
            table.push([
                Cell::from(place.architecture.name()),
                place.one_way_ms.into(),
                place.jitter_ms.into(),
                place.loss.name().into(),
                place.k_p.into(),
                seed.into(),
                row.packet_rate_hz.into(),
                row.wire_rate_hz.into(),
                row.pmse.into(),
                row.relative_error.into(),
                row.pose_rms_mm.into(),
                row.force_peak_n.into(),
                row.breaks_per_push.into(),
                row.energy_injected_j.into(),
                row.observer_min_j.into(),
                row.apparent_mass_ratio.into(),
                row.pushes.into(),
                row.wire_bytes_per_s.into(),
                row.playout_delay_ms.into(),
            ]);
        }
    }
    table
}

/// Why an architecture is no longer usable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Failing {
    Breaks,
    Peak,
    Mass,
}

impl Failing {
    fn words(self) -> &'static str {
        match self {
            Self::Breaks => "breaks per push > 2",
            Self::Peak => "force peak > 2 x that at zero delay",
            Self::Mass => "apparent mass > 1.5 x",
        }
    }
}

/// By the medians over the seeds; a run that completed no push counts as broken.
fn failing(rows: &[DelayRow], peak_at_zero: f64) -> Option<Failing> {
    let breaks = median(
        rows.iter()
            .map(|row| row.breaks_per_push.unwrap_or(f64::MAX)),
    )?;
    let peak = median(rows.iter().filter_map(|row| row.force_peak_n))?;
    let mass = median(rows.iter().filter_map(|row| row.apparent_mass_ratio));
    if breaks > 2.0 {
        Some(Failing::Breaks)
    } else if peak > 2.0 * peak_at_zero {
        Some(Failing::Peak)
    } else if mass.is_some_and(|mass| mass > 1.5) {
        Some(Failing::Mass)
    } else {
        None
    }
}

fn is_clean(place: &Place) -> bool {
    place.jitter_ms == 0 && place.loss == Loss::None
}

/// The greatest delay at which each architecture is usable, and the first at which it is not.
fn limits(groups: &[Group]) -> Table {
    let mut table = Table::new(
        "Usable up to which one-way delay (medians over the seeds; without jitter and loss)",
        &[
            ("architecture", 0),
            ("k_p", 0),
            ("usable_to_ms", 0),
            ("fails_at_ms", 0),
            ("why", 0),
        ],
    );
    for architecture in Architecture::ALL {
        for k_p in STIFFNESSES {
            let of = |group: &&Group| {
                group.0.architecture == architecture && group.0.k_p == k_p && is_clean(group.0)
            };
            let sweep: Vec<&Group> = groups.iter().filter(of).collect();
            let at_zero = sweep.iter().find(|group| group.0.one_way_ms == 0);
            let peak =
                at_zero.and_then(|group| median(group.1.iter().filter_map(|row| row.force_peak_n)));
            let failed = sweep.iter().find_map(|group| {
                failing(group.1, peak.unwrap_or(f64::INFINITY)).map(|why| (group.0.one_way_ms, why))
            });
            let usable = sweep
                .iter()
                .map(|group| group.0.one_way_ms)
                .take_while(|ms| failed.is_none_or(|(at, _)| *ms < at))
                .last();
            table.push([
                architecture.name().into(),
                k_p.into(),
                usable.into(),
                failed.map(|(at, _)| at).into(),
                failed.map(|(_, why)| why.words()).into(),
            ]);
        }
    }
    table
}

fn mean(rows: &[DelayRow], of: impl Fn(&DelayRow) -> Option<f64>) -> Cell {
    Interval::of(rows.iter().filter_map(of))
        .map(|interval| interval.mean)
        .into()
}

fn largest(rows: &[DelayRow], of: impl Fn(&DelayRow) -> Option<f64>) -> Cell {
    rows.iter().filter_map(of).reduce(f64::max).into()
}

/// MMT with replay over everything that was tried.
fn replayed(groups: &[Group]) -> Table {
    let mut table = Table::new(
        "MMT with replay: mean over the seeds; peak and energy the largest, observer the least",
        &[
            ("one_way_ms", 0),
            ("jitter_ms", 0),
            ("loss", 0),
            ("k_p", 0),
            ("packet_rate_hz", 2),
            ("relative_error", 3),
            ("pose_rms_mm", 2),
            ("force_peak_n", 2),
            ("breaks_per_push", 2),
            ("energy_injected_mj", 3),
            ("observer_min_mj", 3),
        ],
    );
    let replay = Architecture::Mediated(PoseCorrection::Replay);
    for (place, rows) in groups.iter().filter(|group| group.0.architecture == replay) {
        let least = rows.iter().map(|row| row.observer_min_j).reduce(f64::min);
        table.push([
            place.one_way_ms.into(),
            place.jitter_ms.into(),
            place.loss.name().into(),
            place.k_p.into(),
            mean(rows, |row| Some(row.packet_rate_hz)),
            mean(rows, |row| row.relative_error),
            mean(rows, |row| row.pose_rms_mm),
            largest(rows, |row| row.force_peak_n),
            mean(rows, |row| row.breaks_per_push),
            largest(rows, |row| row.energy_injected_j.map(|j| j * 1e3)),
            least.map(|j| j * 1e3).into(),
        ]);
    }
    table
}

fn views(groups: &[Group]) -> Table {
    let mut table = Table::new(
        "What the operator looks at (MMT with replay): mean over the seeds",
        &[
            ("view", 0),
            ("one_way_ms", 0),
            ("pushes", 1),
            ("pose_rms_mm", 2),
            ("breaks_per_push", 2),
            ("force_peak_n", 2),
            ("relative_error", 3),
        ],
    );
    for (place, rows) in groups {
        let view = match place.picture {
            Picture::Model => "model",
            Picture::Delayed => "delayed",
        };
        table.push([
            view.into(),
            place.one_way_ms.into(),
            mean(rows, |row| Some(row.pushes as f64)),
            mean(rows, |row| row.pose_rms_mm),
            mean(rows, |row| row.breaks_per_push),
            mean(rows, |row| row.force_peak_n),
            mean(rows, |row| row.relative_error),
        ]);
    }
    table
}

/// Four measures over the delay, one curve an architecture; zero delay stands at half a millisecond.
fn figure(groups: &[Group]) -> Figure {
    type Measure = (&'static str, fn(&DelayRow) -> Option<f64>, Axis);
    let measures: [Measure; 4] = [
        (
            "contact breaks per push",
            |row| row.breaks_per_push,
            Axis::log("breaks per push"),
        ),
        (
            "largest force on the hand",
            |row| row.force_peak_n,
            Axis::linear("force, N"),
        ),
        (
            "relative force error",
            |row| row.relative_error,
            Axis::log("relative error"),
        ),
        (
            "packets from slave to master",
            |row| Some(row.packet_rate_hz),
            Axis::log("packets per second"),
        ),
    ];
    let panels = measures.into_iter().enumerate().map(|(n, (title, of, y))| {
        let series = Architecture::ALL
            .into_iter()
            .enumerate()
            .map(|(k, architecture)| {
                let (stroke, mark, colour, width) = look(k, architecture);
                let here = groups.iter().filter(|group| {
                    group.0.architecture == architecture && group.0.k_p == 1000 && is_clean(group.0)
                });
                let dots = here.filter_map(|(place, rows)| {
                    let y = median(rows.iter().filter_map(of))?;
                    Some(Dot::at((place.one_way_ms as f64).max(0.5), y))
                });
                Series::line(architecture.name(), colour, dots.collect())
                    .marked(mark)
                    .stroked(stroke, width)
            });
        Panel {
            title: title.to_owned(),
            x: Axis::log("one-way delay, ms (none at 0.5)"),
            y,
            series: series.collect(),
            legend: if n == 0 {
                Legend::UpperLeft
            } else {
                Legend::None
            },
        }
    });
    Figure {
        panels: panels.collect(),
        columns: 2,
        panel_size: (560, 400),
    }
}

/// How an architecture is drawn: forces on the wire dashed, models solid, the default thick.
fn look(k: usize, architecture: Architecture) -> (Stroke, Mark, Colour, u32) {
    match architecture {
        Architecture::Bilateral(_) => (Stroke::Dashed, Mark::Square, Colour::nth(k), 1),
        Architecture::Mediated(PoseCorrection::Snap) => {
            (Stroke::Solid, Mark::Circle, Colour::Sky, 1)
        }
        Architecture::Mediated(PoseCorrection::MatchedStamps) => {
            (Stroke::Solid, Mark::Circle, Colour::Grey, 1)
        }
        Architecture::Mediated(PoseCorrection::Replay) => {
            (Stroke::Solid, Mark::Circle, Colour::Black, 3)
        }
        Architecture::Auto => (Stroke::Solid, Mark::Cross, Colour::Vermilion, 1),
    }
}
