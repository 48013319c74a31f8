//! The master's end of a session: datagrams and device readings in, forces and datagrams out.
//!
//! Pure: it reads no clock and touches no socket, so that a live session and an experiment run the same code, and a
//! record of its inputs runs again to the same bits. An update is accepted before it is acknowledged.

use mmt_shared::channel::datagram_channel::DatagramChannel;
use mmt_shared::channel::peer::{Freshness, NumbersSpent, SequenceWindow};
use mmt_shared::metrics::{AgeOfInformation, ContactBreaks, ForcePeak};
use mmt_shared::model::architecture::Architecture;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::model::tool::{HandPort, Scene};
use mmt_shared::model::update::{Cause, Update};
use mmt_shared::report::{
    ArchitectureReport, MasterHalf, PassivityReport, ReceivedUpdates, SessionStats, named,
};
use mmt_shared::stats::session::UpdateDrops;
use mmt_shared::time::{TICK, Time};
use mmt_shared::wire::{Command, Message, RawState, Side, ToolState};
use serde::Serialize;

use crate::commands::{CommandConfig, CommandPacker};
use crate::failsafe::{ANSWER_MAX, LinkState};
use crate::master::{Master, MasterTick};
use crate::operator::scripted::View;

/// What an applied update found wrong in the local model, for viewers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Change {
    /// Number of the update.
    pub sequence: u32,
    /// Why it was sent.
    pub cause: Cause,
    /// m (kg), b (N s/m), c (N): the update's less the ones in use.
    pub params: [f64; 3],
    /// From the model's place at the moment that the update answers to the update's, m, world.
    pub shift: Vec2,
    /// The same for the angle, rad.
    pub turn: f64,
}

/// What the master's end counts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MasterCounts {
    /// Age of the update that the model rests on.
    pub age: AgeOfInformation,
    /// Breaks of contact.
    pub breaks: ContactBreaks,
    /// Force on the hand.
    pub on_hand: ForcePeak,
    /// Number of the newest update that reached the model, 0 before the first.
    pub newest_applied: u32,
    /// Updates whose numbers were not accepted.
    pub updates_rejected: u64,
    /// Updates that came while the link was stale.
    pub updates_link_stale: u64,
    /// Updates that answer a sample of too long ago.
    pub updates_answer_too_old: u64,
    /// Updates that a newer one overtook before a tick could apply them.
    pub updates_superseded: u64,
    /// Scenes and tool messages that came after a newer datagram.
    pub messages_overtaken: u64,
}

/// What a tick of the master's end is given besides its deadline; all that a record has to keep of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MasterGiven {
    /// The device's HIP, m, world.
    pub reading: Vec2,
    /// Whether a hand holds the device.
    pub engaged: bool,
    /// Whether the hand is to be released from this tick on.
    pub releases: bool,
    /// Whether the master's emergency stop is set. While either side's is there is no force on the hand; afterwards it is
    /// engaged anew.
    pub stops: bool,
}

impl MasterGiven {
    /// A hand holds the device at `reading` (m, world), and nothing else happens.
    #[must_use]
    pub fn held_at(reading: Vec2) -> Self {
        Self {
            reading,
            engaged: true,
            releases: false,
            stops: false,
        }
    }
}

/// The master's end.
#[derive(Clone, Debug)]
pub struct MasterEnd {
    master: Master,
    channel: DatagramChannel,
    window: SequenceWindow,
    commands: CommandPacker,
    /// Goes with the next command.
    port: Option<HandPort>,
    /// Accepted, for the next tick.
    update: Option<Update>,
    /// Stamp of the HIP sample that the newest applied update answers.
    answers: Option<Time>,
    scene: Option<Scene>,
    change: Option<Change>,
    counts: MasterCounts,
}

impl MasterEnd {
    /// An end from `now` on.
    pub fn new(now: Time, master: Master, config: CommandConfig) -> Self {
        Self {
            master,
            channel: DatagramChannel::with_rate_control(Side::Master, now, config.stretch_max),
            window: SequenceWindow::default(),
            commands: CommandPacker::new(config),
            port: None,
            update: None,
            answers: None,
            scene: None,
            change: None,
            counts: MasterCounts::default(),
        }
    }

