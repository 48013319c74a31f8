//! The acceptor: who connects is judged here, beside the session that may be going on.
//!
//! The order is the protocol's: token, ranges, whether another master operates. Who is refused gets the reason and is
//! counted; nobody waits for anybody else. No session begins here.

use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use mmt_shared::io::stream::{ReadFrameError, delivered, read_frame, write_message};
use mmt_shared::io::transport::{
    CLOSE_FINISHED, CLOSE_NO_HELLO, CLOSE_NOT_A_HELLO, Connection, ConnectionError, Handshake,
    Listener, RecvStream, SendStream,
};
use mmt_shared::pairing::Token;
use mmt_shared::wire::{DecodeError, Hello, Refusal, STREAM_MESSAGE_MAX, Side, StreamMessage};
use tokio::sync::{mpsc, watch};
use tokio::task::JoinSet;
use tokio::time::timeout;

use super::lease::{Lease, Leases};

/// A hello may take this long after the handshake: two round trips of 2 s and the wait for a lost packet.
const HELLO_WAIT: Duration = Duration::from_secs(8);
/// How long a refusal may take to arrive before the connection is closed all the same.
const REFUSAL_WAIT: Duration = Duration::from_secs(2);
/// Who has finished the handshake and not yet sent a hello: more are turned away.
const JUDGED_AT_ONCE: usize = 16;

/// A master that may operate.
pub(super) struct Admitted {
    pub(super) connection: Connection,
    pub(super) send: SendStream,
    pub(super) receive: RecvStream,
    pub(super) hello: Hello,
    pub(super) lease: Lease,
}

/// Masters that were not let in, by reason, since the host was started.
#[derive(Debug, Default)]
pub(super) struct Refusals {
    pub(super) busy: AtomicU64,
    pub(super) wrong_token: AtomicU64,
    pub(super) bad_hello: AtomicU64,
    pub(super) ending: AtomicU64,
    /// Handshakes that failed, other versions included.
    pub(super) handshake: AtomicU64,
    /// Connected, and then no hello that can be read.
    pub(super) no_hello: AtomicU64,
    /// Too many at once.
    pub(super) crowded: AtomicU64,
}

/// What the judges share.
#[derive(Clone)]
pub(super) struct Acceptor {
    token: Token,
    leases: Leases,
    refusals: Arc<Refusals>,
    stop: watch::Receiver<bool>,
    admitted: mpsc::Sender<Admitted>,
}

