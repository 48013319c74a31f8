//! A session from the first packet to the report.

use std::pin::{Pin, pin};
use std::sync::PoisonError;
use std::time::Duration;

use mmt_shared::io::clock::Clock;
use mmt_shared::io::farewell::{
    FarewellError, ReceivedFarewell, farewell_wait, receive_farewell, send_farewell,
};
use mmt_shared::io::loop_thread;
use mmt_shared::io::network_task::{Event, NetworkTask};
use mmt_shared::io::stream::delivered;
use mmt_shared::io::transport::SendStream;
use mmt_shared::io::wish::{Wish, asked_to_stop};
use mmt_shared::model::geometry::{BoxFootprint, Pose};
use mmt_shared::report::{MasterHalf, SlaveHalf};
use mmt_shared::wire::{Ending, Side};
use tokio::sync::watch;
use tokio::time::{Instant, error::Elapsed, timeout_at};

use super::haptic::HapticLoop;
use super::open::{Opened, Opening, TIMEOUTS, Timeouts, open};
use super::options::MasterOptions;
use super::report::half;
use super::{MasterConfiguration, MasterHostError, MasterLive, MasterReport, SessionEnd, record};
use crate::again::MasterSetting;
use crate::failsafe::LinkState;
use crate::limiter::ForceLimiter;
use crate::operator::scripted::View;
use crate::path::PathRecorder;

/// The loop's thread.
const THREAD: &str = "mmt-haptic";

/// Runs a master against the slave of a pairing string until its duration is over, its operator has
/// finished, `stop` becomes true, or the other side or the link ends it. `live` gets a snapshot 62 times a
/// second; the last one has the reason why the session ended.
///
/// A session that began always gives a report: one that the link or the slave broke has the ending
/// `failed`, and what only the slave counts is absent from it.
///
/// Call it inside of a tokio runtime with I/O and time.
///
/// # Errors
/// There was no session, or the haptic loop broke; see [`MasterHostError`].
pub async fn run(
    options: MasterOptions,
    stop: watch::Receiver<Wish>,
    live: watch::Sender<MasterLive>,
) -> Result<MasterReport, MasterHostError> {
    run_with(options, stop, live, TIMEOUTS).await
}

/// The box as every slave of this project shows it at first; what the hello's start goes by.
fn first_view() -> View {
    View {
        pose: Pose::default(),
        footprint: BoxFootprint::square(0.40),
        in_contact: false,
    }
}

pub(super) async fn run_with(
    mut options: MasterOptions,
    mut stop: watch::Receiver<Wish>,
    live: watch::Sender<MasterLive>,
    timeouts: Timeouts,
) -> Result<MasterReport, MasterHostError> {
    options.commands = options.commands.for_architecture(options.architecture);
    // before anybody is asked
    ForceLimiter::try_new(options.device.limits())?;
    let start = options.operator.begin(first_view())?.start();
    let opening = Opening::of_operator(&options, start);
    let opened = tokio::select! {
        opened = open(&opening, &timeouts) => opened?,
        _ = asked_to_stop(&mut stop) => return Err(MasterHostError::Interrupted),
    };
    let welcome = &opened.welcome;
    tracing::info!(
        slave = %opened.connected.address, program = %welcome.program, scheme = %welcome.scheme,
        "the session begins"
    );
    if let Some(resume) = &options.resume {
        resume.keep(&welcome.resume);
    }
    let clock = Clock::start();
    let setting = MasterSetting {
        began: clock.now(),
        welcome: *welcome,
        architecture: options.architecture,
        limits: options.device.limits(),
        commands: options.commands,
    };
    let end = setting.end()?;
    let view = end.master().view();
    let operator = options.operator.begin(view)?.led_from(welcome.tool, &view);
    let path = options.path.is_some().then(PathRecorder::with_room);
    let mut haptic = HapticLoop::new(end, operator, options.duration)
        .observed_by(options.truth.take(), path)
        .operated_through(options.events.get_mut().ok().and_then(Option::take))
        .plugged_into(options.device_port.get_mut().ok().and_then(Option::take))
        .stopped_by(options.emergency.clone());
    if let Some(recorder) = &options.record {
        let sink = record::begin(
            recorder,
            clock,
            &setting,
            &MasterConfiguration::from(&options),
        );
        haptic = haptic.recorded(sink);
    }
    let body = move |side, ticker| haptic.run(side, ticker, clock);
    operate(&options, opened, clock, body, stop, live, &timeouts).await
}

