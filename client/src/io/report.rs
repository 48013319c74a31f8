//! What a session came to: the totals of the farewell and the report.
//!
//! What only the slave counted is taken from its farewell and is absent without one, never guessed.

use std::net::SocketAddr;
use std::time::Duration;

use mmt_netem::io::driver::DirectionCounters;
use mmt_netem::io::lateness::Lateness;
use mmt_netem::io::socket::SocketCounters;
use mmt_shared::io::farewell::ReceivedFarewell;
use mmt_shared::io::network_task::NetworkCounts;
use mmt_shared::io::transport::DatagramCounts;
use mmt_shared::model::update::Cause;
use mmt_shared::report::totals::{MasterTotals, SlaveTotals};
use mmt_shared::report::{
    ArchitectureReport, Counts, DelayReport, ForceReport, LinkReport, LoopReport, MessagesReport,
    Number, PassivityReport, PoseReport, PushesReport, UpDown, UpdatesReport, WireReport,
    ending_name, named,
};
use mmt_shared::stats::session::Traffic;
use mmt_shared::wire::Architecture;

use super::haptic::HapticLoop;
use super::{MasterConfiguration, MasterOptions, MasterReport, OperatorChoice, SessionEnd};
use crate::end::MasterEnd;
use crate::tdpa::TdpaHand;

/// A session that has ended.
#[derive(Debug)]
pub(super) struct Ended {
    pub(super) why: SessionEnd,
    pub(super) haptic: HapticLoop,
    /// From the welcome to the farewell.
    pub(super) duration: Duration,
    pub(super) counts: NetworkCounts,
    /// Datagrams that found no room before the haptic loop.
    pub(super) arrivals_dropped: u64,
    /// The slave's, if it came.
    pub(super) farewell: Option<ReceivedFarewell<SlaveTotals>>,
    pub(super) sockets: SocketCounters,
    /// Of the emulated network on what the master sent.
    pub(super) lateness: Lateness,
    pub(super) passed: DatagramCounts,
    pub(super) address: SocketAddr,
}

impl Ended {
    fn end(&self) -> &MasterEnd {
        &self.haptic.end
    }

    /// What the master reports to the slave.
    pub(super) fn totals(&self) -> MasterTotals {
        MasterTotals {
            duration_ns: u64::try_from(self.duration.as_nanos()).unwrap_or(u64::MAX),
            traffic: Traffic {
                udp_datagrams_sent: self.sockets.outgoing.sent.packets,
                udp_bytes_sent: self.sockets.outgoing.sent.bytes,
                udp_datagrams_received: self.sockets.received.packets,
                udp_bytes_received: self.sockets.received.bytes,
                ..self.end().channel().traffic()
            },
            updates_applied: self.end().master().applied(),
            updates_dropped: self.end().update_drops(),
            haptic_loop: self.haptic_loop(),
        }
    }

    /// The report.
    pub(super) fn report(&self, options: &MasterOptions) -> MasterReport {
        let (end, master) = (self.end(), self.end().master());
        let version = env!("CARGO_PKG_VERSION");
        let mut report = MasterReport::new(version, "master", configuration(options));
        report.seed = Some(options.netem_seed);
        report.duration_s = self.haptic.elapsed.as_secs_f64().into();
        report.ending = Some(ending_name(self.why.ending()).to_owned());
        report.architecture = self.architecture(options.architecture);
        if let Some(completed) = self.haptic.operator.pushes_completed() {
            report.pushes = PushesReport::new(completed, &end.counts().breaks);
        }
        report.updates = self.updates();
        report.messages = messages(end, self.duration.as_secs_f64());
        report.wire = self.wire();
        report.force = self.force();
        if let Some(slave) = self.slave() {
            report.model = slave.model;
        }
        report.pose = PoseReport::from(&self.haptic.pose);
        report.passivity = PassivityReport {
            energy_injected_j: master.energy_injected_j().into(),
            observer_min_j: master.port().least_j().into(),
        };
        report.link = link_report(end);
        report.emulation.up = self.lateness.report();
        report.haptic_loop = self.haptic_loop();
        report.drops = Some(self.drops());
        report
    }

    fn haptic_loop(&self) -> LoopReport {
        let of = &self.haptic.timing;
        LoopReport::new(of.ticks, of.skipped, &of.cpu, &of.lateness)
    }

    fn architecture(&self, architecture: Architecture) -> ArchitectureReport {
        let tdpa = self.end().master().tdpa();
        let round_trip_s = tdpa.and_then(TdpaHand::round_trip_s);
        ArchitectureReport {
            round_trip_ms: round_trip_s.map(|s| s * 1e3).into(),
            ..ArchitectureReport::named(architecture)
        }
    }

