//! The beginning of a session, an operator's and an observer's alike.

use std::time::Duration;

use mmt_shared::io::network_task::WAITING_MAX;
use mmt_shared::io::stream::{WriteFrameError, write_message};
use mmt_shared::io::transport::{Connection, SendStream};
use mmt_shared::wire::{StreamMessage, Welcome};
use tokio::time::timeout;

/// How long the stream may take to take a message of ours.
const WRITE_WAIT: Duration = Duration::from_secs(2);

/// Welcomes whoever is at the other end: the session begins.
///
/// # Errors
/// It left before.
pub(super) async fn welcome(
    connection: &Connection,
    send: &mut SendStream,
    welcome: &Welcome,
) -> Result<(), WriteFrameError> {
    // datagrams from before the welcome belong to no session
    discard(connection).await;
    let message = StreamMessage::Welcome(welcome.into());
    let written = write_message(send, &message, WRITE_WAIT).await;
    written.inspect_err(|error| {
        let address = connection.remote_address();
        tracing::warn!("{address} left before its welcome: {error}");
    })
}

/// Takes the datagrams that have arrived and were not read, without waiting for more.
async fn discard(connection: &Connection) {
    for _ in 0..WAITING_MAX {
        if !matches!(
            timeout(Duration::ZERO, connection.read_datagram()).await,
            Ok(Ok(_))
        ) {
            break;
        }
    }
}
