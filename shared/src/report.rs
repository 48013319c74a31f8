//! The report of a run: one document, as JSON for machines and as a table for people.
//!
//! Every key is always there. One without meaning in a run is null, never 0 and never NaN. "Up" is
//! master to slave, "down" is slave to master. The keys in words: `docs/report.md`.
//!
//! Each end of a session counts in its own half, [`MasterHalf`] and [`SlaveHalf`]: the half goes with the farewell, and a
//! report is printed from the halves that are known. No number is counted in both.

mod brief;
mod master;
mod number;
mod session;
mod slave;
mod table;

use serde::Serialize;

use crate::metrics::ForceSummary;
use crate::wire::{Ending, Side};

pub use brief::Brief;
pub use master::{
    HandForce, MasterHalf, PassivityReport, PoseReport, PushesReport, ReceivedUpdates,
};
pub use number::{Counts, Number, named};
pub use session::{
    ArchitectureReport, DelayReport, EmulationReport, LateReport, LoopReport, MessagesReport,
    QuantilesReport, SessionStats, WireReport,
};
pub use slave::{EstimateReport, ModelReport, SentUpdates, SlaveHalf, ToolReport, TrueForce};

/// What happened in a run. `C` is the configuration that it ran with.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RunReport<C> {
    /// Version of the program.
    pub version: &'static str,
    /// The command that made the run: `demo`, `master`, `slave`, `replay`.
    pub command: &'static str,
    /// Seed of everything that was drawn.
    pub seed: Option<u64>,
    /// From the first to the last tick, s.
    pub duration_s: Number,
    /// How it ended: `finished`, `interrupted` or `failed`.
    pub ending: Option<&'static str>,
    /// Whose force the hand felt.
    pub architecture: ArchitectureReport,
    /// The operator's work.
    pub pushes: PushesReport,
    /// Updates by the slave's trigger.
    pub updates: UpdatesReport,
    /// Application messages by kind.
    pub messages: UpDown<MessagesReport>,
    /// UDP datagrams.
    pub wire: UpDown<WireReport>,
    /// How near the model's force was to the measured one.
    pub force: ForceReport,
    /// What the estimator found.
    pub model: ModelReport,
    /// How near the model's pose was to the true one.
    pub pose: PoseReport,
    /// The slave's tool.
    pub tool: ToolReport,
    /// Energy at the hand.
    pub passivity: PassivityReport,
    /// The path between the two sides.
    pub link: LinkReport,
    /// How well this run's own emulation of the network kept its times.
    pub emulation: UpDown<EmulationReport>,
    /// The master's 1 kHz loop.
    pub haptic_loop: LoopReport,
    /// The slave's 1 kHz loop.
    pub slave_loop: LoopReport,
    /// Whatever else was dropped or refused, by name.
    pub drops: Option<Counts>,
    /// The whole configuration of the run.
    pub configuration: C,
}

/// A session as one end reports it: its own half, and the other's if that end's farewell came.
#[derive(Clone, Debug, PartialEq)]
pub struct SessionReport<C, Own, Other> {
    /// Seed of everything that this end drew.
    pub seed: u64,
    /// From the first to the last tick, s.
    pub duration_s: f64,
    /// How it ended.
    pub ending: Ending,
    /// What this end counted.
    pub own: Own,
    /// What the other end counted.
    pub other: Option<Other>,
    /// The whole configuration of this end.
    pub configuration: C,
}

/// A session as the master reports it.
pub type MasterSession<C> = SessionReport<C, MasterHalf, SlaveHalf>;
/// A session as the slave reports it.
pub type SlaveSession<C> = SessionReport<C, SlaveHalf, MasterHalf>;

/// The configurations of both ends.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Both<M, S> {
    /// The master's.
    pub master: M,
    /// The slave's; none if it had no session.
    pub slave: Option<S>,
}

impl<C> RunReport<C> {
    /// A report in which everything else is still absent.
    pub fn new(command: &'static str, configuration: C) -> Self {
        Self::of_halves(
            command,
            configuration,
            MasterHalf::default(),
            SlaveHalf::default(),
        )
    }

    /// What each half alone knows; what the halves have in common is still absent.
    fn of_halves(
        command: &'static str,
        configuration: C,
        master: MasterHalf,
        slave: SlaveHalf,
    ) -> Self {
        let (up, down) = (master.session, slave.session);
        Self {
            version: env!("CARGO_PKG_VERSION"),
            command,
            seed: None,
            duration_s: Number::ABSENT,
            ending: None,
            architecture: ArchitectureReport {
                name: up.architecture.name.or(down.architecture.name),
                ..up.architecture
            },
            pushes: master.pushes,
            updates: UpdatesReport {
                sent: slave.updates,
                received: master.updates,
            },
            messages: UpDown::default(),
            wire: UpDown::default(),
            force: ForceReport {
                errors: slave.force,
                truth: slave.true_force,
                hand: master.force,
            },
            model: slave.model,
            pose: master.pose,
            tool: slave.tool,
            passivity: master.passivity,
            link: LinkReport {
                playout_delay_ms: slave.playout_delay_ms,
                ..LinkReport::default()
            },
            emulation: UpDown {
                up: up.emulation,
                down: down.emulation,
            },
            haptic_loop: up.timing,
            slave_loop: down.timing,
            drops: None,
            configuration,
        }
    }

