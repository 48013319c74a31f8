//! The experiment: every case of the grid, the promises of the transport, a table and a figure of them.

use super::runs::Run;
use super::{Case, cases, figure, tables};
use crate::digest::of_runs;
use crate::reproduce::{Extent, Findings, Laboratory, ReproduceError};

/// Runs the grid and keeps `transport.csv` and `transport.svg`.
///
/// # Errors
/// Those of [`Laboratory::transfer`] and [`Laboratory::keep`]; the figure could not be drawn.
pub fn reproduce(laboratory: &dyn Laboratory, extent: Extent) -> Result<Findings, ReproduceError> {
    let grids = (1..=extent.seeds).map(|seed| cases(extent.duration, seed));
    let cases: Vec<Case> = grids.flatten().collect();
    let outcomes = laboratory.transfer("transport", &cases)?;
    let runs: Vec<Run> = cases.iter().zip(&outcomes).collect();
    laboratory.keep("transport.csv", &tables::all(&runs).to_csv())?;
    laboratory.keep_figure("transport.svg", &figure::figure(&runs))?;
    Ok(Findings {
        experiment: "transport",
        extent,
        digest: of_runs(outcomes.iter().map(|outcome| outcome.digest.as_str())),
        configuration: Vec::new(),
        tables: vec![
            tables::promises(&runs),
            tables::examples(&runs),
            tables::worst(&runs),
        ],
    })
}
