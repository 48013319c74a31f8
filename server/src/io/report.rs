//! What a session came to: the totals of the farewell and the report.
//!
//! Up is what this side received, down is what it sent: `wire.up` counts the datagrams that reached the slave's
//! socket, `wire.down` those that its socket really sent after the emulated network. What only the master knows
//! comes from its farewell and is absent without it.

mod drops;

use std::time::Duration;

use mmt_netem::io::socket::SocketCounters;
use mmt_shared::io::network_task::NetworkCounts;
use mmt_shared::report::totals::{MasterTotals, SlaveTotals};
use mmt_shared::report::{
    ArchitectureReport, DelayReport, EstimateReport, ForceReport, LinkReport, LoopReport,
    MessagesReport, ModelReport, ToolReport, UpDown, UpdatesReport, WireReport, ending_name, named,
};
use mmt_shared::stats::session::Traffic;
use mmt_shared::time::TICK_S;
use mmt_shared::wire::Ending;

use super::SlaveReport;
use super::host::Shared;
use super::slave_loop::Finished;
use crate::end::SlaveEnd;
use crate::slave::{Slave, SlaveConfig};
use crate::tool::force::ToolForce;

/// IP and UDP headers of a datagram, bytes.
const HEADERS_IPV4: u64 = 28;
const HEADERS_IPV6: u64 = 48;

/// Everything that a session left behind.
pub(super) struct Outcome {
    pub(super) ending: Ending,
    /// From the welcome to the farewell.
    pub(super) duration: Duration,
    /// None if the thread panicked.
    pub(super) finished: Option<Finished>,
    pub(super) counts: NetworkCounts,
    /// Datagrams that found no room before the loop.
    pub(super) arrivals_dropped: u64,
    /// Datagrams that QUIC displaced by newer ones, or still held at the end.
    pub(super) unsent: u64,
    /// Datagrams that QUIC received and nobody read.
    pub(super) unread: u64,
    /// The socket at the welcome and at the farewell.
    pub(super) before: SocketCounters,
    pub(super) after: SocketCounters,
    pub(super) over_ipv4: bool,
}

impl Outcome {
    /// What the farewell reports.
    pub(super) fn totals(&self) -> SlaveTotals {
        let end = self.finished.as_ref().map(|finished| &finished.end);
        let slave = end.map(SlaveEnd::slave);
        let counts = end.map(|end| *end.counts()).unwrap_or_default();
        let mut updates_by_cause = SlaveTotals::default().updates_by_cause;
        for (slot, (_, count)) in updates_by_cause.iter_mut().zip(counts.updates.by_cause()) {
            *slot = u32::try_from(count).unwrap_or(u32::MAX);
        }
        let force = slave.map(|slave| ForceReport::new(&slave.force().summary(), None));
        SlaveTotals {
            duration_ns: u64::try_from(self.duration.as_nanos()).unwrap_or(u64::MAX),
            traffic: self.traffic(),
            updates_by_cause,
            samples_received: counts.samples,
            force: force.unwrap_or_default(),
            model: slave.map(model).unwrap_or_default(),
        }
    }

    fn traffic(&self) -> Traffic {
        let (before, after) = (&self.before, &self.after);
        let end = self.finished.as_ref().map(|finished| &finished.end);
        let since = |after: u64, before| after.saturating_sub(before);
        Traffic {
            udp_datagrams_sent: since(after.outgoing.sent.packets, before.outgoing.sent.packets),
            udp_bytes_sent: since(after.outgoing.sent.bytes, before.outgoing.sent.bytes),
            udp_datagrams_received: since(after.received.packets, before.received.packets),
            udp_bytes_received: since(after.received.bytes, before.received.bytes),
            ..end.map(|end| end.channel().traffic()).unwrap_or_default()
        }
    }
}