/// Why somebody who connected was not let in.
#[derive(Debug, thiserror::Error)]
enum HandshakeError {
    #[error("it opened no stream: {0}")]
    NoStream(#[from] ConnectionError),
    #[error("no hello came within {HELLO_WAIT:?}")]
    Silent,
    #[error("no hello could be read: {0}")]
    Unread(#[from] ReadFrameError),
    #[error("its hello is malformed: {0}")]
    Malformed(#[from] DecodeError),
    #[error("its first message is no hello")]
    NoHello,
}

impl Acceptor {
    /// An acceptor that hands admitted masters to the receiver, one at a time.
    pub(super) fn new(
        token: Token,
        refusals: Arc<Refusals>,
        stop: watch::Receiver<bool>,
    ) -> (Self, mpsc::Receiver<Admitted>) {
        let (admitted, receiver) = mpsc::channel(1);
        let acceptor = Self {
            token,
            leases: Leases::new(),
            refusals,
            stop,
            admitted,
        };
        (acceptor, receiver)
    }

    /// Judges everybody who connects until the endpoint is closed. Dropping it drops who is being judged.
    pub(super) async fn run(self, listener: Arc<Listener>) {
        let mut judged = JoinSet::new();
        while let Some(handshake) = listener.next().await {
            while judged.try_join_next().is_some() {}
            if judged.len() < JUDGED_AT_ONCE {
                judged.spawn(self.clone().judge(handshake));
            } else {
                count(&self.refusals.crowded);
            }
        }
    }

    async fn judge(self, handshake: Handshake) {
        let address = handshake.address();
        let connection = match handshake.finish().await {
            Ok(connection) => connection,
            Err(error) => {
                count(&self.refusals.handshake);
                tracing::warn!("{error}");
                return;
            }
        };
        match timeout(HELLO_WAIT, hello_of(&connection)).await {
            Ok(Ok((send, receive, hello))) => {
                self.answer(address, connection, send, receive, &hello)
                    .await;
            }
            Ok(Err(error)) => self.no_hello(address, &connection, &error),
            Err(_) => self.no_hello(address, &connection, &HandshakeError::Silent),
        }
    }

    fn no_hello(&self, address: SocketAddr, connection: &Connection, why: &HandshakeError) {
        count(&self.refusals.no_hello);
        tracing::warn!("{address} was not let in: {why}");
        let code = match why {
            HandshakeError::NoStream(_)
            | HandshakeError::Silent
            | HandshakeError::Unread(
                ReadFrameError::Finished | ReadFrameError::Slow { .. } | ReadFrameError::Stream(_),
            ) => CLOSE_NO_HELLO,
            HandshakeError::Unread(ReadFrameError::Truncated | ReadFrameError::TooLong { .. })
            | HandshakeError::Malformed(_)
            | HandshakeError::NoHello => CLOSE_NOT_A_HELLO,
        };
        connection.close(code, why.to_string().as_bytes());
    }

    async fn answer(
        self,
        address: SocketAddr,
        connection: Connection,
        send: SendStream,
        receive: RecvStream,
        hello: &Hello,
    ) {
        match self.verdict(address, hello).await {
            Ok((hello, lease)) => {
                let admitted = Admitted {
                    connection,
                    send,
                    receive,
                    hello,
                    lease,
                };
                // Nobody takes it if the host has just ended; dropping it closes the connection.
                let _ = self.admitted.send(admitted).await;
            }
            Err(refusal) => {
                tracing::warn!("{address} was refused: {refusal:?}");
                count(match refusal {
                    Refusal::Busy => &self.refusals.busy,
                    Refusal::WrongToken => &self.refusals.wrong_token,
                    Refusal::BadHello => &self.refusals.bad_hello,
                    Refusal::Ending => &self.refusals.ending,
                });
                refuse(&connection, send, refusal).await;
            }
        }
    }

    async fn verdict(&self, address: SocketAddr, hello: &Hello) -> Result<(Hello, Lease), Refusal> {
        if hello.token != self.token {
            return Err(Refusal::WrongToken);
        }
        let hello = hello.accept().map_err(|error| {
            tracing::warn!("the hello of {address}: {error}");
            Refusal::BadHello
        })?;
        if *self.stop.borrow() {
            return Err(Refusal::Ending);
        }
        let resume = Token::generate().map_err(|error| {
            tracing::error!("{error}");
            Refusal::Busy
        })?;
        let lease = self.leases.claim(&hello.claim, resume).await;
        lease.map_or(Err(Refusal::Busy), |lease| Ok((hello, lease)))
    }
}

/// Refuses, and gives the refusal some time to arrive: a close overtakes what the stream still holds.
pub(super) async fn refuse(connection: &Connection, mut send: SendStream, refusal: Refusal) {
    let message = StreamMessage::Refused(refusal);
    let written = write_message(&mut send, &message, REFUSAL_WAIT).await;
    if written.is_ok() && send.finish().is_ok() {
        delivered(&send, REFUSAL_WAIT).await;
    }
    connection.close(CLOSE_FINISHED, b"refused");
}

async fn hello_of(
    connection: &Connection,
) -> Result<(SendStream, RecvStream, Hello), HandshakeError> {
    let (send, mut receive) = connection.accept_bi().await?;
    let frame = read_frame(&mut receive, STREAM_MESSAGE_MAX, HELLO_WAIT).await?;
    match StreamMessage::decode(&frame, Side::Master)? {
        StreamMessage::Hello(hello) => Ok((send, receive, hello)),
        _ => Err(HandshakeError::NoHello),
    }
}

fn count(counter: &AtomicU64) {
    counter.fetch_add(1, Ordering::Relaxed);
}
