//! The slave's end of the link: commands in, updates with their repeats and news of the tool out. Pure.

mod repeats;

pub use repeats::{REPEATS_MAX, Repeats, RepeatsError};

use std::time::Duration;

use mmt_shared::channel::datagram_channel::{LinkEnd, SealError};
use mmt_shared::channel::rate_control::StretchMax;
use mmt_shared::metrics::UpdateCounts;
use mmt_shared::model::sample::HipSample;
use mmt_shared::model::tool::{Scene, Tool};
use mmt_shared::model::update::Update;
use mmt_shared::time::Time;
use mmt_shared::wire::{Architecture, Command, Message, Side};

use repeats::Repeating;

const SECOND: Duration = Duration::from_secs(1);

/// How the slave's end of a session's link works.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlaveLinkConfig {
    /// When an update is said again.
    pub repeats: Repeats,
    /// By how much congestion may stretch what is said.
    pub stretch_max: StretchMax,
    /// How many samples of a command are news, as the master's hello says; those before them are repeats.
    pub samples_per_command: u8,
    /// Whose force the master's hand feels, as its hello says.
    pub architecture: Architecture,
    /// Scenes that the master wants to see, 1/s, as its hello says.
    pub scene_hz: u8,
}

/// The slave's end of the link.
#[derive(Clone, Debug)]
pub struct SlaveLink {
    end: LinkEnd,
    config: SlaveLinkConfig,
    newest_acknowledged: u32,
    samples: u64,
    repeating: Option<Repeating>,
    repeated: UpdateCounts,
    scene_sent: Time,
}

impl SlaveLink {
    /// A link from `now` on.
    #[must_use]
    pub fn new(now: Time, config: SlaveLinkConfig) -> Self {
        Self {
            end: LinkEnd::with_rate_control(Side::Slave, now, config.stretch_max),
            config,
            newest_acknowledged: 0,
            samples: 0,
            repeating: None,
            repeated: UpdateCounts::default(),
            scene_sent: now,
        }
    }

    /// The end itself: round trip, loss, counts.
    #[must_use]
    pub fn end(&self) -> &LinkEnd {
        &self.end
    }

    /// Whose force the master's hand feels, as its hello says.
    #[must_use]
    pub fn architecture(&self) -> Architecture {
        self.config.architecture
    }

    /// The newest update that the master has said it has.
    #[must_use]
    pub fn newest_acknowledged(&self) -> u32 {
        self.newest_acknowledged
    }

    /// HIP samples received, repeated ones included.
    #[must_use]
    pub fn samples_received(&self) -> u64 {
        self.samples
    }

    /// Repeats sent, by the cause of what they repeat.
    #[must_use]
    pub fn repeated(&self) -> &UpdateCounts {
        &self.repeated
    }

    /// Takes in a datagram that arrived at `now`; its samples are for the play-out buffer. It keeps its port only where
    /// the hello has spoken of one and no newer datagram has been there: an older one knows nothing that counts.
    pub fn handle(&mut self, now: Time, bytes: &[u8]) -> Option<Command> {
        let opened = self.end.open(now, bytes)?;
        let Message::Command(mut command) = opened.message else {
            return None;
        };
        let counts = opened.is_newest && self.config.architecture.feels_tool();
        command.port = command.port.filter(|_| counts);
        self.newest_acknowledged = self.newest_acknowledged.max(command.newest_update);
        self.samples += command.samples.len() as u64;
        Some(command)
    }

    /// A command's samples, oldest first, each with the newest update that the master had by then as far as the
    /// command tells: nothing (0) of a sample that is repeated from an earlier command.
    pub fn samples(&self, command: &Command) -> impl Iterator<Item = (HipSample, u32)> {
        let newest_update = command.newest_update;
        let news = usize::from(self.config.samples_per_command).max(1);
        let repeated = command.samples.len().saturating_sub(news);
        // SampleBlock is Copy: the samples outlive the command
        let samples = command.samples;
        (0..samples.len()).filter_map(move |n| {
            let sample = samples.as_slice().get(n)?;
            Some((*sample, if n < repeated { 0 } else { newest_update }))
        })
    }

    /// Writes an update to `out`; returns its length. Its repeats are due from now on, and those of the update
    /// before no more.
    ///
    /// # Errors
    /// When it cannot be sealed.
    pub fn send_update(
        &mut self,
        now: Time,
        update: &Update,
        out: &mut [u8],
    ) -> Result<usize, SealError> {
        self.repeating = Some(Repeating::new(now, *update));
        self.seal(now, update, out)
    }

    /// When the next repeat is due: never while the path is congested, nor once the master has the update.
    #[must_use]
    pub fn repeat_due(&self) -> Option<Time> {
        let repeating = self.repeating.as_ref()?;
        let wanted = repeating.update.sequence > self.newest_acknowledged;
        let due = repeating.due(&self.config.repeats)?;
        (wanted && self.end.stretch() <= 1.0).then_some(due)
    }

    /// Writes the newest update to `out` once more, if a repeat is due at `now`. Returns its length.
    ///
    /// # Errors
    /// When it cannot be sealed.
    pub fn repeat(&mut self, now: Time, out: &mut [u8]) -> Result<Option<usize>, SealError> {
        if self.repeat_due().is_none_or(|due| due > now) {
            return Ok(None);
        }
        let Some(repeating) = &mut self.repeating else {
            return Ok(None);
        };
        let update = repeating.update;
        if !repeating.take_due(now, &self.config.repeats) {
            return Ok(None);
        }
        let length = self.seal(now, &update, out)?;
        self.repeated.sent(update.cause);
        Ok(Some(length))
    }

    /// Writes the tool's state to `out`; returns its length.
    ///
    /// # Errors
    /// When it cannot be sealed.
    pub fn send_tool(
        &mut self,
        now: Time,
        tool: &Tool,
        out: &mut [u8],
    ) -> Result<usize, SealError> {
        self.end.seal(now, Message::Tool(*tool), out)
    }

    /// When the next scene is due, seldomer under congestion; never where nobody looks.
    #[must_use]
    pub fn scene_due(&self) -> Option<Time> {
        let hz = self.config.scene_hz;
        let period = SECOND.checked_div(hz.into())?;
        Some(self.scene_sent + period.mul_f64(self.end.stretch()))
    }

    /// Writes a scene to `out`; returns its length. None without one, which is then due a period later.
    ///
    /// # Errors
    /// When it cannot be sealed.
    pub fn send_scene(
        &mut self,
        now: Time,
        scene: Option<&Scene>,
        out: &mut [u8],
    ) -> Result<Option<usize>, SealError> {
        self.scene_sent = now;
        scene
            .map(|scene| self.end.seal(now, Message::Scene(*scene), out))
            .transpose()
    }

    fn seal(&mut self, now: Time, update: &Update, out: &mut [u8]) -> Result<usize, SealError> {
        self.end.seal(now, Message::Update(update.into()), out)
    }

    /// A heartbeat, if nothing has been sent for long enough.
    ///
    /// # Errors
    /// When no datagram number is left.
    pub fn heartbeat(&mut self, now: Time, out: &mut [u8]) -> Result<Option<usize>, SealError> {
        if now < self.end.heartbeat_due() {
            return Ok(None);
        }
        self.end.seal(now, Message::Heartbeat, out).map(Some)
    }
}

#[cfg(test)]
mod tests;
