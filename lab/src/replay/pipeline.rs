//! Recorded pushes through mmt itself: the live system's own ends in virtual time, with the recording as the world.
//!
//! The hand goes the finger's way; what the slave's tool meets is the recording, behind the object's plug. The recorded
//! force comes when it was measured, the block's pose only where it rested. Beside it stands a scheme that knows no model:
//! it holds the last measured force. Neither may see a sample before its time.

mod course;
mod hold;
mod measures;
mod system;

use std::time::Duration;

use mmt_server::trigger::Scheme;
use mmt_shared::recording::Recording;

use super::report::percent;
use crate::table::{Table, column};
use crate::world::WorldError;
use course::Course;
use hold::Hold;

pub use measures::{Errors, PipelineReport};

/// Update scheme of mmt. Chosen on `black-patch`; the other recordings were in view when the model was made.
const MMT: Scheme = Scheme::Deadband { delta: 0.08 };
/// Deadbands of the held force.
const HELD: [f64; 3] = [0.10, 0.15, 0.20];
/// One-way delays, ms.
const DELAYS_MS: [u64; 2] = [0, 250];

/// Runs every scheme over every delay.
///
/// # Errors
/// The recording holds a place that is beyond the tool's reach, or no way of the finger.
pub fn pipeline(recording: &Recording) -> Result<Vec<PipelineReport>, WorldError> {
    let course = Course::of(recording);
    let mut reports = Vec::new();
    for delay_ms in DELAYS_MS {
        let delay = Duration::from_millis(delay_ms);
        let mut keep = |system, scheme: Scheme, run: measures::Run| {
            reports.push(run.report(system, scheme.to_string(), delay_ms));
        };
        keep("mmt", MMT, system::run(&course, MMT, delay)?);
        for delta in HELD {
            let scheme = Scheme::Deadband { delta };
            keep("hold", scheme, Hold::new(delta, None).run(&course, delay));
        }
        let (delta, t_update) = (HELD[0], Duration::from_millis(150));
        let timed = Hold::new(delta, Some(t_update)).run(&course, delay);
        keep("hold", Scheme::Hybrid { delta, t_update }, timed);
    }
    Ok(reports)
}

/// The reports as a table.
#[must_use]
pub fn table(reports: &[PipelineReport]) -> Table {
    Table::of(
        "The same pushes through mmt itself, and the last measured force held instead: updates per second of contact, errors in %",
        reports,
        &[
            column("system", "", 0, |report| report.system),
            column("scheme", "", 0, |report| report.scheme.clone()),
            column("delay ms", "ms", 0, |report| report.delay_ms),
            column("in contact", "Hz", 2, |report| report.contact_rate_hz),
            column("|F| median", "%", 1, |report| {
                percent(report.errors.force_median)
            }),
            column("F median", "%", 1, |report| {
                percent(report.errors.vector_median)
            }),
            column("|F| mean", "%", 1, |report| {
                percent(report.errors.force_mean)
            }),
            column("impulse", "%", 1, |report| {
                percent(report.errors.impulse_error)
            }),
            column("|F| of a push", "%", 1, |report| {
                percent(report.errors.force_median_of_pushes)
            }),
        ],
    )
}

#[cfg(test)]
mod tests;
