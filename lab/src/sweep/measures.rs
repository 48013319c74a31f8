//! What is measured of a row, column by column.
//!
//! `docs/sweep.md` explains every column. A measure that has no meaning in a run is empty, never 0; numbers keep
//! every digit, so that the bytes of a row show whether two machines agree.

use mmt_shared::model::update::Cause;

use crate::table::{Cell, Column, column};
use crate::trial::Measured;

/// The measured columns, in their order.
#[must_use]
#[rustfmt::skip]
pub fn columns<'a>() -> Vec<Column<'a, Measured>> {
    let packets = |key, cause| {
        let of = move |run: &Measured| Cell::from(run.updates.of(cause));
        Column::new(key, "", 0, of)
    };
    vec![
        column("duration_s", "s", 0, |run| run.duration_s),
        column("contact_s", "s", 0, |run| run.contact_s),
        column("pushes", "", 0, |run| run.pushes),
        column("packet_rate_hz", "Hz", 0, |run| run.updates.rate_hz()),
        column("contact_packet_rate_hz", "Hz", 0, |run| run.updates.contact_rate_hz()),
        column("packets", "", 0, |run| run.updates.total()),
        packets("packets_deadband", Cause::Deadband),
        packets("packets_timer", Cause::Timer),
        packets("packets_master_only_contact", Cause::MasterOnlyContact),
        packets("packets_slave_only_contact", Cause::SlaveOnlyContact),
        packets("packets_contact_lost", Cause::ContactLost),
        packets("packets_every_sample", Cause::EverySample),
        packets("packets_elsewhere", Cause::Elsewhere),
        column("pmse", "", 0, |run| run.force.pmse),
        column("pmse_x", "", 0, |run| run.force.pmse_x),
        column("pmse_y", "", 0, |run| run.force.pmse_y),
        column("pmse_magnitude", "", 0, |run| run.force.pmse_magnitude),
        column("relative_error", "", 0, |run| run.force.relative_error),
        column("error_rms_n", "N", 0, |run| run.force.error_rms_n),
        column("jnd7_share", "", 0, |run| run.force.jnd7_share),
        column("jnd10_share", "", 0, |run| run.force.jnd10_share),
        column("pmse_true", "", 0, |run| run.true_force.pmse_true.get()),
        column("relative_error_true", "", 0, |run| run.true_force.relative_error_true.get()),
        column("contact_true_s", "s", 0, |run| run.true_force.contact_true_s.get()),
        column("position_rms_m", "m", 0, |run| run.position_rms_m),
        column("angle_rms_rad", "rad", 0, |run| run.angle_rms_rad),
        column("breaks_per_push", "", 0, |run| run.breaks_per_push),
        column("force_peak_n", "N", 0, |run| run.force_peak_n),
        column("m_error", "", 0, |run| run.parameter_errors[0]),
        column("b_error", "", 0, |run| run.parameter_errors[1]),
        column("c_error", "", 0, |run| run.parameter_errors[2]),
        column("recovered", "", 0, |run| Some(u64::from(run.recovery?.contact_s.is_some()))),
        column("recovery_contact_s", "s", 0, |run| run.recovery?.contact_s),
        column("recovery_packets", "", 0, |run| Some(run.recovery?.updates)),
        column("recovery_worst_error", "", 0, |run| Some(run.recovery?.worst_error)),
        column("commands", "", 0, |run| run.traffic.messages.up.commands),
        column("repeats", "", 0, |run| run.traffic.messages.down.repeats),
        column("datagrams_up_hz", "Hz", 0, |run| run.traffic.wire.up.rate_hz.get()),
        column("datagrams_down_hz", "Hz", 0, |run| run.traffic.wire.down.rate_hz.get()),
        column("bits_up_per_s", "bit/s", 0, |run| run.traffic.wire.up.bits_per_s.get()),
        column("bits_down_per_s", "bit/s", 0, |run| run.traffic.wire.down.bits_per_s.get()),
        column("digest", "", 0, |run| run.digest.clone()),
    ]
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::trial::Trial;
    use crate::world::WorldConfig;

    #[test]
    fn every_cause_has_its_column_in_its_order() {
        let columns = columns();
        let named = columns.iter().map(|column| column.key);
        let named = named.filter_map(|key| key.strip_prefix("packets_"));
        assert!(named.eq(Cause::ALL.map(Cause::name)));
    }

    #[test]
    fn what_has_no_meaning_is_absent() {
        let trial = Trial::new(WorldConfig::default(), Duration::from_millis(20));
        let measured = trial.run().unwrap();
        let cell = |key: &str| {
            let columns = columns();
            let column = columns.iter().find(|column| column.key == key).unwrap();
            column.cell(&measured)
        };
        assert_eq!(cell("packets"), Cell::Count(0));
        assert_eq!(cell("pmse"), Cell::Absent);
        assert_eq!(cell("recovery_contact_s"), Cell::Absent);
        assert_eq!(cell("digest"), Cell::Text(measured.digest.clone()));
    }
}
