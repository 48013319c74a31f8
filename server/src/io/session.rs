//! One session: from the welcome to the farewells, on tokio's side.
//!
//! Begins with the slave that the hello asks for, ends with the report; what happens in between is
//! `traffic`'s. It decides nothing about the model.

mod end;
mod traffic;

use std::io;
use std::time::Duration;

use bytes::Bytes;
use mmt_netem::io::socket::SocketCounters;
use mmt_shared::io::clock::Clock;
use mmt_shared::io::farewell::{FAREWELL_WAIT, answer, receive_farewell, send_farewell};
use mmt_shared::io::live::LiveCell;
use mmt_shared::io::stream::WriteFrameError;
use mmt_shared::io::transport::{CLOSE_FINISHED, Connection, RecvStream, SendStream};
use mmt_shared::io::truth::TruthSender;
use mmt_shared::metrics::UpdateCounts;
use mmt_shared::model::contact::Coupling;
use mmt_shared::wire::{
    DATAGRAM_MAX, Ending, Hello, Label, Refusal, STREAM_MESSAGE_MAX, Side, StreamMessage, Welcome,
};
use tokio::sync::watch;
use tokio::time::{sleep, timeout};

use super::door::{Admitted, refuse};
use super::host::{Shared, SlaveHostError};
use super::report::{self, Outcome};
use super::worker::{Finished, Worker};
use super::{PROGRAM, SlaveLive, SlaveReport};
use crate::link::{SlaveLink, SlaveLinkConfig};
use crate::slave::{Slave, SlaveConfig};

use end::End;

/// How long the stream may take to take a message of ours.
const WRITE_WAIT: Duration = Duration::from_secs(2);
/// More datagrams than QUIC's queue holds.
const WAITING_MAX: usize = 4096;
/// How long the thread may take to end: a tick, or what a stopped or crowded host makes of it.
const WORKER_WAIT: Duration = Duration::from_secs(5);

/// What was lost on tokio's side of a session, by name.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Lost {
    /// The 1 kHz thread did not take its samples.
    pub(super) samples: u64,
    /// Updates that break a rule of the wire.
    pub(super) unsealed: u64,
    /// Longer than the path takes.
    pub(super) too_large: u64,
    /// The peer takes no datagrams, or QUIC sends none.
    pub(super) unsupported: u64,
    /// The connection was gone.
    pub(super) disconnected: u64,
    /// Not lost, but read from the connection: tells what it dropped unread.
    pub(super) read: u64,
    /// Not lost, but given to the connection: tells what it dropped unsent.
    pub(super) given: u64,
}

/// A session that has begun.
pub(super) struct Session<'a> {
    shared: &'a Shared,
    config: SlaveConfig,
    connection: Connection,
    send: SendStream,
    worker: Worker,
    link: SlaveLink,
    sent: UpdateCounts,
    lost: Lost,
    socket_before: SocketCounters,
    buffer: [u8; DATAGRAM_MAX],
}

/// Serves an admitted master. No report if no session came about. `socket_before` is what the socket had
/// counted when nobody had knocked for this session yet: the handshake is part of what a session costs.
pub(super) async fn serve(
    shared: &Shared,
    admitted: Admitted,
    socket_before: SocketCounters,
    stop: &mut watch::Receiver<bool>,
    live: &LiveCell<SlaveLive>,
) -> Result<Option<SlaveReport>, SlaveHostError> {
    serve_with(shared, admitted, socket_before, stop, live, Worker::start).await
}

/// Serves with a thread of the caller's making.
pub(super) async fn serve_with(
    shared: &Shared,
    admitted: Admitted,
    socket_before: SocketCounters,
    stop: &mut watch::Receiver<bool>,
    live: &LiveCell<SlaveLive>,
    start: impl FnOnce(Clock, Slave, Option<TruthSender>) -> io::Result<Worker>,
) -> Result<Option<SlaveReport>, SlaveHostError> {
    let Admitted {
        connection,
        mut send,
        receive,
        hello,
        lease: _lease,
    } = admitted;
    let config = SlaveConfig {
        playout: shared
            .config
            .playout
            .for_session(hello.samples_per_command, hello.architecture),
        ..shared.config.clone()
    };
    let mut slave = match Slave::try_new(&config, hello.coupling) {
        Ok(slave) => slave,
        Err(error) => {
            tracing::warn!("no slave for a device of {:?}: {error}", hello.coupling);
            refuse(&connection, send, Refusal::BadHello).await;
            return Ok(None);
        }
    };
    slave.start_at(hello.hip);
    // Datagrams from before the welcome belong to no session.
    drain(&connection, |_| ()).await;
    if let Err(error) = welcome(&mut send, &config, &slave).await {
        tracing::warn!(
            "{} left before its welcome: {error}",
            connection.remote_address()
        );
        return Ok(None);
    }
    announce(&connection, &hello);
    let worker = start(shared.clock, slave, shared.take_truth())?;
    let link = SlaveLinkConfig {
        repeats: config.repeats_ms,
        stretch_max: config.stretch_max,
        samples_per_command: hello.samples_per_command,
        architecture: hello.architecture,
        scene_hz: hello.scene_hz,
    };
    let link = SlaveLink::new(shared.clock.now(), link);
    let session = Session::new(
        shared,
        config,
        connection,
        send,
        worker,
        link,
        socket_before,
    );
    session.operate(receive, stop, live).await.map(Some)
}

