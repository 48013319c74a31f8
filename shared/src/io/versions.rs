//! How two programs find out whether they speak the same version, and tell each other when they do not.
//!
//! Both offer `mmt/N` of their own and `mmt/version`. If they meet on the latter, the master opens the stream
//! and writes what it speaks in one frame; the slave closes with what it speaks as the reason.

use std::time::Duration;

use quinn::crypto::rustls::HandshakeData;
use quinn::{Connection, ConnectionError, VarInt};
use tokio::time::timeout;

use super::stream::{read_frame, write_frame};
use crate::wire::ALPN;

/// Close code: the session is over.
pub const CLOSE_FINISHED: VarInt = VarInt::from_u32(0);
/// Close code: the peers speak different versions; the reason is what the closing side speaks.
pub const CLOSE_OTHER_VERSION: VarInt = VarInt::from_u32(1);

/// Peers that share no version have this long to tell each other theirs.
const VERSIONS_MAX: Duration = Duration::from_secs(5);
/// The longest name of a version that is believed, bytes.
const VERSION_BYTES_MAX: usize = 64;
/// Whether the handshake agreed on [`ALPN`]; else it was [`VERSION_PROTOCOL`](super::tls::VERSION_PROTOCOL).
pub(super) fn shares_version(connection: &Connection) -> bool {
    let data = connection.handshake_data();
    let data = data.and_then(|data| data.downcast::<HandshakeData>().ok());
    data.and_then(|data| data.protocol)
        .is_some_and(|protocol| protocol == ALPN.as_bytes())
}

/// The master's half of `mmt/version`: says `ours` in a frame on the stream, and learns the slave's
/// from the reason with which that closes.
pub(super) async fn version_of_slave(connection: &Connection, ours: &str) -> String {
    let told = async {
        if let Ok((mut send, _)) = connection.open_bi().await {
            let _ = write_frame(&mut send, ours.as_bytes(), VERSIONS_MAX).await;
        }
        connection.closed().await
    };
    match timeout(VERSIONS_MAX, told).await {
        Ok(ConnectionError::ApplicationClosed(close)) => readable(&close.reason),
        _ => readable(b""),
    }
}

/// The slave's half: learns the master's from its frame; closing says the slave's own.
pub(super) async fn version_of_master(connection: &Connection) -> String {
    let told = async {
        let (_, mut receive) = connection.accept_bi().await.ok()?;
        let frame = read_frame(&mut receive, VERSION_BYTES_MAX, VERSIONS_MAX).await;
        frame.ok()
    };
    let told = timeout(VERSIONS_MAX, told).await;
    readable(&told.ok().flatten().unwrap_or_default())
}

fn readable(name: &[u8]) -> String {
    let name = name.get(..VERSION_BYTES_MAX).unwrap_or(name);
    if name.is_empty() {
        "an unknown version".to_owned()
    } else {
        String::from_utf8_lossy(name).into_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_peer_calls_its_version_is_bounded() {
        assert_eq!(readable(b"mmt/3"), "mmt/3");
        assert_eq!(readable(b""), "an unknown version");
        assert_eq!(readable(&[b'x'; 500]).len(), 64);
    }
}
