//! The network task of a session: datagrams to the haptic loop, its samples to the slave.
//!
//! It decides nothing about the model: updates pass the link's own checks, then the latest-wins cell.

use std::pin::Pin;
use std::sync::PoisonError;
use std::time::Duration;

use bytes::Bytes;
use mmt_shared::io::clock::Clock;
use mmt_shared::io::farewell::{FarewellError, ReceivedFarewell};
use mmt_shared::io::transport::{Connection, ConnectionError};
use mmt_shared::io::wake::Wakeup;
use mmt_shared::model::tool::Scene;
use mmt_shared::stats::session::SlaveTotals;
use mmt_shared::wire::DATAGRAM_MAX;
use tokio::sync::watch;
use tokio::time::{MissedTickBehavior, interval};

use super::haptic::{HapticPort, Said};
use super::{MasterLive, SessionEnd, SharedPath};
use crate::failsafe::LinkState;
use crate::link::{FromSlave, MasterLink};

/// How often the task looks whether a heartbeat is due: a fifth of a heartbeat's period.
const BEAT: Duration = Duration::from_millis(10);
/// A screen gets a look every so many beats: 25 a second.
const LOOK_BEATS: u32 = 4;

/// What the task counted besides what the link counts.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PumpCounts {
    /// Datagrams that QUIC took.
    pub(super) given: u64,
    /// Datagrams that QUIC did not take.
    pub(super) unsent: u64,
    /// Datagrams read.
    pub(super) read: u64,
    /// Messages that could not be sealed.
    pub(super) unsealed: u64,
}

/// The network task's state.
pub(super) struct Pump<'a> {
    clock: Clock,
    connection: &'a Connection,
    pub(super) link: MasterLink,
    pub(super) port: HapticPort,
    live: &'a watch::Sender<MasterLive>,
    path: Option<SharedPath>,
    pub(super) counts: PumpCounts,
    /// Why the session ends, if this task noticed first.
    pub(super) end: Option<SessionEnd>,
    /// Whether the connection is up.
    pub(super) connected: bool,
    /// Whether the read of the slave's farewell still waits; once it has ended it must not be asked again.
    pub(super) listening: bool,
    /// The slave's farewell, if it came.
    pub(super) told: Option<ReceivedFarewell<SlaveTotals>>,
    shown: LinkState,
    scene: Option<Scene>,
}

/// Waits until somebody wants the session to end.
pub(super) async fn stopped(stop: &mut watch::Receiver<bool>) {
    if stop.wait_for(|stop| *stop).await.is_err() {
        // nobody is left who could ask
        std::future::pending::<()>().await;
    }
}

impl<'a> Pump<'a> {
    /// The network task of a session that begins.
    pub(super) fn new(
        clock: Clock,
        connection: &'a Connection,
        link: MasterLink,
        port: HapticPort,
        live: &'a watch::Sender<MasterLive>,
        path: Option<SharedPath>,
    ) -> Self {
        Self {
            clock,
            connection,
            link,
            port,
            live,
            path,
            counts: PumpCounts::default(),
            end: None,
            connected: true,
            listening: true,
            told: None,
            shown: LinkState::default(),
            scene: None,
        }
    }

    /// Runs until the haptic loop has ended. `farewell` is the read of the slave's farewell.
    pub(super) async fn run<F>(
        &mut self,
        wakeup: &mut Wakeup,
        stop: &mut watch::Receiver<bool>,
        mut farewell: Pin<&mut F>,
    ) where
        F: Future<Output = Result<ReceivedFarewell<SlaveTotals>, FarewellError>>,
    {
        let mut beat = interval(BEAT);
        beat.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let (mut beats, mut waking, mut asked) = (0_u32, true, false);
        while !self.port.ended() {
            tokio::select! {
                woken = wakeup.wait(), if waking => waking = woken.is_ok(),
                datagram = self.connection.read_datagram(), if self.connected => match datagram {
                    Ok(bytes) => self.take(&bytes),
                    Err(error) => self.lose(&error),
                },
                said = farewell.as_mut(), if self.listening => {
                    self.listening = false;
                    self.hear(said);
                }
                () = stopped(stop), if !asked => {
                    asked = true;
                    self.end(SessionEnd::Stopped);
                }
                _ = beat.tick() => {
                    beats = beats.wrapping_add(1);
                    self.beat(beats.is_multiple_of(LOOK_BEATS));
                }
            }
            self.send_samples();
        }
        self.send_samples();
    }

