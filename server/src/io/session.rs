//! One session: from the welcome to the farewells, on tokio's side.
//!
//! Begins with the slave that the hello asks for, ends with the report. It decides nothing about the model.

pub(super) mod end;

use std::pin::Pin;
use std::time::Duration;

use mmt_netem::io::socket::SocketCounters;
use mmt_shared::channel::peer::NumbersSpent;
use mmt_shared::io::clock::Clock;
use mmt_shared::io::farewell::{
    FAREWELL_WAIT, FarewellError, ReceivedFarewell, answer, farewell_wait, receive_farewell,
    send_farewell,
};
use mmt_shared::io::loop_thread::{self, LoopSide};
use mmt_shared::io::network_task::{Event, NetworkTask};
use mmt_shared::io::ticker::Ticker;
use mmt_shared::io::transport::{
    CLOSE_FINISHED, CLOSE_TAKEN_OVER, Connection, RecvStream, SendStream,
};
use mmt_shared::io::wish::Wish;
use mmt_shared::model::contact::Coupling;
use mmt_shared::pairing::TokenName;
use mmt_shared::report::{MasterHalf, SlaveHalf};
use mmt_shared::wire::{Ending, Hello, Refusal, Side};
use tokio::sync::watch;
use tokio::time::sleep;

use super::acceptor::{Admitted, refuse};
use super::context::{Context, SlaveHostError};
use super::lease::Lease;
use super::plant_link::PlantHost;
use super::slave_loop::{Finished, SlaveLoop, Snapshot};
use super::welcome::welcome;
use super::{PROGRAM, SlaveLive, SlaveReport, record};
use crate::end::{DISENGAGE, SlaveEnd, session_config};
use crate::slave::{Memory, SlaveConfig};

use end::{End, SILENCE_MAX};

/// What the read of the master's farewell gives.
type MastersFarewell = Result<ReceivedFarewell<MasterHalf>, FarewellError>;

/// How long the loop may take to end: a tick, or what a stopped or crowded host makes of it.
const LOOP_WAIT: Duration = Duration::from_secs(5);
/// The loop's thread.
const THREAD: &str = "mmt-slave";

/// A session that is over.
pub(super) struct Served {
    pub(super) report: SlaveReport,
    /// What the next session goes on with.
    pub(super) memory: Memory,
    /// Whether it ended because another operator has taken over.
    pub(super) taken_over: bool,
}

/// A session that has begun.
struct Session<'a> {
    context: &'a Context,
    config: SlaveConfig,
    connection: Connection,
    send: SendStream,
    task: NetworkTask<Snapshot, Finished>,
    socket_before: SocketCounters,
    lease: Lease,
    /// As it was shown last.
    plant_silent: bool,
}

/// Serves an admitted master, from where an `earlier` session ended. Nothing if no session came about.
/// `socket_before` is what the socket had counted when nobody had connected for this session yet: the handshake is
/// part of what a session costs.
pub(super) async fn serve(
    context: &Context,
    admitted: Admitted,
    earlier: Option<&Memory>,
    socket_before: SocketCounters,
    stop: &mut watch::Receiver<Wish>,
    live: &watch::Sender<SlaveLive>,
) -> Result<Option<Served>, SlaveHostError> {
    let body = |slave_loop: SlaveLoop, side, ticker, clock| slave_loop.run(side, ticker, clock);
    serve_with(context, admitted, earlier, socket_before, stop, live, body).await
}

