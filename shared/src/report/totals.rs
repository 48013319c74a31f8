//! What a farewell reports: the numbers that only its sender knows, in the form in which the report prints them.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::{ForceReport, LoopReport, ModelReport};
use crate::model::update::Cause;
use crate::stats::session::{Traffic, UpdateDrops};

/// The report of a farewell: JSON. A number that is not finite is null.
#[must_use]
pub fn to_report(totals: &impl Serialize) -> Vec<u8> {
    serde_json::to_vec(totals).unwrap_or_default()
}

/// What a farewell reports; none if it cannot be read. Keys that are not known are skipped, those that are missing are 0
/// or absent.
#[must_use]
pub fn of_report<T: DeserializeOwned>(report: &[u8]) -> Option<T> {
    serde_json::from_slice(report).ok()
}

/// What the slave reports in its farewell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SlaveTotals {
    /// From the welcome to the farewell, ns.
    pub duration_ns: u64,
    /// Datagrams.
    pub traffic: Traffic,
    /// Updates sent for the first time, by cause, in the order of [`Cause::ALL`]; repeats are not here.
    pub updates_by_cause: [u32; Cause::ALL.len()],
    /// HIP samples taken into the play-out buffer.
    pub samples_received: u64,
    /// Force metrics over the samples for which both forces are known.
    pub force: ForceReport,
    /// What the estimator found.
    pub model: ModelReport,
}

/// What the master reports in its farewell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct MasterTotals {
    /// From the welcome to the farewell, ns.
    pub duration_ns: u64,
    /// Datagrams.
    pub traffic: Traffic,
    /// Updates that reached the model.
    pub updates_applied: u32,
    /// Updates that did not.
    pub updates_dropped: UpdateDrops,
    /// The haptic loop.
    pub haptic_loop: LoopReport,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_report_of_another_program_gives_what_it_has_and_the_rest_is_absent() {
        let foreign = br#"{"updates_applied": 7, "haptic_loop": {"ticks": 9}, "new": [1]}"#;
        let totals: MasterTotals = of_report(foreign).unwrap();
        assert_eq!(
            (totals.updates_applied, totals.haptic_loop.ticks),
            (7, Some(9))
        );
        assert_eq!(totals.haptic_loop.cpu_us.p50.get(), None);
        let older = br#"{"force": {"pmse": 0.25}, "model": {}}"#;
        let totals: SlaveTotals = of_report(older).unwrap();
        assert_eq!(totals.force.pmse.get(), Some(0.25));
        assert_eq!(of_report::<SlaveTotals>(b"not JSON"), None);
    }

    #[test]
    fn the_longest_report_fits_into_a_frame() {
        let mut totals = SlaveTotals::default();
        totals.traffic.udp_bytes_sent = u64::MAX;
        totals.updates_by_cause = [u32::MAX; 6];
        let long = std::f64::consts::PI * 1e-300;
        totals.force.pmse = long.into();
        totals.model.mass_kg.estimate = long.into();
        let report = to_report(&totals);
        assert_eq!(of_report(&report), Some(totals));
        assert!(report.len() < 2000, "{} bytes", report.len());
    }
}
