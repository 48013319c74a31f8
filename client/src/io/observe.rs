//! An observer as a host on the network: it shows what the slave shows it, and reports.
//!
//! There is no 1 kHz loop: nobody's hand waits for it.

use std::pin::{Pin, pin};
use std::time::Duration;

use bytes::Bytes;
use mmt_netem::LinkConfig;
use mmt_netem::io::socket::{SocketCounters, SocketExtras};
use mmt_shared::channel::peer::NumbersSpent;
use mmt_shared::io::clock::Clock;
use mmt_shared::io::congestion::RateCap;
use mmt_shared::io::farewell::{
    FarewellError, ReceivedFarewell, answer, farewell_wait, receive_farewell, send_farewell,
};
use mmt_shared::io::network_task::BEAT;
use mmt_shared::io::quic::Traffic;
use mmt_shared::io::stream::delivered;
use mmt_shared::io::transport::{Connection, SendStream, Transport};
use mmt_shared::io::wish::{Wish, asked_to_stop};
use mmt_shared::model::architecture::Architecture;
use mmt_shared::model::geometry::Vec2;
use mmt_shared::pairing::Pairing;
use mmt_shared::report::{MasterHalf, MasterSession, SlaveHalf};
use mmt_shared::time::Time;
use mmt_shared::wire::{Claim, DATAGRAM_MAX, Hello, Label, Role, Side};
use serde::Serialize;
use tokio::sync::watch;
use tokio::time::{interval, sleep};

use super::open::{Connected, Opened, Opening, PROGRAM, TIMEOUTS, open};
use super::{MasterHostError, SessionEnd};
use crate::observer::{COUPLING, ObserverEnd, ObserverLive};

/// A slave from which nothing came for this long is gone (docs/protocol.md, section 2).
const SILENCE_MAX: Duration = Duration::from_secs(10);
/// An observer sends heartbeats of up to 50 bytes, 20 a second; QUIC adds 30. Twice that, with room for the handshake.
const TRAFFIC: Traffic = Traffic {
    datagram_max: 60,
    rate_cap: RateCap {
        bytes_per_s: 4 * 20 * 90,
    },
};

/// How an observer's host runs.
#[derive(Clone, Debug)]
pub struct ObserverOptions {
    /// Where the slave is, and its secrets.
    pub pairing: Pairing,
    /// What carries the session; the slave's must be the same.
    pub transport: Transport,
    /// How long; until a person or the slave ends it if absent.
    pub duration: Option<Duration>,
    /// Scenes that somebody wants to see, 1/s, 0 to 60.
    pub scene_hz: u8,
    /// Emulated network on what the observer sends.
    pub netem: LinkConfig,
    /// Seed of the emulated network.
    pub netem_seed: u64,
    /// Record and control of the emulated network.
    pub netem_extras: SocketExtras,
}

/// The configuration as the report shows it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ObserverConfiguration {
    /// The slave's address.
    pub slave: String,
    /// What carried the session: `quic` or `udp`.
    pub transport: &'static str,
    /// `observer`.
    pub role: Role,
    /// Scenes that it asked for, 1/s.
    pub scene_hz: u8,
    /// Emulated network on what it sent.
    pub netem: String,
}

/// An observer's session: what it received and, by the slave's farewell, what it was sent.
pub type ObserverReport = MasterSession<ObserverConfiguration>;

/// What the read of the slave's farewell gives.
type FarewellRead = Result<ReceivedFarewell<SlaveHalf>, FarewellError>;

/// Looks on at the slave of a pairing string until the duration is over, `stop` becomes true, or the slave or the network ends
/// it. `live` gets what there is to be seen, 62 times a second. Returns the report, and why it ended.
///
/// Call it inside of a tokio runtime with I/O and time.
///
/// # Errors
/// The slave did not let it look on; see [`MasterHostError`].
pub async fn observe(
    options: ObserverOptions,
    mut stop: watch::Receiver<Wish>,
    live: watch::Sender<ObserverLive>,
) -> Result<(ObserverReport, SessionEnd), MasterHostError> {
    let opening = opening(&options);
    let opened = tokio::select! {
        opened = open(&opening, &TIMEOUTS) => opened?,
        _ = asked_to_stop(&mut stop) => return Err(MasterHostError::Interrupted),
    };
    let Opened {
        connected,
        mut send,
        mut receive,
        welcome,
    } = opened;
    tracing::info!(
        slave = %connected.address, program = %welcome.program, scheme = %welcome.scheme,
        "the session begins: this observer looks on"
    );
    let clock = Clock::start();
    let mut sight = Sight {
        clock,
        end: ObserverEnd::new(clock.now(), &welcome),
        connection: &connected.connection,
        read: 0,
    };
    let mut farewell = pin!(receive_farewell(&mut receive, Side::Slave));
    let over = pin!(over(options.duration));
    let (why, theirs) = sight
        .until_end(farewell.as_mut(), &mut stop, over, &live)
        .await;
    tracing::info!("the session ends: {why}");
    let theirs = match why {
        SessionEnd::ConnectionLost | SessionEnd::Revoked | SessionEnd::StreamBroken => None,
        _ => part(why, &sight, &mut send, theirs, farewell).await,
    };
    connected.close(&why.to_string(), TIMEOUTS.idle).await;
    let duration_s = sight.duration_s();
    let report = ObserverReport {
        seed: options.netem_seed,
        duration_s,
        ending: why.ending(),
        own: metered(sight.half(), &connected, duration_s),
        other: theirs.and_then(|theirs| theirs.report),
        configuration: (&options).into(),
    };
    Ok((report, why))
}

