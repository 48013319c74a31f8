//! A session from the first packet to the report.

use std::pin::pin;
use std::thread::JoinHandle;

use mmt_shared::io::clock::Clock;
use mmt_shared::io::farewell::{FarewellError, ReceivedFarewell, receive_farewell, send_farewell};
use mmt_shared::io::realtime::RealTime;
use mmt_shared::io::wake;
use mmt_shared::model::geometry::{BoxFootprint, Pose};
use mmt_shared::stats::session::{SlaveTotals, UpdateDrops};
use mmt_shared::wire::Side;
use tokio::sync::{oneshot, watch};
use tokio::time::{Instant, error::Elapsed, timeout_at};

use super::haptic::{HapticLoop, HapticOutcome, HapticParts, HapticPort};
use super::open::{Line, Opened, PATIENCE, Patience, open};
use super::pump::{Pump, stopped};
use super::report::Ended;
use super::thread::Finished;
use super::{MasterHostError, MasterLive, MasterOptions, MasterReport, SessionEnd, thread};
use crate::limiter::ForceLimiter;
use crate::link::MasterLink;
use crate::master::Master;
use crate::operator::scripted::View;

/// Runs a master against the slave of a pairing string until its duration is over, its operator has
/// finished, `stop` becomes true, or the other side or the link ends it. `live` gets a look 25 times a
/// second; the last one says why the session ended.
///
/// A session that began always gives a report: one that the link or the slave broke has the ending
/// `failed`, and what only the slave could have told is absent from it.
///
/// Call it inside of a tokio runtime with I/O and time.
///
/// # Errors
/// There was no session, or the haptic loop broke; see [`MasterHostError`].
pub async fn run(
    options: MasterOptions,
    stop: watch::Receiver<bool>,
    live: watch::Sender<MasterLive>,
) -> Result<MasterReport, MasterHostError> {
    run_with(options, stop, live, PATIENCE).await
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
    mut stop: watch::Receiver<bool>,
    live: watch::Sender<MasterLive>,
    patience: Patience,
) -> Result<MasterReport, MasterHostError> {
    options.commands = options.commands.for_architecture(options.architecture);
    let limiter = ForceLimiter::try_new(options.device.limits())?;
    let start = options.operator.begin(first_view())?.start();
    let opened = tokio::select! {
        opened = open(&options, start, &patience) => opened?,
        () = stopped(&mut stop) => return Err(MasterHostError::Interrupted),
    };
    let welcome = &opened.welcome;
    tracing::info!(
        slave = %opened.line.address, program = %welcome.program, scheme = %welcome.scheme,
        "the session begins"
    );
    let master = Master::with_architecture(welcome, limiter, options.architecture);
    let operator = options.operator.begin(master.view())?;
    let parts = HapticParts {
        master,
        operator,
        duration: options.duration,
        samples_per_wake: options.commands.samples_per_command,
        truth: options.truth.take(),
    };
    operate(&options, opened, parts, stop, live, &patience).await
}

async fn operate(
    options: &MasterOptions,
    opened: Opened,
    parts: HapticParts,
    mut stop: watch::Receiver<bool>,
    live: watch::Sender<MasterLive>,
    patience: &Patience,
) -> Result<MasterReport, MasterHostError> {
    let Opened {
        line,
        mut send,
        mut receive,
        ..
    } = opened;
    let clock = Clock::start();
    let began = clock.now();
    let (waker, mut wakeup) = wake::pair().map_err(MasterHostError::Thread)?;
    let (haptic, port) = HapticLoop::new(parts, began, waker);
    let thread = start(haptic, clock)?;
    let coupling = options.device.coupling();
    let link = MasterLink::new(began, coupling, options.commands);
    let mut pump = Pump::new(
        clock,
        &line.connection,
        link,
        port,
        &live,
        options.path.clone(),
    );
    let mut farewell = pin!(receive_farewell(&mut receive, Side::Slave));
    pump.run(&mut wakeup, &mut stop, farewell.as_mut()).await;
    let haptic = join(thread, &line, patience).await?;
    let mut ended = Ended {
        end: first_cause(&haptic, pump.end),
        haptic,
        duration: clock.now().saturating_since(began),
        updates: update_drops(&pump.link, &pump.port, &haptic),
        counts: pump.counts,
        told: pump.told,
        sockets: line.meter.snapshot(),
        lateness: line.meter.lateness(),
        passed: line.connection.datagrams(),
        address: line.address,
    };
    tracing::info!("the session ends: {}", ended.end);
    if pump.connected {
        let deadline = Instant::now() + patience.farewell;
        let (ending, report) = (ended.end.ending(), ended.totals(&pump.link));
        let sent = send_farewell(&mut send, ending, &report, patience.farewell).await;
        if let Err(error) = sent {
            tracing::warn!(%error, "the farewell did not reach the slave");
        }
        if pump.listening {
            ended.told = answer(timeout_at(deadline, farewell).await);
        } else {
            send.delivered(deadline.saturating_duration_since(Instant::now()))
                .await;
        }
    }
    ended.passed = line.connection.datagrams();
    line.close(&ended.end.to_string(), patience.idle).await;
    ended.sockets = line.meter.snapshot();
    ended.lateness = line.meter.lateness();
    pump.show(Some(ended.end));
    Ok(ended.report(options, &pump.link))
}

/// Starts the haptic thread, and has logged what the host granted it.
fn start(haptic: HapticLoop, clock: Clock) -> Result<JoinHandle<Finished>, MasterHostError> {
    let (granted, granted_to) = oneshot::channel();
    let thread = thread::spawn(haptic, clock, granted).map_err(MasterHostError::Thread)?;
    tokio::spawn(tell(granted_to));
    Ok(thread)
}

/// What the haptic thread came to. It has left its loop, so this does not wait for it; without an
/// outcome the connection is closed.
pub(super) async fn join(
    thread: JoinHandle<Finished>,
    line: &Line,
    patience: &Patience,
) -> Result<HapticOutcome, MasterHostError> {
    let error = match thread.join() {
        Ok(Ok(outcome)) => return Ok(outcome),
        Ok(Err(reason)) => MasterHostError::Loop(reason),
        Err(_) => MasterHostError::Panicked,
    };
    line.close("the master's haptic loop failed", patience.idle)
        .await;
    Err(error)
}

/// Logs what the host granted the haptic thread.
async fn tell(granted: oneshot::Receiver<RealTime>) {
    if let Ok(granted) = granted.await {
        let all = granted.fifo.granted() && granted.memory.granted() && granted.slack.granted();
        match all {
            true => tracing::info!("haptic loop: {granted}"),
            false => tracing::warn!("haptic loop: {granted}"),
        }
    }
}

/// What ended the session: the loop knows its own reasons, the network task the others.
fn first_cause(haptic: &HapticOutcome, noticed: Option<SessionEnd>) -> SessionEnd {
    // a loop that ended without a reason of its own was asked to
    haptic.end.or(noticed).unwrap_or(SessionEnd::Stopped)
}

/// Updates that arrived and were not applied. One that still waits when the loop has ended came too
/// late for any tick.
fn update_drops(link: &MasterLink, port: &HapticPort, haptic: &HapticOutcome) -> UpdateDrops {
    UpdateDrops {
        superseded: port.superseded(),
        frozen: haptic.frozen.saturating_add(u32::from(port.untaken())),
        ..link.drops()
    }
}

/// The slave's answer to the master's farewell, if it came in time and could be read.
fn answer(
    said: Result<Result<ReceivedFarewell<SlaveTotals>, FarewellError>, Elapsed>,
) -> Option<ReceivedFarewell<SlaveTotals>> {
    match said {
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