/// Serves with a loop of the caller's making.
pub(super) async fn serve_with(
    context: &Context,
    admitted: Admitted,
    earlier: Option<&Memory>,
    socket_before: SocketCounters,
    stop: &mut watch::Receiver<Wish>,
    live: &watch::Sender<SlaveLive>,
    body: impl FnOnce(SlaveLoop, LoopSide<Snapshot>, Ticker, Clock) -> Finished + Send + 'static,
) -> Result<Option<Served>, SlaveHostError> {
    let Admitted {
        connection,
        mut send,
        receive,
        hello,
        name,
        lease,
    } = admitted;
    let clock = context.clock;
    let began = clock.now();
    let plugged_in = context
        .plant
        .as_ref()
        .and_then(|plant| plant.memory(&context.config, earlier));
    let earlier = plugged_in.as_ref().or(earlier);
    let end = match SlaveEnd::of_session(began, &context.config, &hello, earlier) {
        Ok(end) => end,
        Err(error) => {
            tracing::warn!("no slave for a device of {:?}: {error}", hello.coupling);
            refuse(&connection, send, Refusal::BadHello).await;
            return Ok(None);
        }
    };
    let scheme = context.config.trigger.scheme.to_string();
    let greeting = end.slave().welcome(lease.resume(), &scheme, PROGRAM);
    if welcome(&connection, &mut send, &greeting).await.is_err() {
        return Ok(None);
    }
    announce(&connection, &name, &hello);
    context.observers.session_begins(&greeting);
    let mut slave_loop = SlaveLoop::new(end, context.take_truth(), context.emergency.clone());
    let plant = context.plant.as_ref().map(PlantHost::port);
    slave_loop = slave_loop.plugged_into(plant);
    if let Some(recorder) = &context.record {
        slave_loop = slave_loop.recorded(record::begin(recorder, context, began, &hello, earlier));
    }
    let body = move |side, ticker| body(slave_loop, side, ticker, clock);
    let handle = loop_thread::spawn(THREAD, clock, &Snapshot::default(), body)?;
    let session = Session {
        context,
        config: session_config(&context.config, &hello),
        task: NetworkTask::new(clock, connection.clone(), handle),
        connection,
        send,
        socket_before,
        lease,
        plant_silent: false,
    };
    session.operate(receive, stop, live).await.map(Some)
}

fn announce(connection: &Connection, name: &TokenName, hello: &Hello) {
    let (address, program) = (connection.remote_address(), hello.program);
    let architecture = hello.architecture.name();
    let Coupling {
        stiffness_n_per_m,
        damping_ns_per_m,
    } = hello.coupling;
    tracing::info!(
        "{address} operates as {name} ({program}, {architecture}, device of {stiffness_n_per_m} N/m and {damping_ns_per_m} N s/m)"
    );
}

