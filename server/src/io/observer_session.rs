//! One observer's session: from its welcome to its farewell, on tokio's side.
//!
//! Its end is nobody else's: the operator's session does not depend on it.

use std::pin::{Pin, pin};
use std::time::Duration;

use bytes::Bytes;
use mmt_shared::channel::peer::NumbersSpent;
use mmt_shared::io::farewell::{
    FAREWELL_WAIT, FarewellError, ReceivedFarewell, answer, farewell_wait, receive_farewell,
    send_farewell,
};
use mmt_shared::io::identity_file::TokenList;
use mmt_shared::io::transport::{
    CLOSE_FINISHED, CLOSE_REVOKED, Connection, ConnectionError, RecvStream, SendStream,
};
use mmt_shared::io::wish::Wish;
use mmt_shared::pairing::{Token, TokenName};
use mmt_shared::report::{MasterHalf, SlaveHalf};
use mmt_shared::time::Time;
use mmt_shared::wire::{DATAGRAM_MAX, Ending, Hello, Side};
use tokio::sync::OwnedSemaphorePermit;
use tokio::time::sleep;

use super::observers::Observers;
use super::session::end::SILENCE_MAX;
use super::welcome::welcome;
use crate::feed::Feed;

/// Between two looks at whether an observer's token still counts.
const TOKEN_LOOK: Duration = Duration::from_secs(1);

/// What the read of an observer's farewell gives.
type ObserversFarewell = Result<ReceivedFarewell<MasterHalf>, FarewellError>;

/// An observer that may look on.
pub(super) struct Observer {
    pub(super) connection: Connection,
    pub(super) send: SendStream,
    pub(super) receive: RecvStream,
    pub(super) hello: Hello,
    /// Whose token it has.
    pub(super) name: TokenName,
    pub(super) place: OwnedSemaphorePermit,
}