    fn slave(&self) -> Option<&SlaveTotals> {
        self.farewell.as_ref()?.report.as_ref()
    }

    fn updates(&self) -> UpdatesReport {
        let mut report = UpdatesReport {
            applied: Some(self.end().master().applied().into()),
            dropped: Some(named(self.end().update_drops().by_name())),
            age_ms: (&self.end().counts().age).into(),
            ..UpdatesReport::default()
        };
        if let Some(slave) = self.slave() {
            let by_cause = Cause::ALL.iter().zip(slave.updates_by_cause);
            let by_cause = named(by_cause.map(|(cause, n)| (cause.name(), u64::from(n))));
            let sent: u64 = by_cause.values().sum();
            let duration_s = Duration::from_nanos(slave.duration_ns).as_secs_f64();
            report.sent = Some(sent);
            report.rate_hz = Number::rate(sent as f64, duration_s);
            report.by_cause = Some(by_cause);
            let all = u64::from(slave.traffic.sent.updates);
            report.repeated = Some(all.saturating_sub(sent));
        }
        report
    }

    fn wire(&self) -> UpDown<WireReport> {
        let header_bytes = match self.address {
            SocketAddr::V4(_) => 28,
            SocketAddr::V6(_) => 48,
        };
        let duration_s = self.duration.as_secs_f64();
        let report = |datagrams, bytes| WireReport::new(datagrams, bytes, header_bytes, duration_s);
        UpDown {
            up: report(
                self.sockets.outgoing.sent.packets,
                self.sockets.outgoing.sent.bytes,
            ),
            down: report(self.sockets.received.packets, self.sockets.received.bytes),
        }
    }

    fn force(&self) -> ForceReport {
        ForceReport {
            largest_n: self.end().counts().on_hand.largest_n().into(),
            largest_step_n: self.end().counts().on_hand.largest_step_n().into(),
            ..self.slave().map(|slave| slave.force).unwrap_or_default()
        }
    }

    fn drops(&self) -> Counts {
        let (end, network) = (self.end(), &self.counts);
        let (traffic, peer) = (end.channel().traffic(), end.channel().peer());
        let [off_grid, skipped, unsent] = end.samples_unsent();
        let queued = network.given;
        let unsent_datagrams = network.too_large + network.unsupported + network.disconnected;
        let own = [
            ("bad_readings", end.master().bad_readings()),
            ("datagrams_duplicate", u64::from(traffic.duplicates)),
            ("datagrams_malformed", u64::from(traffic.malformed)),
            (
                "datagrams_displaced",
                queued.saturating_sub(self.passed.sent),
            ),
            ("datagrams_too_old", u64::from(traffic.too_old)),
            (
                "datagrams_unread",
                self.passed.received.saturating_sub(self.counts.read),
            ),
            (
                "datagrams_ring_full",
                self.arrivals_dropped + self.haptic.departures_dropped,
            ),
            ("datagrams_unsealed", end.counts().unsendable),
            ("datagrams_unsent", unsent_datagrams),
            ("echoes_implausible", u64::from(peer.echoes_implausible())),
            ("forces_not_finite", end.master().limiter().rejected()),
            ("samples_off_grid", off_grid),
            ("samples_skipped", skipped),
            ("samples_unsent", unsent),
        ];
        let socket = &self.sockets.outgoing;
        let socket = socket.drops_since(&DirectionCounters::default());
        named(own.into_iter().chain(socket))
    }
}

fn configuration(options: &MasterOptions) -> MasterConfiguration {
    MasterConfiguration {
        slave: options.pairing.address.to_string(),
        transport: options.transport.name(),
        device: options.device,
        operator: options.operator.name().to_owned(),
        scripted: match &options.operator {
            OperatorChoice::Scripted(config) => Some(*config),
            OperatorChoice::Trace { .. } => None,
        },
        architecture: options.architecture,
        commands: options.commands,
        netem: options.netem.to_string(),
    }
}

/// An update that was seen before is a repeat, whether the slave or the network repeated it.
fn messages(end: &MasterEnd, duration_s: f64) -> UpDown<MessagesReport> {
    let traffic = end.channel().traffic();
    let repeats = u64::from(end.update_drops().duplicate);
    UpDown {
        up: MessagesReport::up(&traffic.sent, duration_s),
        down: MessagesReport::down(&traffic.received, repeats, duration_s),
    }
}

fn link_report(end: &MasterEnd) -> LinkReport {
    let peer = end.channel().peer();
    LinkReport {
        rtt_ms: DelayReport::of(peer.round_trip().histogram()),
        loss_up: peer.outgoing().share().into(),
        loss_down: peer.incoming().share().into(),
        ..LinkReport::default()
    }
}