/// Runs a session whose haptic thread does `body`.
pub(super) async fn operate(
    options: &MasterOptions,
    opened: Opened,
    clock: Clock,
    body: impl FnOnce(loop_thread::LoopSide<MasterLive>, mmt_shared::io::ticker::Ticker) -> HapticLoop
    + Send
    + 'static,
    mut stop: watch::Receiver<Wish>,
    live: watch::Sender<MasterLive>,
    timeouts: &Timeouts,
) -> Result<MasterReport, MasterHostError> {
    let Opened {
        connected,
        mut send,
        mut receive,
        ..
    } = opened;
    let handle = loop_thread::spawn(THREAD, clock, &MasterLive::default(), body)
        .map_err(MasterHostError::Thread)?;
    let mut session = Session {
        task: NetworkTask::new(clock, connected.connection.clone(), handle),
        live: &live,
        why: None,
        farewell: None,
        shown: LinkState::default(),
    };
    let mut farewell = pin!(receive_farewell(&mut receive, Side::Slave));
    let Some(mut haptic) = session.run(farewell.as_mut(), &mut stop).await else {
        // without a report: what counts is gone with the loop
        let wait = farewell_wait(&connected.connection, timeouts.farewell);
        let failed = session.part(Ending::Failed, None, &mut send, farewell, wait);
        failed.await;
        connected
            .close("the master's haptic loop failed", timeouts.idle)
            .await;
        return Err(MasterHostError::of_loop(session.task.handle()));
    };
    let duration = (clock.now()).saturating_since(haptic.end.channel().began());
    // the loop keeps its own reasons, the network task the others; one without a reason was asked to end
    let why = haptic.why.or(session.why).unwrap_or(SessionEnd::Stopped);
    tracing::info!("the session ends: {why}");
    let own = half(&haptic, &session.task, &connected, duration);
    let wait = farewell_wait(&connected.connection, timeouts.farewell);
    let ended = session.part(why.ending(), Some(&own), &mut send, farewell, wait);
    ended.await;
    if session.ended_well()
        && let Some(resume) = &options.resume
    {
        resume.forget();
    }
    connected.close(&why.to_string(), timeouts.idle).await;
    session.show(Some(why));
    // the farewell and the close are part of what a session costs
    let own = half(&haptic, &session.task, &connected, duration);
    if let (Some(kept), Some(path)) = (&options.path, haptic.path.take()) {
        *kept.lock().unwrap_or_else(PoisonError::into_inner) = path;
    }
    Ok(MasterReport {
        seed: options.netem_seed,
        duration_s: haptic.elapsed.as_secs_f64(),
        ending: why.ending(),
        own,
        other: session.farewell.and_then(|farewell| farewell.report),
        configuration: options.into(),
    })
}

/// What a session keeps outside of its haptic loop.
struct Session<'a> {
    task: NetworkTask<MasterLive, HapticLoop>,
    live: &'a watch::Sender<MasterLive>,
    /// Why the session ends, if this task noticed first.
    why: Option<SessionEnd>,
    /// The slave's farewell, if it came.
    farewell: Option<ReceivedFarewell<SlaveHalf>>,
    shown: LinkState,
}

type FarewellRead = Result<ReceivedFarewell<SlaveHalf>, FarewellError>;