    /// Shows the newest look, with what only the network knows.
    pub(super) fn show(&mut self, ended: Option<SessionEnd>) {
        let peer = self.link.end().peer();
        let rtt = peer.round_trip().histogram().quantile(0.5);
        let loss = (peer.outgoing().share(), peer.incoming().share());
        let look = self.port.look();
        if look.link != self.shown {
            self.shown = look.link;
            tracing::info!(link = look.link.name(), "the link");
        }
        let now = self.clock.now();
        let age = |scene: &Scene| now.saturating_since(scene.answers).as_secs_f64();
        self.live.send_replace(MasterLive {
            scene: self.scene,
            scene_age_s: self.scene.as_ref().map(age),
            rtt_ms: rtt.map(|rtt| rtt.as_secs_f64() * 1e3),
            loss,
            ended: ended.or(look.ended),
            ..look
        });
    }

    fn end(&mut self, why: SessionEnd) {
        self.end.get_or_insert(why);
        self.port.release();
    }

    fn lose(&mut self, error: &ConnectionError) {
        self.connected = false;
        if self.told.is_none() {
            tracing::warn!(%error, "the connection to the slave is gone");
        }
        self.end(SessionEnd::ConnectionLost);
    }

    fn hear(&mut self, said: Result<ReceivedFarewell<SlaveTotals>, FarewellError>) {
        match said {
            Ok(farewell) => {
                self.told = Some(farewell);
                self.end(SessionEnd::SlaveEnded(farewell.ending));
            }
            Err(error) if error.is_loss() => self.end(SessionEnd::ConnectionLost),
            Err(error) => {
                tracing::error!(%error, "the slave's farewell");
                self.end(SessionEnd::StreamBroken);
            }
        }
    }

    fn take(&mut self, bytes: &[u8]) {
        self.counts.read += 1;
        let now = self.clock.now();
        match self.link.handle(now, bytes) {
            Some(FromSlave::Update(update)) => self.port.offer(&update),
            Some(FromSlave::Tool(tool)) => self.port.offer_tool(now, &tool),
            Some(FromSlave::Scene(scene)) => self.scene = Some(scene),
            None => {}
        }
        if let Some(path) = &self.path {
            let mut path = path.lock().unwrap_or_else(PoisonError::into_inner);
            path.note(now, self.link.end().peer());
        }
        self.port.heard(self.link.end().last_heard());
    }

    fn send_samples(&mut self) {
        let mut buffer = [0; DATAGRAM_MAX];
        while let Some(Said { sample, port }) = self.port.pop() {
            let now = self.clock.now();
            match self.link.send(now, sample, port, &mut buffer) {
                Ok(length) => self.give(length.and_then(|length| buffer.get(..length))),
                Err(_) => self.counts.unsealed += 1,
            }
        }
    }

    fn beat(&mut self, look: bool) {
        let mut buffer = [0; DATAGRAM_MAX];
        match self.link.heartbeat(self.clock.now(), &mut buffer) {
            Ok(length) => self.give(length.and_then(|length| buffer.get(..length))),
            Err(_) => self.counts.unsealed += 1,
        }
        if look {
            self.show(None);
        }
    }

    fn give(&mut self, datagram: Option<&[u8]>) {
        let Some(bytes) = datagram else {
            return;
        };
        match self.connection.send_datagram(Bytes::copy_from_slice(bytes)) {
            Ok(()) => self.counts.given += 1,
            Err(_) => self.counts.unsent += 1,
        }
    }
}