    /// The core.
    pub fn master(&self) -> &Master {
        &self.master
    }

    /// The datagram channel: round trip, loss, counts.
    pub fn channel(&self) -> &DatagramChannel {
        &self.channel
    }

    /// What it counted.
    pub fn counts(&self) -> &MasterCounts {
        &self.counts
    }

    /// Updates that arrived and were not applied, by cause.
    pub fn update_drops(&self) -> UpdateDrops {
        UpdateDrops {
            duplicate: self.window.duplicate(),
            stale: self.window.stale(),
            implausible: self.window.implausible(),
            rejected: self.counts.updates_rejected,
            superseded: self.counts.updates_superseded,
            link_stale: self.counts.updates_link_stale,
            answer_too_old: self.counts.updates_answer_too_old,
            hand_released: self.master.updates_after_release(),
            unapplied: self.update.is_some().into(),
        }
    }

    /// What it counted and measured in the `duration_s` (s) since it began.
    pub fn half(&self, duration_s: f64) -> MasterHalf {
        let (master, counts, drops) = (&self.master, &self.counts, self.update_drops());
        // an update that was received before is a repeat, whether the slave or the network repeated it
        let mut session =
            SessionStats::new(Side::Master, &self.channel, drops.duplicate, duration_s);
        session.architecture = match master.tdpa() {
            Some(hand) => ArchitectureReport::new(Architecture::Tdpa, hand.round_trip_s()),
            None => ArchitectureReport::new(Architecture::Mmt, None),
        };
        session.add_drops(self.commands.drops());
        session.add_drops([
            ("bad_readings", master.bad_readings()),
            ("messages_overtaken", counts.messages_overtaken),
            ("forces_not_finite", master.limiter().rejected()),
            ("model_not_finite", master.model().not_finite()),
        ]);
        MasterHalf {
            session,
            updates: ReceivedUpdates {
                applied: Some(master.applied().iter().sum()),
                dropped: Some(named(drops.by_name())),
                age_ms: (&counts.age).into(),
            },
            force: (&counts.on_hand).into(),
            passivity: PassivityReport {
                energy_injected_j: master.energy_injected_j().into(),
                observer_min_j: master.port().least_j().into(),
                hand_work_j: master.port().energy_j().into(),
            },
            ..MasterHalf::default()
        }
    }

    /// The newest scene; none where nobody asked for scenes.
    pub fn scene(&self) -> Option<&Scene> {
        self.scene.as_ref()
    }

    /// What the newest applied update found wrong in the model; none before the first.
    pub fn change(&self) -> Option<&Change> {
        self.change.as_ref()
    }

    /// Whose emergency stop is set; none if neither's.
    pub fn stopped_by(&self) -> Option<Side> {
        self.channel.stopped_by()
    }

    /// What the slave's tool does, by its newest datagram: whether it follows, and whether the limit of its energy holds it.
    pub fn slave_tool(&self) -> (ToolState, bool) {
        let other = self.channel.other();
        (other.tool, other.energy_holds)
    }

    /// Takes in a datagram that arrived at `at`.
    pub fn handle_datagram(&mut self, at: Time, bytes: &[u8]) {
        let Some(received) = self.channel.handle(at, bytes) else {
            return;
        };
        match received.message {
            Message::Update(update) => self.handle_update(at, &update),
            Message::Scene(scene) if received.is_newest => self.scene = Some(scene),
            Message::Tool(tool) if received.is_newest => self.master.handle_tool_state(at, &tool),
            Message::Scene(_) | Message::Tool(_) => self.counts.messages_overtaken += 1,
            Message::Command(_) | Message::Heartbeat => {}
        }
    }

