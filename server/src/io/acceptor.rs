//! The acceptor: who connects is judged here, beside the session that may be going on.
//!
//! The order is the protocol's: token, role, ranges, whether another master operates. Who is refused gets the reason and is
//! counted; nobody waits for anybody else. No session begins here; an observer, who is in nobody's way, is served at once.

use std::net::SocketAddr;
use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use mmt_shared::io::identity_file::{Granted, TokenList};
use mmt_shared::io::stream::{ReadFrameError, delivered, read_frame, write_message};
use mmt_shared::io::transport::{
    CLOSE_FINISHED, CLOSE_NO_HELLO, CLOSE_NOT_A_HELLO, Connection, ConnectionError, Handshake,
    Listener, RecvStream, SendStream,
};
use mmt_shared::io::wish::Wish;
use mmt_shared::pairing::{Token, TokenName};
use mmt_shared::wire::{
    DecodeError, Hello, Refusal, Role, STREAM_MESSAGE_MAX, Side, StreamMessage,
};
use tokio::sync::{OwnedSemaphorePermit, mpsc, watch};
use tokio::task::{JoinError, JoinSet};
use tokio::time::timeout;

use super::crowd::{Crowd, Place};
use super::lease::{Lease, Leases};
use super::observer_session::{self, Observer};
use super::observers::Observers;

/// A hello may take this long after the handshake: two round trips of 2 s and the wait for a lost packet.
const HELLO_WAIT: Duration = Duration::from_secs(8);
/// Beyond the round trip it may take this long where many come.
const DENSE_HELLO_WAIT: Duration = Duration::from_secs(2);
/// How long a refusal may take to arrive before the connection is closed all the same.
const REFUSAL_WAIT: Duration = Duration::from_secs(2);
/// A master that may operate.
pub(super) struct Admitted {
    pub(super) connection: Connection,
    pub(super) send: SendStream,
    pub(super) receive: RecvStream,
    pub(super) hello: Hello,
    /// Whose token it has.
    pub(super) name: TokenName,
    pub(super) lease: Lease,
}

/// What whoever is let in may be.
enum Admission {
    Operator(Lease),
    Observer(OwnedSemaphorePermit),
}

/// Masters that were not let in, by reason, since the host was started.
#[derive(Debug, Default)]
pub(super) struct Refusals {
    pub(super) busy: AtomicU64,
    pub(super) wrong_token: AtomicU64,
    pub(super) bad_hello: AtomicU64,
    pub(super) ending: AtomicU64,
    pub(super) wrong_role: AtomicU64,
    /// Observers for whom there was no place.
    pub(super) observers_full: AtomicU64,
    /// Handshakes that failed, other versions included.
    pub(super) handshake: AtomicU64,
    /// Connected, and then no hello that can be read.
    pub(super) no_hello: AtomicU64,
    /// Had to leave before a token was shown, for others who came.
    pub(super) crowded: AtomicU64,
    /// Judged, or looking on, when the task for it panicked: our bug.
    pub(super) panicked: AtomicU64,
}

impl Refusals {
    /// Counts somebody who wanted to be `role`.
    fn count(&self, refusal: Refusal, role: Role) {
        count(match (refusal, role) {
            (Refusal::Busy, Role::Observer) => &self.observers_full,
            (Refusal::Busy, Role::Operator) => &self.busy,
            (Refusal::WrongToken, _) => &self.wrong_token,
            (Refusal::BadHello, _) => &self.bad_hello,
            (Refusal::Ending, _) => &self.ending,
            (Refusal::WrongRole, _) => &self.wrong_role,
        });
    }
}

/// What the judges share.
#[derive(Clone)]
pub(super) struct Acceptor {
    tokens: TokenList,
    crowd: Crowd,
    leases: Leases,
    observers: Arc<Observers>,
    refusals: Arc<Refusals>,
    stop: watch::Receiver<Wish>,
    admitted: mpsc::Sender<Admitted>,
}

/// Why somebody who connected was not let in.
#[derive(Debug, thiserror::Error)]
enum HandshakeError {
    #[error("it opened no stream: {0}")]
    NoStream(#[from] ConnectionError),
    #[error("no hello came within {0:.1?}")]
    Silent(Duration),
    #[error("others came, and it had shown no token")]
    Crowded,
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
        tokens: TokenList,
        observers: Arc<Observers>,
        refusals: Arc<Refusals>,
        stop: watch::Receiver<Wish>,
    ) -> (Self, mpsc::Receiver<Admitted>) {
        let (admitted, receiver) = mpsc::channel(1);
        let acceptor = Self {
            tokens,
            crowd: Crowd::default(),
            leases: Leases::new(),
            observers,
            refusals,
            stop,
            admitted,
        };
        (acceptor, receiver)
    }

    /// Judges everybody who connects until the endpoint is closed. Dropping it drops who is being judged.
    pub(super) async fn run(self, listener: Arc<Listener>) {
        self.run_with(listener, Self::judge).await;
    }