impl Session<'_> {
    /// Goes on until somebody ends it; then sends the farewell and reports.
    async fn operate(
        mut self,
        mut receive: RecvStream,
        stop: &mut watch::Receiver<Wish>,
        live: &watch::Sender<SlaveLive>,
    ) -> Result<Served, SlaveHostError> {
        let began = self.context.clock.now();
        let farewell = receive_farewell(&mut receive, Side::Master);
        tokio::pin!(farewell);
        let end = self.until_end(farewell.as_mut(), stop, live).await;
        tracing::info!("{}: {end}", self.connection.remote_address());
        let finished = match end {
            End::LoopFailed => None,
            _ => self.task.stop_loop(LOOP_WAIT).await,
        };
        let ending = match &end {
            _ if finished.is_none() => Ending::Failed,
            End::Asked | End::TakenOver => Ending::Interrupted,
            End::Farewell(theirs) => theirs.ending,
            _ => Ending::Failed,
        };
        let duration = self.context.clock.now().saturating_since(began);
        let duration_s = duration.as_secs_f64();
        let own = finished
            .as_ref()
            .map(|finished| self.half(finished, duration_s));
        let taken_over = matches!(end, End::TakenOver);
        let disengaged = matches!(end, End::Disengaged);
        let theirs = if taken_over {
            (self.connection).close(CLOSE_TAKEN_OVER, b"another operator has taken over");
            None
        } else {
            self.part(end, ending, own.as_ref(), farewell).await
        };
        let memory = finished
            .as_ref()
            .map(|finished| finished.end.slave().memory());
        let (Some(own), Some(memory)) = (own, memory) else {
            return Err(SlaveHostError::of_loop(self.task.handle()));
        };
        if disengaged {
            tokio::spawn(self.lease.outlive(SILENCE_MAX.saturating_sub(DISENGAGE)));
        }
        Ok(Served {
            report: SlaveReport {
                seed: self.config.seed,
                duration_s,
                ending,
                own,
                other: theirs.and_then(|theirs| theirs.report),
                configuration: self.context.configuration(&self.config),
            },
            memory,
            taken_over,
        })
    }

    /// Sends the farewell and waits for the master's, and for its close: one of ours could overtake our farewell.
    async fn part<F>(
        &mut self,
        end: End,
        ending: Ending,
        own: Option<&SlaveHalf>,
        farewell: Pin<&mut F>,
    ) -> Option<ReceivedFarewell<MasterHalf>>
    where
        F: Future<Output = MastersFarewell>,
    {
        let nothing = SlaveHalf::default();
        let report = own.unwrap_or(&nothing);
        let wait = farewell_wait(&self.connection, FAREWELL_WAIT);
        let sent = send_farewell(&mut self.send, ending, report, wait).await;
        let theirs = async {
            match end {
                End::Farewell(theirs) => Some(*theirs),
                // Nothing can come any more.
                End::Stream(_) => None,
                _ if sent.is_err() => None,
                _ => farewell.await.ok(),
            }
        };
        let theirs = answer(theirs, self.connection.closed(), sleep(wait)).await;
        self.connection
            .close(CLOSE_FINISHED, b"the session is over");
        theirs
    }

    /// Moves datagrams until something ends the session.
    async fn until_end<F>(
        &mut self,
        mut farewell: Pin<&mut F>,
        stop: &mut watch::Receiver<Wish>,
        live: &watch::Sender<SlaveLive>,
    ) -> End
    where
        F: Future<Output = MastersFarewell>,
    {
        loop {
            let event = tokio::select! {
                event = self.task.next(farewell.as_mut(), stop) => event,
                () = self.lease.taken_over() => return End::TakenOver,
            };
            match event {
                Event::Farewell(Ok(farewell)) => return End::Farewell(Box::new(farewell)),
                Event::Farewell(Err(error)) => return End::Stream(error),
                Event::Stopped(Wish::Fail) => return End::ThreadPanicked,
                Event::Stopped(_) => return End::Asked,
                Event::LoopEnded(_) => return End::LoopFailed,
                Event::Disconnected(error) => return End::Disconnected(error),
                Event::Beat => {
                    if let Some(end) = self.beat(live) {
                        return end;
                    }
                }
            }
        }
    }

    /// Shows the newest snapshot; whether it ends the session.
    fn beat(&mut self, live: &watch::Sender<SlaveLive>) -> Option<End> {
        let now = self.context.clock.now();
        let snapshot = *self.task.handle().snapshot();
        live.send_replace(SlaveLive {
            up: snapshot.live.up.on_the_path(0, self.task.unread()),
            unsent: self.task.unsent(),
            ..snapshot.live
        });
        self.context.observers.show(&snapshot.view);
        if snapshot.plant_silent != self.plant_silent {
            self.plant_silent = snapshot.plant_silent;
            if self.plant_silent {
                tracing::warn!("the plant is silent: the tool stands, and no force is on the hand");
            }
        }
        let silent = |last_arrival| now.saturating_since(last_arrival) > SILENCE_MAX;
        if snapshot.numbers_spent {
            Some(End::Numbers(NumbersSpent))
        } else if snapshot.disengaged {
            Some(End::Disengaged)
        } else if snapshot.last_arrival.is_some_and(silent) {
            Some(End::Silence)
        } else {
            None
        }
    }

    /// What the slave counted and measured: the farewell carries it, the report prints it.
    fn half(&self, finished: &Finished, duration_s: f64) -> SlaveHalf {
        let mut half = finished.end.half(duration_s);
        let (session, peer) = (&mut half.session, self.connection.remote_address());
        session.timing = (&finished.ticker).into();
        self.task.add_to(session);
        session.add_drops(self.context.refusals());
        if let Some(plant) = &self.context.plant {
            let dropped = plant.counts().dropped();
            for (name, count) in dropped.into_iter().chain(plant.not_given()) {
                session.add_drops([(format!("plant_{name}").as_str(), count)]);
            }
        }
        let meter = &self.context.meter;
        meter.add_to(session, &self.socket_before, peer, duration_s);
        half
    }
}