    /// How the session went, from its first to its last tick.
    fn ended(self, seed: u64, duration_s: f64, ending: Ending) -> Self {
        Self {
            seed: Some(seed),
            duration_s: duration_s.into(),
            ending: Some(ending.name()),
            ..self
        }
    }

    /// The path, as the end of this side saw it; of the other what is known.
    fn seen_by(self, side: Side, own: SessionStats, other: Option<&SessionStats>) -> Self {
        let (of_sent, of_received) = own.losses(other);
        let loss = UpDown::of_sender(side, of_sent, of_received);
        let unsent_of_other = other.and_then(|other| other.unsent);
        let unsent = UpDown::of_sender(side, own.unsent, unsent_of_other);
        Self {
            messages: UpDown::of_sender(side, own.sent, own.received),
            wire: UpDown::of_sender(side, own.wire_sent, own.wire_received),
            link: LinkReport {
                rtt_ms: own.rtt_ms,
                loss_up: loss.up,
                loss_down: loss.down,
                unsent_up: unsent.up,
                unsent_down: unsent.down,
                ..self.link
            },
            drops: Some(own.drops),
            ..self
        }
    }
}

impl<C> From<MasterSession<C>> for RunReport<C> {
    fn from(session: MasterSession<C>) -> Self {
        let own = session.own.session.clone();
        let other = session.other.as_ref().map(|slave| slave.session.clone());
        let slave = session.other.unwrap_or_default();
        Self::of_halves("master", session.configuration, session.own, slave)
            .ended(session.seed, session.duration_s, session.ending)
            .seen_by(Side::Master, own, other.as_ref())
    }
}

impl<C> From<SlaveSession<C>> for RunReport<C> {
    fn from(session: SlaveSession<C>) -> Self {
        let own = session.own.session.clone();
        let other = session.other.as_ref().map(|master| master.session.clone());
        let master = session.other.unwrap_or_default();
        Self::of_halves("slave", session.configuration, master, session.own)
            .ended(session.seed, session.duration_s, session.ending)
            .seen_by(Side::Slave, own, other.as_ref())
    }
}

impl<M, S> RunReport<Both<M, S>> {
    /// The report of a demo, both ends of which live in one process. Each direction is counted where it is sent; what
    /// both ends measured is the master's.
    pub fn of_both(master: MasterSession<M>, slave: Option<SlaveSession<S>>) -> Self {
        let answered = master.other.is_some() || slave.as_ref().is_some_and(|s| s.other.is_some());
        let (half, slave) = slave.map(|slave| (slave.own, slave.configuration)).unzip();
        let half = half.or(master.other);
        let (up, down) = (
            master.own.session.clone(),
            half.as_ref().map(|half| half.session.clone()),
        );
        let configuration = Both {
            master: master.configuration,
            slave,
        };
        let slave = half.unwrap_or_default();
        let report = Self::of_halves("demo", configuration, master.own, slave).ended(
            master.seed,
            master.duration_s,
            master.ending,
        );
        let of_side = |side, counts: Counts| {
            let names = counts.into_iter();
            names.map(move |(name, n)| (format!("{side}_{name}"), n))
        };
        let drops = of_side("master", up.drops.clone());
        let mut report = report.seen_by(Side::Master, up, down.as_ref().filter(|_| answered));
        let mut drops: Counts = drops.collect();
        if let Some(down) = down {
            report.link.unsent_down = down.unsent;
            drops.extend(of_side("slave", down.drops));
            (report.messages.down, report.wire.down) = (down.sent, down.wire_sent);
        }
        report.drops = Some(drops);
        report
    }
}

/// One of something per direction.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct UpDown<T> {
    /// Master to slave.
    pub up: T,
    /// Slave to master.
    pub down: T,
}

impl<T> UpDown<T> {
    /// Of what this side sends, and of what the other sends.
    fn of_sender(side: Side, sent: T, received: T) -> Self {
        let (up, down) = match side {
            Side::Master => (sent, received),
            Side::Slave => (received, sent),
        };
        Self { up, down }
    }
}

/// Updates: what the trigger sent and what became of it.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct UpdatesReport {
    /// The slave's part.
    #[serde(flatten)]
    pub sent: SentUpdates,
    /// The master's part.
    #[serde(flatten)]
    pub received: ReceivedUpdates,
}

/// Forces: how near the model's is to the measured and to the true one, and what the hand felt.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ForceReport {
    /// The slave's part.
    #[serde(flatten)]
    pub errors: ForceSummary,
    /// The slave's part, where the object is simulated.
    #[serde(flatten)]
    pub truth: TrueForce,
    /// The master's part.
    #[serde(flatten)]
    pub hand: HandForce,
}

/// The path between the two sides, as the application saw it.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct LinkReport {
    /// Round-trip time.
    pub rtt_ms: DelayReport,
    /// Share of the master's datagrams that the path lost, 0 to 1; absent if the session ended without a farewell.
    pub loss_up: Number,
    /// Share of the slave's datagrams that the path lost, 0 to 1; as above.
    pub loss_down: Number,
    /// Datagrams that the master itself overtook or could not send: no loss of the path.
    pub unsent_up: Option<u64>,
    /// Datagrams that the slave itself overtook or could not send.
    pub unsent_down: Option<u64>,
    /// Delay of the slave's play-out, over its ticks.
    pub playout_delay_ms: DelayReport,
}

#[cfg(test)]
mod tests;