/// The report of a session.
pub(super) fn report(
    shared: &Shared,
    config: &SlaveConfig,
    outcome: &Outcome,
    finished: &Finished,
    theirs: Option<&MasterTotals>,
) -> SlaveReport {
    let version = env!("CARGO_PKG_VERSION");
    let mut report = SlaveReport::new(version, "slave", shared.configuration(config));
    let traffic = outcome.traffic();
    report.seed = Some(config.seed);
    report.duration_s = outcome.duration.as_secs_f64().into();
    report.ending = Some(ending_name(outcome.ending).to_owned());
    report.architecture = ArchitectureReport::named(finished.end.architecture());
    report.updates = updates(&finished.end, theirs);
    report.messages = messages(outcome, &finished.end, &traffic);
    report.wire = wire(outcome, &traffic);
    let slave = finished.end.slave();
    report.link = link(&finished.end);
    report.emulation.down = shared.meter.lateness().report();
    report.drops = Some(drops::drops(shared, outcome, finished, &traffic));
    if let Some(theirs) = theirs {
        report.haptic_loop = theirs.haptic_loop;
    }
    report.force = ForceReport::new(&slave.force().summary(), None);
    report.model = model(slave);
    report.tool = tool(slave.tool_force());
    let of = &finished.ticker;
    report.slave_loop = LoopReport::new(of.ticks, of.skipped, &of.cpu, &of.lateness);
    report
}

fn updates(end: &SlaveEnd, theirs: Option<&MasterTotals>) -> UpdatesReport {
    let mut updates = UpdatesReport::default();
    updates.set_sent(&end.counts().updates);
    updates.set_repeated(&end.counts().repeated);
    if let Some(totals) = theirs {
        updates.applied = Some(totals.updates_applied.into());
        updates.dropped = Some(named(totals.updates_dropped.by_name()));
    }
    updates
}

fn messages(outcome: &Outcome, end: &SlaveEnd, traffic: &Traffic) -> UpDown<MessagesReport> {
    let duration_s = outcome.duration.as_secs_f64();
    let repeats = end.counts().repeated.total();
    UpDown {
        up: MessagesReport::up(&traffic.received, duration_s),
        down: MessagesReport::down(&traffic.sent, repeats, duration_s),
    }
}

fn wire(outcome: &Outcome, traffic: &Traffic) -> UpDown<WireReport> {
    let headers = if outcome.over_ipv4 {
        HEADERS_IPV4
    } else {
        HEADERS_IPV6
    };
    let of = |datagrams, bytes| {
        WireReport::new(datagrams, bytes, headers, outcome.duration.as_secs_f64())
    };
    UpDown {
        up: of(traffic.udp_datagrams_received, traffic.udp_bytes_received),
        down: of(traffic.udp_datagrams_sent, traffic.udp_bytes_sent),
    }
}

fn link(end: &SlaveEnd) -> LinkReport {
    let peer = end.channel().peer();
    LinkReport {
        rtt_ms: DelayReport::of(peer.round_trip().histogram()),
        loss_up: peer.incoming().share().into(),
        loss_down: peer.outgoing().share().into(),
        playout_delay_ms: DelayReport::of(end.slave().playout().delays()),
    }
}

/// m, b, c: absent as long as the estimator has seen nothing that counts.
fn model(slave: &Slave) -> ModelReport {
    let (estimate, truth) = (slave.estimate(), slave.environment().truth());
    let [m, b, c, ..] = truth.to_array();
    let seen = |estimated: f64| (estimate.samples > 0).then_some(estimated);
    ModelReport {
        mass_kg: EstimateReport::new(seen(estimate.m), m),
        damping_ns_per_m: EstimateReport::new(seen(estimate.b), b),
        friction_n: EstimateReport::new(seen(estimate.c), c),
    }
}

fn tool(force: &ToolForce) -> ToolReport {
    ToolReport {
        held_s: (force.held_ticks() as f64 * TICK_S).into(),
        force_peak_n: force.peak_n().into(),
    }
}
