//! What is measured of a row, column by column.
//!
//! `docs/sweep.md` explains every column. A measure that has no meaning in a run is empty, never 0; numbers keep
//! every digit, so that the bytes of a row say whether two machines agree.

use mmt_shared::model::update::Cause;

use crate::table::{Cell, Table};
use crate::trial::Measured;

/// The measured columns, in their order.
pub const MEASURES: [&str; 38] = [
    "duration_s",
    "contact_s",
    "pushes",
    "packet_rate_hz",
    "contact_packet_rate_hz",
    "packets",
    "packets_deadband",
    "packets_timer",
    "packets_master_only_contact",
    "packets_slave_only_contact",
    "packets_contact_lost",
    "packets_every_sample",
    "pmse",
    "pmse_x",
    "pmse_y",
    "pmse_magnitude",
    "relative_error",
    "error_rms_n",
    "jnd7_share",
    "jnd10_share",
    "position_rms_m",
    "angle_rms_rad",
    "breaks_per_push",
    "force_peak_n",
    "m_error",
    "b_error",
    "c_error",
    "recovered",
    "recovery_contact_s",
    "recovery_packets",
    "recovery_worst_error",
    "commands",
    "repeats",
    "datagrams_up_hz",
    "datagrams_down_hz",
    "bits_up_per_s",
    "bits_down_per_s",
    "digest",
];

/// The measured fields of a row as one line of CSV, without its end.
pub(super) fn measured_line(measured: &Measured) -> String {
    let columns = MEASURES.map(|key| (key, 0));
    let mut table = Table::new("", &columns);
    table.push(cells(measured));
    let csv = table.to_csv();
    let text = String::from_utf8_lossy(&csv);
    text.lines().nth(1).unwrap_or_default().to_owned()
}

fn cells(measured: &Measured) -> Vec<Cell> {
    let Measured {
        force,
        updates,
        recovery,
        traffic,
        ..
    } = measured;
    let (messages, wire) = (&traffic.messages, &traffic.wire);
    let [m, b, c] = measured.parameter_errors;
    let mut cells: Vec<Cell> = vec![
        measured.duration_s.into(),
        measured.contact_s.into(),
        measured.pushes.into(),
        updates.rate_hz().into(),
        updates.contact_rate_hz().into(),
        updates.total().into(),
    ];
    cells.extend(Cause::ALL.map(|cause| Cell::from(updates.of(cause))));
    cells.extend(
        [
            force.pmse,
            force.pmse_x,
            force.pmse_y,
            force.pmse_magnitude,
            force.relative_error,
            force.error_rms_n,
            force.jnd7_share,
            force.jnd10_share,
            measured.position_rms_m,
            measured.angle_rms_rad,
            measured.breaks_per_push,
            measured.force_peak_n,
            Some(m),
            Some(b),
            Some(c),
        ]
        .map(Cell::from),
    );
    cells.extend([
        recovery
            .map(|recovery| u64::from(recovery.contact_s.is_some()))
            .into(),
        recovery.and_then(|recovery| recovery.contact_s).into(),
        recovery.map(|recovery| recovery.updates).into(),
        recovery.map(|recovery| recovery.worst_error).into(),
        messages.up.commands.into(),
        messages.down.repeats.into(),
        wire.up.rate_hz.get().into(),
        wire.down.rate_hz.get().into(),
        wire.up.bits_per_s.get().into(),
        wire.down.bits_per_s.get().into(),
        measured.digest.clone().into(),
    ]);
    cells
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::trial::Trial;
    use crate::world::WorldConfig;

    #[test]
    fn every_cause_has_its_column_in_its_order() {
        let named = MEASURES
            .iter()
            .filter_map(|key| key.strip_prefix("packets_"));
        assert!(named.eq(Cause::ALL.map(Cause::name)));
    }

    #[test]
    fn a_line_has_a_field_for_every_column_and_absent_ones_are_empty() {
        let trial = Trial::new(WorldConfig::default(), Duration::from_millis(20));
        let measured = trial.run().unwrap();
        assert_eq!(cells(&measured).len(), MEASURES.len());
        let line = measured_line(&measured);
        let fields: Vec<&str> = line.split(',').collect();
        assert_eq!(fields.len(), MEASURES.len(), "{line}");
        let field = |key: &str| fields[MEASURES.iter().position(|of| *of == key).unwrap()];
        assert_eq!(field("packets"), "0");
        assert_eq!(field("pmse"), "");
        assert_eq!(field("recovery_contact_s"), "");
        assert_eq!(field("digest"), measured.digest);
    }
}