impl Session<'_> {
    /// Runs until the haptic loop has ended; none if it panicked or has hung.
    async fn run<F: Future<Output = FarewellRead>>(
        &mut self,
        mut farewell: Pin<&mut F>,
        stop: &mut watch::Receiver<Wish>,
    ) -> Option<HapticLoop> {
        loop {
            match self.task.next(farewell.as_mut(), stop).await {
                Event::LoopEnded(ended) => return ended,
                Event::Beat => self.show(None),
                Event::Stopped(wish) => self.end(wish.into()),
                Event::Farewell(read) => self.handle_farewell(read),
                Event::Disconnected(error) => {
                    if self.farewell.is_none() {
                        tracing::warn!(%error, "the connection to the slave is gone");
                    }
                    self.end(self.loss());
                }
            }
        }
    }

    /// Sends the slave why the session ends and what this side has counted, and receives its farewell if that is still due; waits
    /// no longer than `wait`. Nothing where the connection is gone.
    async fn part(
        &mut self,
        ending: Ending,
        half: Option<&MasterHalf>,
        send: &mut SendStream,
        farewell: impl Future<Output = FarewellRead>,
        wait: Duration,
    ) {
        if !self.task.is_connected() {
            return;
        }
        let deadline = Instant::now() + wait;
        if let Err(error) = send_farewell(send, ending, &half, wait).await {
            tracing::warn!(%error, "the farewell did not reach the slave");
        }
        if self.task.awaits_farewell() {
            self.farewell = answer(timeout_at(deadline, farewell).await);
        } else {
            delivered(send, deadline.saturating_duration_since(Instant::now())).await;
        }
    }

    /// Shows the newest snapshot.
    fn show(&mut self, ended: Option<SessionEnd>) {
        let snapshot = *self.task.handle().snapshot();
        if snapshot.link != self.shown {
            self.shown = snapshot.link;
            tracing::info!(link = snapshot.link.name(), "the link");
        }
        let unsent = self.task.unsent();
        self.live.send_replace(MasterLive {
            ended: ended.or(snapshot.ended),
            up: snapshot.up.on_the_path(unsent, 0),
            down: snapshot.down.on_the_path(0, self.task.unread()),
            unsent,
            ..snapshot
        });
    }

    /// Asks the loop to release the hand and to end; the first reason counts.
    fn end(&mut self, why: SessionEnd) {
        self.why.get_or_insert(why);
        self.task.handle().stop();
    }

    /// Why the connection is gone.
    fn loss(&self) -> SessionEnd {
        if self.task.is_taken_over() {
            SessionEnd::TakenOver
        } else {
            SessionEnd::ConnectionLost
        }
    }

    /// Whether the slave has ended a session that did not fail; after one that did it keeps the operator's place for a while.
    fn ended_well(&self) -> bool {
        let farewell = self.farewell.as_ref();
        farewell.is_some_and(|farewell| farewell.ending != Ending::Failed)
    }

    fn handle_farewell(&mut self, read: FarewellRead) {
        match read {
            Ok(farewell) => {
                self.end(SessionEnd::SlaveEnded(farewell.ending));
                self.farewell = Some(farewell);
            }
            Err(error) if error.is_loss() => self.end(self.loss()),
            Err(error) => {
                tracing::error!(%error, "the slave's farewell");
                self.end(SessionEnd::StreamBroken);
            }
        }
    }
}

/// The slave's answer to the master's farewell, if it came in time and could be read.
fn answer(read: Result<FarewellRead, Elapsed>) -> Option<ReceivedFarewell<SlaveHalf>> {
    match read {
        Ok(Ok(farewell)) => Some(farewell),
        Ok(Err(error)) => {
            tracing::warn!(%error, "the slave gave no farewell: the report lacks what it counted");
            None
        }
        Err(_) => {
            tracing::warn!("the slave gave no farewell in time: the report lacks what it counted");
            None
        }
    }
}
