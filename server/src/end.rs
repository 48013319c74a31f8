//! The slave's end of a session: datagrams in, the slave's ticks, datagrams out.
//!
//! Pure: it reads no clock and touches no socket, so that a live session and an experiment run the same code, and a
//! record of its inputs runs again to the same bits.

use std::time::Duration;

use mmt_shared::channel::datagram_channel::DatagramChannel;
use mmt_shared::channel::rate_control::StretchMax;
use mmt_shared::metrics::UpdateCounts;
use mmt_shared::model::architecture::Architecture;
use mmt_shared::model::tool::{Scene, Tool};
use mmt_shared::model::update::Update;
use mmt_shared::time::Time;
use mmt_shared::wire::{Command, Hello, Message, Side, ToolState};

use crate::plant::{PlantAnswer, PlantCommand};
use crate::repeats::{Repeating, Repeats};
use crate::slave::{Memory, Slave, SlaveConfig, SlaveError, SlaveTick, Substitutes};

mod half;
mod transmit;

/// Without a new sample for this long the tool is disengaged: it stands, and only a new session moves it. The hand was
/// released a second before.
pub const DISENGAGE: Duration = Duration::from_secs(2);

/// Without a new sample for this long the tool is on hold: it brakes from 30 ms on ([`crate::playout`]) and stands by now, and the
/// master receives that.
pub const HOLD: Duration = Duration::from_millis(100);

/// How the slave's end of a session works.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlaveEndConfig {
    /// When an update is repeated.
    pub repeats: Repeats,
    /// By how much congestion may stretch the times between messages.
    pub stretch_max: StretchMax,
    /// How many samples of a command are new, by the master's hello; those before them are repeats.
    pub samples_per_command: u8,
    /// What the master's hand feels, by its hello.
    pub architecture: Architecture,
    /// Scenes that the master asks for, 1/s, by its hello.
    pub scene_hz: u8,
}

/// What a tick of the slave's end is given besides its deadline; all that a record has to keep of it. By default nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SlaveGiven {
    /// Whether the slave's emergency stop is set, or the plant that is plugged in is silent. While either side's stop is set
    /// the tool stands where it is.
    pub stops: bool,
    /// What the plant that is plugged in measured, if it has since the tick before.
    pub plant: Option<PlantAnswer>,
}

/// What the slave's end counts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SlaveCounts {
    /// Updates sent by cause, repeats not included, and ticks with and without contact.
    pub updates: UpdateCounts,
    /// Repeats sent, by the cause of what they repeat.
    pub repeated: UpdateCounts,
    /// Updates that a newer one overtook before they could be sent.
    pub updates_superseded: u64,
    /// HIP samples received, repeated ones included.
    pub samples: u64,
    /// HIP samples that came after the tool was disengaged.
    pub samples_disengaged: u64,
    /// Commands that acknowledge an update that never left.
    pub acknowledgements_implausible: u64,
    /// Updates that could not be sent: they break a rule of the wire, or the datagram numbers are used up.
    pub updates_unsent: u64,
    /// Ports of the hand that came after a newer datagram.
    pub messages_overtaken: u64,
}

/// The slave of a session that a master opens with `hello`.
#[must_use]
pub fn session_config(config: &SlaveConfig, hello: &Hello) -> SlaveConfig {
    config.for_session(hello.samples_per_command, hello.architecture)
}

/// The slave's end.
pub struct SlaveEnd {
    slave: Slave,
    channel: DatagramChannel,
    config: SlaveEndConfig,
    newest_acknowledged: u32,
    disengaged: bool,
    /// Sequence of the newest update that left.
    newest_sent: u32,
    /// To be sent.
    update: Option<Update>,
    repeating: Option<Repeating>,
    /// To be sent, where the hand feels the tool.
    tool: Option<Tool>,
    /// As the newest tick saw it.
    scene: Option<Scene>,
    scene_sent: Time,
    counts: SlaveCounts,
}

impl SlaveEnd {
    /// An end from `now` on.
    #[must_use]
    pub fn new(now: Time, slave: Slave, config: SlaveEndConfig) -> Self {
        Self {
            slave,
            channel: DatagramChannel::with_rate_control(Side::Slave, now, config.stretch_max),
            config,
            newest_acknowledged: 0,
            disengaged: false,
            newest_sent: 0,
            update: None,
            repeating: None,
            tool: None,
            scene: None,
            scene_sent: now,
            counts: SlaveCounts::default(),
        }
    }

    /// The end of a session from `now` on that a master opens with `hello`. It goes on where an earlier session ended;
    /// if there was none the tool starts at the hello's HIP.
    ///
    /// # Errors
    /// When the configuration's numbers are not accepted for the master's device.
    pub fn of_session(
        now: Time,
        config: &SlaveConfig,
        hello: &Hello,
        earlier: Option<&Memory>,
    ) -> Result<Self, SlaveError> {
        let config = session_config(config, hello);
        let slave = if let Some(memory) = earlier {
            Slave::remembering(&config, hello.coupling, memory)?
        } else {
            let mut slave = Slave::try_new(&config, hello.coupling)?;
            slave.start_at(hello.hip);
            slave
        };
        let config = SlaveEndConfig {
            repeats: config.repeats_ms,
            stretch_max: config.stretch_max,
            samples_per_command: hello.samples_per_command,
            architecture: hello.architecture,
            scene_hz: hello.scene_hz,
        };
        Ok(Self::new(now, slave, config))
    }