    /// The same with a judge of the caller's making.
    pub(super) async fn run_with<J>(
        self,
        listener: Arc<Listener>,
        judge: impl Fn(Self, Handshake, Place) -> J,
    ) where
        J: Future<Output = ()> + Send + 'static,
    {
        let mut judged = JoinSet::new();
        loop {
            tokio::select! {
                handshake = listener.next() => {
                    let Some(handshake) = handshake else { return };
                    let place = self.crowd.enter(&handshake.address());
                    judged.spawn(judge(self.clone(), handshake, place));
                }
                Some(ended) = judged.join_next() => self.note_end(&ended),
            }
        }
    }

    /// A task that panicked ends nothing else: nobody who finds a bug of ours may end the owner's session.
    fn note_end(&self, ended: &Result<(), JoinError>) {
        if ended.as_ref().is_err_and(JoinError::is_panic) {
            count(&self.refusals.panicked);
            tracing::error!("the task of a connection panicked: please report what stands above");
        }
    }

    pub(super) async fn judge(self, handshake: Handshake, place: Place) {
        let address = handshake.address();
        let finished = tokio::select! {
            finished = handshake.finish() => finished,
            () = place.lost() => {
                count(&self.refusals.crowded);
                tracing::warn!("{address} was not let in: {}", HandshakeError::Crowded);
                return;
            }
        };
        let connection = match finished {
            Ok(connection) => connection,
            Err(error) => {
                count(&self.refusals.handshake);
                tracing::warn!("{error}");
                return;
            }
        };
        let hello = tokio::select! {
            hello = self.hello_in_time(&connection) => hello,
            () = place.lost() => Err(HandshakeError::Crowded),
        };
        match hello {
            Ok((send, receive, hello)) => {
                self.answer(place, connection, send, receive, &hello).await;
            }
            Err(error) => self.no_hello(address, &connection, &error),
        }
    }

    async fn hello_in_time(
        &self,
        connection: &Connection,
    ) -> Result<(SendStream, RecvStream, Hello), HandshakeError> {
        let dense = DENSE_HELLO_WAIT + connection.round_trip();
        let mut hello = pin!(hello_of(connection));
        if let Ok(hello) = timeout(dense, &mut hello).await {
            return hello;
        }
        if self.crowd.is_dense() {
            return Err(HandshakeError::Silent(dense));
        }
        let rest = HELLO_WAIT.saturating_sub(dense);
        let hello = timeout(rest, hello).await;
        hello.unwrap_or(Err(HandshakeError::Silent(HELLO_WAIT.max(dense))))
    }

    fn no_hello(&self, address: SocketAddr, connection: &Connection, why: &HandshakeError) {
        count(match why {
            HandshakeError::Crowded => &self.refusals.crowded,
            _ => &self.refusals.no_hello,
        });
        tracing::warn!("{address} was not let in: {why}");
        let code = match why {
            HandshakeError::NoStream(_)
            | HandshakeError::Silent(_)
            | HandshakeError::Crowded
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
        place: Place,
        connection: Connection,
        send: SendStream,
        receive: RecvStream,
        hello: &Hello,
    ) {
        let address = connection.remote_address();
        let granted = self.tokens.grants(&hello.token).await;
        // whoever has a token is no stranger any more
        let stranger = granted.is_none().then_some(place);
        match self.verdict(address, hello, granted).await {
            Ok((hello, name, Admission::Observer(place))) => {
                let observer = Observer {
                    connection,
                    send,
                    receive,
                    hello,
                    name,
                    place,
                };
                observer_session::serve(&self.observers, observer, &self.tokens).await;
            }
            Ok((hello, name, Admission::Operator(lease))) => {
                let admitted = Admitted {
                    connection,
                    send,
                    receive,
                    hello,
                    name,
                    lease,
                };
                // Nobody takes it if the host has just ended; dropping it closes the connection.
                let _ = self.admitted.send(admitted).await;
            }
            Err(refusal) => {
                tracing::warn!("{address} was refused: {refusal:?}");
                self.refusals.count(refusal, hello.role);
                let refused = refuse(&connection, send, refusal);
                match stranger {
                    Some(place) => tokio::select! {
                        () = refused => {}
                        () = place.lost() => {}
                    },
                    None => refused.await,
                }
            }
        }
    }

    async fn verdict(
        &self,
        address: SocketAddr,
        hello: &Hello,
        granted: Option<Granted>,
    ) -> Result<(Hello, TokenName, Admission), Refusal> {
        let Granted { name, role } = granted.ok_or(Refusal::WrongToken)?;
        if !role.permits(hello.role) {
            tracing::warn!("{address} has the token {name}, of an {}", role.name());
            return Err(Refusal::WrongRole);
        }
        let hello = hello.accept().map_err(|error| {
            tracing::warn!("the hello of {address}: {error}");
            Refusal::BadHello
        })?;
        if self.stop.borrow().ends() {
            return Err(Refusal::Ending);
        }
        if hello.role == Role::Observer {
            let place = self.observers.enter()?;
            return Ok((hello, name, Admission::Observer(place)));
        }
        let resume = Token::generate().map_err(|error| {
            tracing::error!("{error}");
            Refusal::Busy
        })?;
        let lease = self.leases.claim(&hello.claim, resume).await;
        let lease = lease.ok_or(Refusal::Busy)?;
        Ok((hello, name, Admission::Operator(lease)))
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
