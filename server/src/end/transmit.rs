//! What the slave's end sends, and when: updates first, then the tool's state, scenes, repeats and heartbeats.

use std::time::Duration;

use mmt_shared::channel::peer::NumbersSpent;
use mmt_shared::model::tool::Scene;
use mmt_shared::model::update::Update;
use mmt_shared::time::Time;
use mmt_shared::wire::Message;

use super::SlaveEnd;
use crate::repeats::Repeating;

const SECOND: Duration = Duration::from_secs(1);

impl SlaveEnd {
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
        if let Some(update) = self.update.take() {
            return self.send_update(now, &update, out);
        }
        if let Some(tool) = self.tool.take() {
            return self.channel.encode(now, Message::Tool(tool), out);
        }
        if let Some(scene) = self.take_due_scene(now) {
            return self.channel.encode(now, Message::Scene(scene), out);
        }
        if let Some(update) = self.take_due_repeat(now) {
            let message = Message::Update((&update).into());
            let sent = self.channel.encode(now, message, out);
            if let Ok(Some(_)) = sent {
                self.counts.repeated.sent(update.cause);
            }
            return sent;
        }
        if self.channel.heartbeat_due().has_come(now) {
            return self.channel.encode(now, Message::Heartbeat, out);
        }
        Ok(None)
    }

    /// When something must go out if no tick gives a reason before: a scene, a repeat or a heartbeat.
    #[must_use]
    pub fn poll_timeout(&self) -> Time {
        let others = [self.repeat_due(), self.scene_due()];
        let heartbeat = self.channel.heartbeat_due();
        others.into_iter().flatten().fold(heartbeat, Time::min)
    }

    /// Sends a new update. Its repeats are due from now on, and those of the update before no more.
    fn send_update(
        &mut self,
        now: Time,
        update: &Update,
        out: &mut [u8],
    ) -> Result<Option<usize>, NumbersSpent> {
        self.repeating = Some(Repeating::new(now, *update));
        let sent = self
            .channel
            .encode(now, Message::Update(update.into()), out);
        if let Ok(Some(_)) = sent {
            self.counts.updates.sent(update.cause);
            self.newest_sent = self.newest_sent.max(update.sequence);
        } else {
            self.counts.updates_unsent += 1;
        }
        sent
    }

    /// When the next repeat is due: never while the path is congested, nor once the master has the update.
    pub(super) fn repeat_due(&self) -> Option<Time> {
        let repeating = self.repeating.as_ref()?;
        let wanted = repeating.update.sequence > self.newest_acknowledged;
        let due = repeating.due(&self.config.repeats)?;
        (wanted && self.channel.stretch() <= 1.0).then_some(due)
    }

    fn take_due_repeat(&mut self, now: Time) -> Option<Update> {
        self.repeat_due().filter(|due| due.has_come(now))?;
        let repeating = self.repeating.as_mut()?;
        let due = repeating.take_due(now, &self.config.repeats);
        due.then_some(repeating.update)
    }

    /// When the next scene is due, seldomer under congestion; never where nobody wants scenes.
    pub(super) fn scene_due(&self) -> Option<Time> {
        let hz = self.config.scene_hz;
        let period = SECOND.checked_div(hz.into())?;
        Some(self.scene_sent + period.mul_f64(self.channel.stretch()))
    }

    fn take_due_scene(&mut self, now: Time) -> Option<Scene> {
        self.scene_due().filter(|due| due.has_come(now))?;
        self.scene_sent = now;
        self.scene
    }
}
