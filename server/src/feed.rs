//! What an observer is sent: the newest updates, scenes, and whether an emergency stop is set.
//!
//! Pure: it reads no clock and touches no socket. A feed takes nothing from its observer but heartbeats and echoes: a command
//! is counted and dropped, so that no observer can move anything.

use std::time::Duration;

use mmt_shared::channel::datagram_channel::DatagramChannel;
use mmt_shared::channel::peer::NumbersSpent;
use mmt_shared::metrics::UpdateCounts;
use mmt_shared::model::tool::Scene;
use mmt_shared::model::update::Update;
use mmt_shared::report::{Number, SentUpdates, SessionStats, SlaveHalf};
use mmt_shared::time::Time;
use mmt_shared::wire::{Message, Side};

/// Updates that an observer view holds: what a slave that sends every sample makes in half of the time between two views.
const RECENT_MAX: usize = 8;
/// The newest update is sent again after this: no observer acknowledges one, and on a silent path the loss of the last update
/// would stay.
const REPEAT: Duration = Duration::from_secs(1);
const SECOND: Duration = Duration::from_secs(1);

/// The newest updates of a session.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RecentUpdates([Option<Update>; RECENT_MAX]);

impl RecentUpdates {
    /// Takes in the next update; the oldest one goes.
    pub fn push(&mut self, update: Update) {
        let slot = update.sequence as usize % RECENT_MAX;
        if let Some(slot) = self.0.get_mut(slot) {
            *slot = Some(update);
        }
    }

    /// The first update after this sequence that is still there.
    #[must_use]
    pub fn after(&self, sequence: u32) -> Option<&Update> {
        let newer = self.0.iter().flatten();
        let newer = newer.filter(|update| update.sequence > sequence);
        newer.min_by_key(|update| update.sequence)
    }

    /// The newest update; none before the first.
    #[must_use]
    pub fn newest(&self) -> Option<&Update> {
        self.0.iter().flatten().max_by_key(|update| update.sequence)
    }
}

/// What there is to be seen of a slave at a moment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ObserverView {
    /// Number of the operator's session; 0 before the first.
    pub session: u64,
    /// What the operator's master was sent.
    pub updates: RecentUpdates,
    /// The remote scene; none while nobody operates.
    pub scene: Option<Scene>,
    /// Whether an emergency stop is set, the slave's or the operator's.
    pub stopped: bool,
}

/// What one observer is sent.
#[derive(Clone, Debug)]
pub struct Feed {
    channel: DatagramChannel,
    scene_hz: u8,
    view: ObserverView,
    /// Sequence of the newest update that was taken of this session.
    taken: u32,
    /// The newest update as it was sent: with a sequence of this feed, which goes on across sessions.
    newest: Option<Update>,
    update_sent: Time,
    scene: Option<Scene>,
    scene_sent: Time,
    sent: UpdateCounts,
    repeated: UpdateCounts,
    commands_refused: u64,
}

impl Feed {
    /// A feed from `now` on, with at most `scene_hz` scenes a second (1/s). It begins with the newest update of the view.
    #[must_use]
    pub fn new(now: Time, scene_hz: u8, view: &ObserverView) -> Self {
        let newest = view.updates.newest();
        Self {
            channel: DatagramChannel::new(Side::Slave, now),
            scene_hz,
            view: *view,
            taken: newest.map_or(0, |update| update.sequence.saturating_sub(1)),
            newest: None,
            update_sent: now,
            scene: None,
            scene_sent: now,
            sent: UpdateCounts::default(),
            repeated: UpdateCounts::default(),
            commands_refused: 0,
        }
    }

    /// Takes in what there is to be seen now.
    pub fn show(&mut self, view: &ObserverView) {
        if view.session != self.view.session {
            self.taken = 0;
        }
        self.view = *view;
    }

    /// Takes in a datagram that arrived at `at`.
    pub fn handle_datagram(&mut self, at: Time, bytes: &[u8]) {
        let received = self.channel.handle(at, bytes);
        if let Some(Message::Command(_)) = received.map(|received| received.message) {
            self.commands_refused += 1;
        }
    }

