//! At which delay each architecture stops being usable: one operator, one object, one network, every architecture.
//!
//! The plain sweep of the delay at k_p 1000 for all of them, the same at other stiffnesses up to the delays that
//! decide there, and jitter, loss and bursts at a few delays; the full grid on request. And what the operator's
//! picture does beyond 500 ms.

mod crossing;
mod figure;
mod grid;
mod tables;

use std::time::Duration;

use super::{Extent, Findings, Laboratory, ReproduceError};
use crate::architecture::{Architecture, DelayRow};
use crate::world::WorldConfig;
use figure::figure;
use grid::{Place, all_places, picture_places, some_places};
use tables::{limits, mean, replayed, runs, views};

pub(super) use grid::Loss;

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
    laboratory.keep_figure("delay.svg", &figure(&groups))?;

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