fn opening(options: &ObserverOptions) -> Opening {
    Opening {
        pairing: options.pairing.clone(),
        transport: options.transport,
        netem: options.netem.clone(),
        netem_seed: options.netem_seed,
        netem_extras: options.netem_extras.clone(),
        traffic: TRAFFIC,
        hello: Hello {
            token: options.pairing.token,
            role: Role::Observer,
            claim: Claim::IfFree,
            coupling: COUPLING,
            samples_per_command: 1,
            architecture: Architecture::Mmt,
            scene_hz: options.scene_hz,
            hip: Vec2::zeros(),
            program: Label::clipped(PROGRAM),
        },
    }
}

/// Returns when the duration is over; never if there is none.
async fn over(duration: Option<Duration>) {
    match duration {
        Some(duration) => sleep(duration).await,
        None => std::future::pending().await,
    }
}

/// Sends the farewell, and waits for the slave's if it has not come.
async fn part<F: Future<Output = FarewellRead>>(
    why: SessionEnd,
    sight: &Sight<'_>,
    send: &mut SendStream,
    theirs: Option<ReceivedFarewell<SlaveHalf>>,
    farewell: Pin<&mut F>,
) -> Option<ReceivedFarewell<SlaveHalf>> {
    let wait = farewell_wait(sight.connection, TIMEOUTS.farewell);
    let sent = send_farewell(send, why.ending(), &sight.half(), wait).await;
    if theirs.is_some() {
        // a close of ours could overtake the farewell
        delivered(send, wait).await;
        return theirs;
    }
    sent.ok()?;
    let read = async { farewell.await.ok() };
    answer(read, std::future::ready(()), sleep(wait)).await
}

/// The half with what the socket counted.
fn metered(mut half: MasterHalf, connected: &Connected, duration_s: f64) -> MasterHalf {
    let (meter, before) = (&connected.meter, SocketCounters::default());
    meter.add_to(&mut half.session, &before, connected.address, duration_s);
    half
}

/// A session that goes on.
struct Sight<'a> {
    clock: Clock,
    end: ObserverEnd,
    connection: &'a Connection,
    /// Datagrams read from the connection.
    read: u64,
}

impl Sight<'_> {
    /// Moves datagrams until something ends the session; then why, and the slave's farewell if that is the reason.
    async fn until_end<F: Future<Output = FarewellRead>>(
        &mut self,
        mut farewell: Pin<&mut F>,
        stop: &mut watch::Receiver<Wish>,
        mut over: Pin<&mut impl Future<Output = ()>>,
        live: &watch::Sender<ObserverLive>,
    ) -> (SessionEnd, Option<ReceivedFarewell<SlaveHalf>>) {
        let mut beat = interval(BEAT);
        loop {
            let now = self.clock.now();
            if self.send(now).is_err() {
                return (SessionEnd::ConnectionLost, None);
            }
            if self.is_silent(now) {
                return (SessionEnd::SlaveSilent, None);
            }
            let rest = self.end.poll_timeout().saturating_since(now);
            tokio::select! {
                biased;
                read = farewell.as_mut() => return self.farewell(read),
                wish = asked_to_stop(stop) => return (wish.into(), None),
                () = over.as_mut() => return (SessionEnd::DurationOver, None),
                _ = beat.tick() => {
                    live.send_replace(self.end.live(self.clock.now()));
                }
                () = sleep(rest) => {}
                datagram = self.connection.read_datagram() => match datagram {
                    Ok(bytes) => {
                        self.read += 1;
                        self.end.handle_datagram(self.clock.now(), &bytes);
                    }
                    Err(_) => return (self.loss(), None),
                },
            }
        }
    }

    fn farewell(&self, read: FarewellRead) -> (SessionEnd, Option<ReceivedFarewell<SlaveHalf>>) {
        match read {
            Ok(theirs) => (SessionEnd::SlaveEnded(theirs.ending), Some(theirs)),
            Err(error) if error.is_loss() => (self.loss(), None),
            Err(error) => {
                tracing::error!(%error, "the slave's farewell");
                (SessionEnd::StreamBroken, None)
            }
        }
    }

    /// Why the connection is gone.
    fn loss(&self) -> SessionEnd {
        if self.connection.is_revoked() {
            SessionEnd::Revoked
        } else {
            SessionEnd::ConnectionLost
        }
    }

    fn is_silent(&self, now: Time) -> bool {
        now.saturating_since(self.end.channel().last_arrival()) > SILENCE_MAX
    }

    fn send(&mut self, now: Time) -> Result<(), NumbersSpent> {
        let mut out = [0; DATAGRAM_MAX];
        while let Some(length) = self.end.poll_transmit(now, &mut out)? {
            let bytes = out.get(..length).unwrap_or_default();
            // what is not sent is counted as unsent
            let _ = self.connection.send_datagram(Bytes::copy_from_slice(bytes));
        }
        Ok(())
    }

    fn duration_s(&self) -> f64 {
        let began = self.end.channel().began();
        self.clock.now().saturating_since(began).as_secs_f64()
    }

    fn half(&self) -> MasterHalf {
        let mut half = self.end.half(self.duration_s());
        let (passed, made) = (self.connection.datagrams(), self.end.channel().counts());
        half.session.unsent = Some(made.sent.total().saturating_sub(passed.sent));
        half.session.unread = Some(passed.received.saturating_sub(self.read));
        half
    }
}

impl From<&ObserverOptions> for ObserverConfiguration {
    fn from(options: &ObserverOptions) -> Self {
        Self {
            slave: options.pairing.address.to_string(),
            transport: options.transport.name(),
            role: Role::Observer,
            scene_hz: options.scene_hz,
            netem: options.netem.to_string(),
        }
    }
}
