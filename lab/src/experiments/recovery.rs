//! The columns that show how runs followed a change of the object.

use crate::experiment::prelude::*;
use grid::Group;

/// The share of the runs that recovered; medians of the contact and the packets that they needed.
#[rustfmt::skip]
pub(super) fn columns<'a, C: 'a>() -> Vec<Column<'a, Group<C, Measured>>> {
    vec![
        column("recovered_share", "", 2, share),
        column("recovery_contact_s", "s", 2, |group| group.median(|run| run.recovery?.contact_s)),
        column("recovery_packets", "", 0, |group| group.median(|run| Some(run.recovery?.updates as f64))),
    ]
}

fn share<C>(group: &Group<C, Measured>) -> f64 {
    let recoveries = || group.runs.iter().filter_map(|run| run.recovery);
    let recovered = recoveries().filter(|recovery| recovery.contact_s.is_some());
    recovered.count() as f64 / recoveries().count() as f64
}
