//! The traffic of a session: datagrams in, updates with their repeats and heartbeats out, looks for the screen.
//!
//! It never waits for the network to take a datagram: what cannot be sent now is dropped and counted.

use std::pin::Pin;
use std::time::Duration;

use bytes::Bytes;
use mmt_shared::channel::datagram_channel::SealError;
use mmt_shared::io::farewell::{FarewellError, ReceivedFarewell};
use mmt_shared::io::live::LiveCell;
use mmt_shared::io::transport::SendDatagramError;
use mmt_shared::stats::session::MasterTotals;
use mmt_shared::time::Time;
use tokio::sync::watch;
use tokio::time::{MissedTickBehavior, interval, sleep};

use super::Session;
use super::end::{End, SILENCE_MAX};
use crate::io::SlaveLive;
use crate::io::host::stopped;
use crate::io::worker::Arrived;

/// What the read of the master's farewell gives.
type MastersFarewell = Result<ReceivedFarewell<MasterTotals>, FarewellError>;

/// Between two looks for the screen: 40 in a second.
const LOOK: Duration = Duration::from_millis(25);

impl Session<'_> {
    /// Carries the traffic until something ends it.
    pub(super) async fn until_end(
        &mut self,
        farewell: Pin<&mut impl Future<Output = MastersFarewell>>,
        stop: &mut watch::Receiver<bool>,
        live: &LiveCell<SlaveLive>,
    ) -> End {
        let carried = self.carry(farewell, stop, live).await;
        carried.map_or_else(|end| end, |never| match never {})
    }

    async fn carry(
        &mut self,
        mut farewell: Pin<&mut impl Future<Output = MastersFarewell>>,
        stop: &mut watch::Receiver<bool>,
        live: &LiveCell<SlaveLive>,
    ) -> Result<std::convert::Infallible, End> {
        let mut looks = interval(LOOK);
        looks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            let now = self.shared.clock.now();
            let due = self.link.end().heartbeat_due();
            let link = &self.link;
            let others = [link.repeat_due(), link.scene_due()];
            let due = others.into_iter().flatten().fold(due, Time::min);
            let due = due.saturating_since(now);
            // In this order, so that a flood of datagrams holds up nothing else.
            tokio::select! {
                biased;
                told = &mut farewell => return Err(End::Farewell(Box::new(told?))),
                () = stopped(stop) => return Err(End::Asked),
                _ = &mut self.worker.finished => return Err(End::Panicked),
                woken = self.worker.wakeup.wait() => {
                    // Only a runtime that shuts down fails here.
                    woken.map_err(|_| End::Asked)?;
                    self.send_update()?;
                    self.send_tool()?;
                }
                () = sleep(due) => self.send_due()?,
                _ = looks.tick() => self.look(live)?,
                datagram = self.connection.read_datagram() => self.take(&datagram?),
            }
        }
    }

    /// Takes in a datagram; its stamp is that of this moment.
    pub(super) fn take(&mut self, datagram: &Bytes) {
        self.lost.read += 1;
        let now = self.shared.clock.now();
        let Some(command) = self.link.handle(now, datagram) else {
            return;
        };
        let stretch = self.link.end().stretch();
        let last = command.samples.last().map(|sample| sample.stamp);
        for (sample, newest_update) in self.link.samples(&command) {
            let taken = self.worker.samples.push(Arrived {
                at: now,
                sample,
                newest_update,
                stretch,
                port: command.port.filter(|_| Some(sample.stamp) == last),
            });
            self.lost.samples += u64::from(taken.is_err());
        }
    }

    fn send_update(&mut self) -> Result<(), End> {
        let Some(update) = self.worker.fresh_update() else {
            return Ok(());
        };
        let now = self.shared.clock.now();
        let sealed = self.link.send_update(now, &update, &mut self.buffer);
        if self.send(sealed.map(Some))? {
            self.sent.sent(update.cause);
        }
        Ok(())
    }

    /// The tool's state, where the hand feels it.
    fn send_tool(&mut self) -> Result<(), End> {
        let Some(tool) = self.worker.fresh_tool() else {
            return Ok(());
        };
        let now = self.shared.clock.now();
        let sealed = self.link.send_tool(now, &tool, &mut self.buffer);
        self.send(sealed.map(Some)).map(drop)
    }

    /// Scenes, repeats and heartbeats, which nothing but the time asks for.
    fn send_due(&mut self) -> Result<(), End> {
        let now = self.shared.clock.now();
        if self.link.scene_due().is_some_and(|due| due <= now) {
            let scene = self.worker.newest().map(|news| news.scene);
            let sealed = self.link.send_scene(now, scene.as_ref(), &mut self.buffer);
            self.send(sealed)?;
        }
        let repeat = self.link.repeat(now, &mut self.buffer);
        self.send(repeat)?;
        let heartbeat = self.link.heartbeat(now, &mut self.buffer);
        self.send(heartbeat).map(drop)
    }

    /// Gives what was sealed to the connection; whether it took it.
    fn send(&mut self, sealed: Result<Option<usize>, SealError>) -> Result<bool, End> {
        let length = match sealed {
            Ok(Some(length)) => length,
            Ok(None) => return Ok(false),
            Err(SealError::Numbers(spent)) => return Err(spent.into()),
            Err(SealError::Encode(_)) => {
                self.lost.unsealed += 1;
                return Ok(false);
            }
        };
        let bytes = self.buffer.get(..length).unwrap_or_default();
        let given = self.connection.send_datagram(Bytes::copy_from_slice(bytes));
        let counter = match &given {
            Ok(()) => &mut self.lost.given,
            Err(SendDatagramError::TooLarge) => &mut self.lost.too_large,
            Err(SendDatagramError::ConnectionLost(_)) => &mut self.lost.disconnected,
            Err(SendDatagramError::UnsupportedByPeer | SendDatagramError::Disabled) => {
                &mut self.lost.unsupported
            }
        };
        *counter += 1;
        Ok(given.is_ok())
    }

    /// Shows what there is to see, and looks whether the master is still there.
    fn look(&mut self, live: &LiveCell<SlaveLive>) -> Result<(), End> {
        let now = self.shared.clock.now();
        let end = self.link.end();
        let median = end.peer().round_trip().histogram().quantile(0.5);
        let mut look = *self.worker.looks.read();
        look.connected = true;
        look.elapsed_s = now.saturating_since(end.began()).as_secs_f64();
        look.rtt_ms = median.map(|rtt| rtt.as_secs_f64() * 1e3);
        look.loss_up = end.peer().incoming().share();
        for (slot, (_, count)) in look.updates.iter_mut().zip(self.sent.by_cause()) {
            *slot = count;
        }
        live.set(look);
        match end.silence(now) > SILENCE_MAX {
            true => Err(End::Silence),
            false => Ok(()),
        }
    }
}