/// Takes the datagrams that have arrived and were not read, without waiting for more.
async fn drain(connection: &Connection, mut take: impl FnMut(&Bytes)) {
    for _ in 0..WAITING_MAX {
        match timeout(Duration::ZERO, connection.read_datagram()).await {
            Ok(Ok(datagram)) => take(&datagram),
            _ => break,
        }
    }
}

async fn welcome(
    send: &mut SendStream,
    config: &SlaveConfig,
    slave: &Slave,
) -> Result<(), WriteFrameError> {
    let welcome = Welcome {
        settings: *slave.settings(),
        state: *slave.state(),
        scheme: Label::clipped(&config.trigger.scheme.to_string()),
        program: Label::clipped(PROGRAM),
    };
    let mut out = [0; STREAM_MESSAGE_MAX];
    // A slave that could be made has numbers that can be told.
    let welcome = StreamMessage::Welcome((&welcome).into());
    let length = welcome.encode(&mut out).unwrap_or_default();
    let message = out.get(..length).unwrap_or_default();
    send.write_frame(message, WRITE_WAIT).await
}

fn announce(connection: &Connection, hello: &Hello) {
    let (address, program) = (connection.remote_address(), hello.program);
    let architecture = hello.architecture.name();
    let Coupling {
        stiffness_n_per_m,
        damping_ns_per_m,
    } = hello.coupling;
    tracing::info!(
        "{address} operates ({program}, {architecture}, device of {stiffness_n_per_m} N/m and {damping_ns_per_m} N s/m)"
    );
}

impl<'a> Session<'a> {
    pub(super) fn new(
        shared: &'a Shared,
        config: SlaveConfig,
        connection: Connection,
        send: SendStream,
        worker: Worker,
        link: SlaveLink,
        socket_before: SocketCounters,
    ) -> Self {
        Self {
            link,
            shared,
            config,
            connection,
            send,
            worker,
            sent: UpdateCounts::default(),
            lost: Lost::default(),
            socket_before,
            buffer: [0; DATAGRAM_MAX],
        }
    }

    /// Goes on until somebody ends it; then says farewell and reports.
    pub(super) async fn operate(
        mut self,
        mut receive: RecvStream,
        stop: &mut watch::Receiver<bool>,
        live: &LiveCell<SlaveLive>,
    ) -> Result<SlaveReport, SlaveHostError> {
        let farewell = receive_farewell(&mut receive, Side::Master);
        tokio::pin!(farewell);
        let end = self.until_end(farewell.as_mut(), stop, live).await;
        tracing::info!("{}: {end}", self.connection.remote_address());
        // What came before the end counts.
        drain(&self.connection.clone(), |datagram| self.take(datagram)).await;
        let finished = self.end_worker(&end).await;
        let ending = match &end {
            _ if finished.is_none() => Ending::Failed,
            End::Asked => Ending::Interrupted,
            End::Farewell(theirs) => theirs.ending,
            _ => Ending::Failed,
        };
        let outcome = self.outcome(ending, finished);
        let totals = outcome.totals();
        let sent = send_farewell(&mut self.send, ending, &totals, FAREWELL_WAIT).await;
        let theirs = async {
            match end {
                End::Farewell(theirs) => Some(*theirs),
                // Nothing can come any more.
                End::Stream(_) => None,
                _ if sent.is_err() => None,
                _ => farewell.await.ok(),
            }
        };
        // The master closes: a close of ours could overtake our farewell.
        let theirs = answer(theirs, self.connection.closed(), sleep(FAREWELL_WAIT)).await;
        self.connection
            .close(CLOSE_FINISHED, b"the session is over");
        match outcome.finished {
            Some(_) => Ok(report::report(
                self.shared,
                &self.config,
                &outcome,
                theirs.and_then(|theirs| theirs.report).as_ref(),
            )),
            None => Err(SlaveHostError::Panicked),
        }
    }

    /// Ends the thread and takes what it hands back; none if it panicked.
    async fn end_worker(&mut self, end: &End) -> Option<Finished> {
        self.worker.stop();
        if matches!(end, End::Panicked) {
            return None;
        }
        let finished = timeout(WORKER_WAIT, &mut self.worker.finished).await;
        finished.ok().and_then(Result::ok)
    }

    fn outcome(&self, ending: Ending, finished: Option<Finished>) -> Outcome {
        let now = self.shared.clock.now();
        let passed = self.connection.datagrams();
        Outcome {
            ending,
            duration: now.saturating_since(self.link.end().began()),
            finished,
            sent: self.sent,
            link: self.link.clone(),
            lost: self.lost,
            unsent: self.lost.given.saturating_sub(passed.sent),
            unread: passed.received.saturating_sub(self.lost.read),
            before: self.socket_before,
            after: self.shared.meter.snapshot(),
            over_ipv4: self
                .connection
                .remote_address()
                .ip()
                .to_canonical()
                .is_ipv4(),
        }
    }
}
