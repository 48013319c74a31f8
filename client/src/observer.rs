//! An observer's end of a session: what the slave shows comes in, heartbeats go out.
//!
//! Pure: it reads no clock and touches no socket. It has no hand: nothing that it sends moves anything, and no force comes of what
//! it receives.

use mmt_shared::channel::datagram_channel::DatagramChannel;
use mmt_shared::channel::peer::{Freshness, Loss, NumbersSpent, SequenceWindow};
use mmt_shared::model::contact::Coupling;
use mmt_shared::model::geometry::{BoxFootprint, Pose, Vec2};
use mmt_shared::model::params::ModelState;
use mmt_shared::model::tool::Scene;
use mmt_shared::model::update::{Cause, Update};
use mmt_shared::report::{MasterHalf, ReceivedUpdates, SessionStats, named};
use mmt_shared::stats::session::UpdateDrops;
use mmt_shared::time::Time;
use mmt_shared::wire::{Message, RawState, Side, Welcome};
use serde::Serialize;

use crate::end::Change;
use crate::failsafe::LinkState;

/// The coupling of an observer's hello, 50 N/m without damping: the softest that there is, so that an observer accepts
/// each state that is stable at any operator's device.
pub const COUPLING: Coupling = Coupling {
    stiffness_n_per_m: 50.0,
    damping_ns_per_m: 0.0,
};

/// What an observer sees, for a screen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ObserverLive {
    /// Seconds since it began to look on.
    pub elapsed_s: f64,
    /// The object where the newest update has it.
    pub model: Pose,
    /// Its footprint; none before the welcome.
    pub footprint: Option<BoxFootprint>,
    /// m, b, c of the newest update.
    pub params: [f64; 3],
    /// Whether the tool touched the object at the newest update or scene.
    pub in_contact: bool,
    /// The remote scene as it last came.
    pub scene: Option<Scene>,
    /// How old it is: since it came, and half of the round trip, s.
    pub scene_age_s: Option<f64>,
    /// What the newest update changed.
    pub change: Option<Change>,
    /// Updates taken, by cause.
    pub updates: [u64; Cause::ALL.len()],
    /// Whether an emergency stop is set, the slave's or its operator's.
    pub stopped: bool,
    /// The link.
    pub link: LinkState,
    /// Median round trip, ms.
    pub rtt_ms: Option<f64>,
    /// What of the datagrams that it sent reached the slave's host.
    pub up: Loss,
    /// What of the slave's datagrams reached this host.
    pub down: Loss,
}

/// The observer's end.
#[derive(Clone, Debug)]
pub struct ObserverEnd {
    channel: DatagramChannel,
    window: SequenceWindow,
    state: ModelState,
    in_contact: bool,
    change: Option<Change>,
    updates: [u64; Cause::ALL.len()],
    rejected: u64,
    messages_overtaken: u64,
    scene: Option<Scene>,
    /// When it came.
    scene_at: Time,
}

impl ObserverEnd {
    /// An end from `now` on, which the slave has welcomed.
    pub fn new(now: Time, welcome: &Welcome) -> Self {
        Self {
            channel: DatagramChannel::new(Side::Master, now),
            window: SequenceWindow::default(),
            state: welcome.state,
            in_contact: false,
            change: None,
            updates: [0; Cause::ALL.len()],
            rejected: 0,
            messages_overtaken: 0,
            scene: None,
            scene_at: now,
        }
    }

    /// The datagram channel: round trip, loss, counts.
    pub fn channel(&self) -> &DatagramChannel {
        &self.channel
    }

    /// The object where the newest update has it.
    pub fn state(&self) -> &ModelState {
        &self.state
    }