    /// The core.
    #[must_use]
    pub fn slave(&self) -> &Slave {
        &self.slave
    }

    /// The core, to be changed in mid-run: scenarios do, sessions never.
    pub fn slave_mut(&mut self) -> &mut Slave {
        &mut self.slave
    }

    /// The datagram channel: round trip, loss, counts.
    #[must_use]
    pub fn channel(&self) -> &DatagramChannel {
        &self.channel
    }

    /// What it counted.
    #[must_use]
    pub fn counts(&self) -> &SlaveCounts {
        &self.counts
    }

    /// What the master's hand feels, by its hello.
    #[must_use]
    pub fn architecture(&self) -> Architecture {
        self.config.architecture
    }

    /// Whose emergency stop is set; none if neither's.
    #[must_use]
    pub fn stopped_by(&self) -> Option<Side> {
        self.channel.stopped_by()
    }

    /// Whether the tool stands for good, because no sample came for [`DISENGAGE`].
    #[must_use]
    pub fn is_disengaged(&self) -> bool {
        self.disengaged
    }

    /// Takes in a datagram that arrived at `at`. The hand's port counts only where the hello names one and no
    /// newer datagram has been there: an older one knows nothing that counts.
    pub fn handle_datagram(&mut self, at: Time, bytes: &[u8]) {
        let Some(received) = self.channel.handle(at, bytes) else {
            return;
        };
        let Message::Command(command) = received.message else {
            return;
        };
        let newest_update = self.acknowledged(&command);
        self.newest_acknowledged = self.newest_acknowledged.max(newest_update);
        self.handle_samples(at, &command, newest_update);
        self.slave.stretch(self.channel.stretch());
        let feels_tool = self.config.architecture.feels_tool();
        match command.port.filter(|_| feels_tool) {
            Some(port) if received.is_newest => self.slave.handle_hand_port(&port),
            Some(_) => self.counts.messages_overtaken += 1,
            None => {}
        }
    }

    /// The newest update that a command acknowledges; none (0) if none of that number has left.
    fn acknowledged(&mut self, command: &Command) -> u32 {
        if command.newest_update <= self.newest_sent {
            return command.newest_update;
        }
        self.counts.acknowledgements_implausible += 1;
        0
    }

    /// A command's samples, oldest first, each with the newest update that the master had by then as far as the
    /// command shows: none (0) of a sample that is repeated from an earlier command.
    fn handle_samples(&mut self, at: Time, command: &Command, newest_update: u32) {
        if self.disengaged {
            self.counts.samples_disengaged += command.samples.len() as u64;
            return;
        }
        let new = usize::from(self.config.samples_per_command).max(1);
        let repeated = command.samples.len().saturating_sub(new);
        for (n, sample) in command.samples.as_slice().iter().enumerate() {
            let newest_update = if n < repeated { 0 } else { newest_update };
            self.slave.handle_sample(at, sample, newest_update);
            self.counts.samples += 1;
        }
    }

    /// Where that plant has to move the tool after the newest tick; none in the simulated world.
    #[must_use]
    pub fn plant_command(&self) -> Option<PlantCommand> {
        self.slave.plant_command().map(|command| PlantCommand {
            begins: self.slave.playout().silence().is_none(),
            held: self.stopped_by().is_some(),
            ..command
        })
    }

    /// One sample period; `now` is the tick's deadline. None before the first HIP sample is due.
    pub fn tick(&mut self, now: Time, given: &SlaveGiven) -> Option<SlaveTick> {
        self.tick_with(now, given, Substitutes::default())
    }

    /// The same with stages of somebody else's.
    pub fn tick_with(
        &mut self,
        now: Time,
        given: &SlaveGiven,
        others: Substitutes<'_>,
    ) -> Option<SlaveTick> {
        if let Some(answer) = &given.plant {
            self.slave.handle_plant(now, answer);
        }
        self.channel.stop(given.stops);
        let silence = self.slave.playout().silence();
        self.disengaged |= silence.is_some_and(|silence| silence >= DISENGAGE);
        let holds = silence.is_some_and(|silence| silence >= HOLD);
        let stands = self.stopped_by().is_some() || self.disengaged;
        self.slave.hold_tool(stands);
        if let Some(path) = self.channel.peer().round_trip().longest(now) {
            self.slave.set_round_trip(path);
        }
        let tick = self.slave.tick_with(now, others);
        self.show_tool(holds);
        let tick = tick?;
        self.counts.updates.tick(tick.in_contact);
        if let Some(update) = tick.update {
            let overtaken = self.update.replace(update).is_some();
            self.counts.updates_superseded += u64::from(overtaken);
        }
        self.tool = self.slave.tool_state(&tick);
        let looks = self.config.scene_hz > 0;
        self.scene = looks.then(|| self.slave.scene(&tick));
        Some(tick)
    }

    /// The datagrams from now on show what the tool does.
    fn show_tool(&mut self, holds: bool) {
        let state = if self.disengaged {
            ToolState::Disengaged
        } else if holds {
            ToolState::Hold
        } else {
            ToolState::Nominal
        };
        let energy_holds = self.slave.tool_energy().holds();
        self.channel.show_tool(state, energy_holds);
    }
}

#[cfg(test)]
mod tests;