    /// What the slave finds while the HIP does not reach it is about a tool that stands: it is neither applied nor
    /// acknowledged.
    fn handle_update(&mut self, at: Time, update: &Update<RawState>) {
        if self.window.judge(update.sequence) != Freshness::Fresh {
            return;
        }
        let stale = LinkState::of_silence(self.channel.silence(at)) >= LinkState::Stale;
        if stale {
            self.counts.updates_link_stale += 1;
            return;
        }
        if self.is_too_old(at, update.answers) {
            self.counts.updates_answer_too_old += 1;
            return;
        }
        let coupling = &self.master.model().settings().coupling;
        match update.accept(coupling) {
            Ok(update) => {
                // only what was accepted is acknowledged by the next command
                self.window.accept(update.sequence);
                let overtaken = self.update.replace(update).is_some();
                self.counts.updates_superseded += u64::from(overtaken);
            }
            Err(_) => self.counts.updates_rejected += 1,
        }
    }

    /// Whether an update that arrives at `at` answers a sample of longer ago than it may. Counted in ticks: where this process
    /// stood still the hand has not moved.
    fn is_too_old(&self, at: Time, answers: Time) -> bool {
        let history = self.master.model().history();
        let ticks = history.len() - history.first_after(answers);
        let path = self.channel.peer().round_trip().longest(at);
        path.is_some_and(|path| TICK * ticks as u32 > path + ANSWER_MAX)
    }

    /// Applies the newest accepted update, as the next tick would; returns what the operator sees of the model then. For a
    /// hand that looks before it moves.
    pub fn update_model(&mut self) -> View {
        if let Some(update) = self.update.take() {
            let change = self.change_by(&update);
            if !self.master.apply(&update) {
                return self.master.view();
            }
            self.change = Some(change);
            self.answers = Some(update.answers);
            self.counts.newest_applied = update.sequence;
        }
        self.master.view()
    }

    /// What this update finds wrong in the model, before it is applied.
    fn change_by(&self, update: &Update) -> Change {
        let model = self.master.model();
        let (old, new) = (model.state().params, update.state.params());
        let then = model.history().at(update.answers);
        let pose = then.map_or(model.state().pose, |then| then.motion.pose);
        Change {
            sequence: update.sequence,
            cause: update.cause,
            params: [new.m() - old.m(), new.b() - old.b(), new.c() - old.c()],
            shift: update.state.pose().position - pose.position,
            turn: update.state.pose().angle - pose.angle,
        }
    }

    /// One sample period. `now` is the tick's deadline, the stamp of its sample.
    pub fn tick(&mut self, now: Time, given: &MasterGiven) -> MasterTick {
        self.update_model();
        if given.releases {
            self.master.release();
        }
        self.channel.stop(given.stops);
        let stopped = self.stopped_by().is_some();
        self.master.hold(given.engaged && !stopped);
        if let Some(answers) = self.answers {
            self.counts.age.push(now, answers);
        }
        let silence = self.channel.silence(now);
        self.master.stop(stopped);
        let tick = self.master.tick(now, given.reading, silence);
        self.counts.on_hand.push(tick.hand_force);
        self.counts.breaks.push(self.master.view().in_contact);
        self.commands.push(tick.sample, self.channel.stretch());
        self.port = tick.port;
        tick
    }

    /// Writes the next datagram that is to be sent at `now` to `out` and returns its length; none if there is nothing
    /// to send. To be called until there is none.
    ///
    /// # Errors
    /// The session has used up its datagram numbers.
    pub fn poll_transmit(
        &mut self,
        now: Time,
        out: &mut [u8],
    ) -> Result<Option<usize>, NumbersSpent> {
        if let Some(samples) = self.commands.take_full(self.channel.stretch()) {
            let command = Command {
                newest_update: self.window.newest(),
                samples,
                port: self.port,
            };
            return self.channel.encode(now, Message::Command(command), out);
        }
        if self.poll_timeout().has_come(now) {
            return self.channel.encode(now, Message::Heartbeat, out);
        }
        Ok(None)
    }

    /// When a heartbeat must go out if nothing else does before.
    pub fn poll_timeout(&self) -> Time {
        self.channel.heartbeat_due()
    }
}

#[cfg(test)]
mod tests;