    /// Takes in a datagram that arrived at `at`.
    pub fn handle_datagram(&mut self, at: Time, bytes: &[u8]) {
        let Some(received) = self.channel.handle(at, bytes) else {
            return;
        };
        match received.message {
            Message::Update(update) => self.handle_update(&update),
            Message::Scene(scene) if received.is_newest => {
                (self.scene, self.scene_at) = (Some(scene), at);
                self.in_contact = scene.force != Vec2::zeros();
            }
            Message::Scene(_) | Message::Tool(_) => self.messages_overtaken += 1,
            Message::Command(_) | Message::Heartbeat => {}
        }
    }

    fn handle_update(&mut self, update: &Update<RawState>) {
        if self.window.judge(update.sequence) != Freshness::Fresh {
            return;
        }
        let Ok(update) = update.accept(&COUPLING) else {
            self.rejected += 1;
            return;
        };
        self.window.accept(update.sequence);
        let (old, new) = (&self.state, &update.state);
        let (before, after) = (old.params(), new.params());
        self.change = Some(Change {
            sequence: update.sequence,
            cause: update.cause,
            params: [
                after.m() - before.m(),
                after.b() - before.b(),
                after.c() - before.c(),
            ],
            shift: new.pose().position - old.pose().position,
            turn: new.pose().angle - old.pose().angle,
        });
        if let Some(count) = self.updates.get_mut(update.cause.number()) {
            *count += 1;
        }
        (self.state, self.in_contact) = (update.state, update.slave_in_contact());
    }

    /// Writes the next datagram that is to be sent at `now` to `out` and returns its length; none if there is nothing
    /// to send: an observer sends heartbeats only.
    ///
    /// # Errors
    /// The session has used up its datagram numbers.
    pub fn poll_transmit(
        &mut self,
        now: Time,
        out: &mut [u8],
    ) -> Result<Option<usize>, NumbersSpent> {
        if self.poll_timeout().has_come(now) {
            return self.channel.encode(now, Message::Heartbeat, out);
        }
        Ok(None)
    }

    /// When the next heartbeat must go out.
    pub fn poll_timeout(&self) -> Time {
        self.channel.heartbeat_due()
    }

    /// What it sees at `now`.
    pub fn live(&self, now: Time) -> ObserverLive {
        let (channel, params) = (&self.channel, self.state.params());
        let (peer, round_trip) = (channel.peer(), channel.peer().round_trip());
        let on_the_way = round_trip.latest().unwrap_or_default() / 2;
        let age = (now.saturating_since(self.scene_at) + on_the_way).as_secs_f64();
        let median = round_trip.histogram().quantile(0.5);
        ObserverLive {
            elapsed_s: now.saturating_since(channel.began()).as_secs_f64(),
            model: self.state.pose(),
            footprint: Some(self.state.footprint()),
            params: [params.m(), params.b(), params.c()],
            in_contact: self.in_contact,
            scene: self.scene,
            scene_age_s: self.scene.map(|_| age),
            change: self.change,
            updates: self.updates,
            stopped: channel.stopped_by().is_some(),
            link: LinkState::of_silence(channel.silence(now)),
            rtt_ms: median.map(|rtt| rtt.as_secs_f64() * 1e3),
            up: peer.outgoing_at(now),
            down: peer.incoming(),
        }
    }

    /// What it counted in the `duration_s` (s) since it began.
    pub fn half(&self, duration_s: f64) -> MasterHalf {
        let drops = UpdateDrops {
            duplicate: self.window.duplicate(),
            stale: self.window.stale(),
            implausible: self.window.implausible(),
            rejected: self.rejected,
            ..UpdateDrops::default()
        };
        let mut session =
            SessionStats::new(Side::Master, &self.channel, drops.duplicate, duration_s);
        session.add_drops([("messages_overtaken", self.messages_overtaken)]);
        MasterHalf {
            session,
            updates: ReceivedUpdates {
                applied: Some(self.updates.iter().sum()),
                dropped: Some(named(drops.by_name())),
                ..ReceivedUpdates::default()
            },
            ..MasterHalf::default()
        }
    }
}

#[cfg(test)]
mod tests;