    /// Commands that the observer sent.
    #[must_use]
    pub fn commands_refused(&self) -> u64 {
        self.commands_refused
    }

    /// Datagrams that were made for the observer.
    #[must_use]
    pub fn datagrams_made(&self) -> u64 {
        self.channel.counts().sent.total()
    }

    /// When something last came from the observer, or the beginning.
    #[must_use]
    pub fn last_arrival(&self) -> Time {
        self.channel.last_arrival()
    }

    /// Writes the next datagram that is to be sent at `now` to `out` and returns its length; none if there is nothing
    /// to send. To be called until there is none.
    ///
    /// # Errors
    /// The observer has used up its datagram numbers.
    pub fn poll_transmit(
        &mut self,
        now: Time,
        out: &mut [u8],
    ) -> Result<Option<usize>, NumbersSpent> {
        self.channel.stop(self.view.stopped);
        if let Some(update) = self.take_update() {
            return self.send(now, update, out);
        }
        if let Some(scene) = self.take_due_scene(now) {
            return self.channel.encode(now, Message::Scene(scene), out);
        }
        if let Some(update) = self.due_repeat(now) {
            self.repeated.sent(update.cause);
            return self.send(now, update, out);
        }
        if self.channel.heartbeat_due().has_come(now) {
            return self.channel.encode(now, Message::Heartbeat, out);
        }
        Ok(None)
    }

    /// When something must go out if nothing new is to be seen before: a scene, a repeat or a heartbeat.
    #[must_use]
    pub fn poll_timeout(&self) -> Time {
        let others = [self.repeat_due(), self.scene_due()];
        let heartbeat = self.channel.heartbeat_due();
        others.into_iter().flatten().fold(heartbeat, Time::min)
    }

    /// The next update that the observer has not been sent, with a sequence of this feed.
    fn take_update(&mut self) -> Option<Update> {
        let update = self.view.updates.after(self.taken)?;
        self.taken = update.sequence;
        self.sent.sent(update.cause);
        let sequence = self.newest.map_or(0, |newest| newest.sequence) + 1;
        let update = Update {
            sequence,
            ..*update
        };
        self.newest = Some(update);
        Some(update)
    }

    fn send(
        &mut self,
        now: Time,
        update: Update,
        out: &mut [u8],
    ) -> Result<Option<usize>, NumbersSpent> {
        self.update_sent = now;
        self.channel
            .encode(now, Message::Update((&update).into()), out)
    }

    fn due_repeat(&self, now: Time) -> Option<Update> {
        self.repeat_due().filter(|due| due.has_come(now))?;
        self.newest
    }

    fn repeat_due(&self) -> Option<Time> {
        self.newest.map(|_| self.update_sent + REPEAT)
    }

    /// When the next scene is due; never while there is none that the observer has not been sent.
    fn scene_due(&self) -> Option<Time> {
        let period = SECOND.checked_div(self.scene_hz.into())?;
        let is_new = self.view.scene.is_some() && self.view.scene != self.scene;
        is_new.then(|| self.scene_sent + period)
    }

    fn take_due_scene(&mut self, now: Time) -> Option<Scene> {
        self.scene_due().filter(|due| due.has_come(now))?;
        (self.scene, self.scene_sent) = (self.view.scene, now);
        self.scene
    }

    /// What was sent and received in the `duration_s` (s) since it began.
    #[must_use]
    pub fn half(&self, duration_s: f64) -> SlaveHalf {
        let repeats = self.repeated.total();
        SlaveHalf {
            session: SessionStats::new(Side::Slave, &self.channel, repeats, duration_s),
            updates: SentUpdates {
                rate_hz: Number::rate(self.sent.total() as f64, duration_s),
                ..SentUpdates::new(&self.sent, &self.repeated)
            },
            ..SlaveHalf::default()
        }
    }
}

#[cfg(test)]
mod tests;