/// Why an observer looks on no more.
#[derive(Debug, thiserror::Error)]
enum End {
    #[error("this side was asked to end")]
    Asked,
    #[error("a thread of this side panicked")]
    ThreadPanicked,
    #[error("it has left")]
    Farewell(Ending),
    #[error("its token was replaced or revoked")]
    Revoked,
    #[error("nothing came from it for {SILENCE_MAX:?}")]
    Silence,
    #[error("the connection was lost: {0}")]
    Disconnected(#[from] ConnectionError),
    #[error("the stream ended: {0}")]
    Stream(#[from] FarewellError),
    #[error(transparent)]
    Numbers(#[from] NumbersSpent),
}

/// Serves an observer until either side ends it.
pub(super) async fn serve(observers: &Observers, observer: Observer, tokens: &TokenList) {
    let Observer {
        connection,
        mut send,
        mut receive,
        hello,
        name,
        place: _place,
    } = observer;
    let address = connection.remote_address();
    let greeting = observers.welcome_for(hello.coupling);
    if welcome(&connection, &mut send, &greeting).await.is_err() {
        return;
    }
    tracing::info!("{address} looks on as {name} ({})", hello.program);
    let began = observers.clock().now();
    let mut sight = Sight {
        observers,
        feed: Feed::new(began, hello.scene_hz, &observers.view_now()),
        connection: &connection,
        read: 0,
    };
    let mut farewell = pin!(receive_farewell(&mut receive, Side::Master));
    let revoked = pin!(revoked(tokens, &hello.token));
    let end = sight.until_end(farewell.as_mut(), revoked).await;
    let refused = sight.feed.commands_refused();
    tracing::info!("{address} ({name}) looks on no more: {end}; commands refused: {refused}");
    if matches!(end, End::Revoked) {
        connection.close(CLOSE_REVOKED, b"the token was replaced or revoked");
        return;
    }
    let half = sight.half(began);
    part(end, &half, &connection, &mut send, farewell).await;
}

/// Returns once the token counts no more.
async fn revoked(tokens: &TokenList, token: &Token) {
    while tokens.grants(token).await.is_some() {
        sleep(TOKEN_LOOK).await;
    }
}

/// Sends the farewell and waits for the observer's, and for its close.
async fn part<F: Future<Output = ObserversFarewell>>(
    end: End,
    half: &SlaveHalf,
    connection: &Connection,
    send: &mut SendStream,
    farewell: Pin<&mut F>,
) {
    let ending = match end {
        End::Asked => Ending::Interrupted,
        End::Farewell(theirs) => theirs,
        _ => Ending::Failed,
    };
    let wait = farewell_wait(connection, FAREWELL_WAIT);
    let sent = send_farewell(send, ending, half, wait).await;
    let theirs = async {
        match end {
            End::Asked | End::ThreadPanicked | End::Silence | End::Numbers(_) if sent.is_ok() => {
                farewell.await.ok()
            }
            // it came, or nothing can come any more
            _ => None,
        }
    };
    answer(theirs, connection.closed(), sleep(wait)).await;
    connection.close(CLOSE_FINISHED, b"the session is over");
}

/// One observer's sight of the slave.
struct Sight<'a> {
    observers: &'a Observers,
    feed: Feed,
    connection: &'a Connection,
    /// Datagrams read from the connection.
    read: u64,
}

impl Sight<'_> {
    /// Sends what is new until something ends it.
    async fn until_end<F>(
        &mut self,
        mut farewell: Pin<&mut F>,
        mut revoked: Pin<&mut impl Future<Output = ()>>,
    ) -> End
    where
        F: Future<Output = ObserversFarewell>,
    {
        let clock = self.observers.clock();
        let mut views = self.observers.views();
        let mut ending = pin!(self.observers.ending());
        loop {
            self.feed.show(&self.observers.view_now());
            if let Err(spent) = self.send(clock.now()) {
                return End::Numbers(spent);
            }
            let now = clock.now();
            if now.saturating_since(self.feed.last_arrival()) > SILENCE_MAX {
                return End::Silence;
            }
            let rest = self.feed.poll_timeout().saturating_since(now);
            tokio::select! {
                biased;
                read = farewell.as_mut() => {
                    return read.map_or_else(End::Stream, |theirs| End::Farewell(theirs.ending));
                }
                wish = ending.as_mut() => return match wish {
                    Wish::Fail => End::ThreadPanicked,
                    Wish::GoOn | Wish::End => End::Asked,
                },
                () = revoked.as_mut() => return End::Revoked,
                // its sender is this host's own
                _ = views.changed() => {}
                () = sleep(rest) => {}
                datagram = self.connection.read_datagram() => match datagram {
                    Ok(bytes) => self.take(&bytes),
                    Err(error) => return End::Disconnected(error),
                },
            }
        }
    }

    fn take(&mut self, datagram: &Bytes) {
        let before = self.feed.commands_refused();
        self.read += 1;
        let now = self.observers.clock().now();
        self.feed.handle_datagram(now, datagram);
        let refused = self.feed.commands_refused() - before;
        self.observers.refuse_commands(refused);
    }

    /// Sends what is due. What cannot be sent now is dropped: the next update supersedes it.
    fn send(&mut self, now: Time) -> Result<(), NumbersSpent> {
        let mut out = [0; DATAGRAM_MAX];
        while let Some(length) = self.feed.poll_transmit(now, &mut out)? {
            let bytes = out.get(..length).unwrap_or_default();
            let datagram = Bytes::copy_from_slice(bytes);
            // it is counted as unsent
            let _ = self.connection.send_datagram(datagram);
        }
        Ok(())
    }

    /// What was counted since it `began`.
    fn half(&self, began: Time) -> SlaveHalf {
        let duration = self.observers.clock().now().saturating_since(began);
        let mut half = self.feed.half(duration.as_secs_f64());
        let passed = self.connection.datagrams();
        let made = self.feed.datagrams_made();
        half.session.unsent = Some(made.saturating_sub(passed.sent));
        half.session.unread = Some(passed.received.saturating_sub(self.read));
        half
    }
}
