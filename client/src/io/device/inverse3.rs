//! The thread of an Inverse3: a WebSocket to the vendor's service, asked for a frame a thousand times a second.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;

use mmt_shared::io::clock::Clock;
use mmt_shared::io::ticker::Ticker;
use mmt_shared::time::TICK;
use serde::Deserialize;
use tungstenite::protocol::WebSocketConfig;
use tungstenite::{Error, Message, WebSocket};

use super::shared::Shared;
use crate::device::inverse3::Inverse3;

/// How long the service may take to answer a connection and to send its version.
const PATIENCE: Duration = Duration::from_secs(2);
/// How long a frame is waited for before the next is asked for.
const FRAME: Duration = Duration::from_millis(20);
/// A service that has sent nothing for so long is connected to anew.
const SILENCE: Duration = Duration::from_secs(1);
/// Between two attempts to connect.
const RETRY: Duration = Duration::from_millis(500);
/// Largest message that is read, bytes: a frame of ten devices has 20 kB.
const MESSAGE_MAX: usize = 1 << 20;
/// Largest answer about the version that is read, bytes.
const VERSION_MAX: u64 = 1 << 16;

/// A connection, and the version of the service if it sends one.
pub(super) struct Connection {
    socket: WebSocket<TcpStream>,
    version: Option<String>,
}

/// Connects to the service there.
///
/// # Errors
/// In words: nobody listens, or it is no WebSocket.
pub(super) fn connect(at: SocketAddr) -> Result<Connection, String> {
    let words = |error: &dyn std::fmt::Display| error.to_string();
    let version = version(at).map_err(|error| words(&error))?;
    let stream = stream(at).map_err(|error| words(&error))?;
    let config = WebSocketConfig::default()
        .max_message_size(Some(MESSAGE_MAX))
        .max_frame_size(Some(MESSAGE_MAX));
    let url = format!("ws://{at}/");
    let joined = tungstenite::client::client_with_config(url, stream, Some(config));
    let (socket, _) = joined.map_err(|error| words(&error))?;
    let paced = socket.get_ref().set_read_timeout(Some(FRAME));
    paced.map_err(|error| words(&error))?;
    Ok(Connection { socket, version })
}

/// The version of the service that listens there, such as 3.5.0.0, by `GET /version`; none if it sends none.
///
/// # Errors
/// Nobody listens there.
pub fn version(at: SocketAddr) -> io::Result<Option<String>> {
    #[derive(Deserialize)]
    struct Version {
        project_version: String,
    }
    let mut stream = stream(at)?;
    let request = format!("GET /version HTTP/1.1\r\nHost: {at}\r\nConnection: close\r\n\r\n");
    let mut text = String::new();
    // a service that sends none has no version
    let answered = stream
        .write_all(request.as_bytes())
        .and_then(|()| stream.take(VERSION_MAX).read_to_string(&mut text));
    drop(answered);
    let body = text.find('{').zip(text.rfind('}'));
    let body = body.and_then(|(first, last)| text.get(first..=last));
    let version = body.and_then(|body| serde_json::from_str::<Version>(body).ok());
    Ok(version.map(|version| version.project_version))
}

fn stream(at: SocketAddr) -> io::Result<TcpStream> {
    let stream = TcpStream::connect_timeout(&at, PATIENCE)?;
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    Ok(stream)
}

/// Serves the device until the host ends; what breaks is connected to again.
pub(super) fn serve(at: SocketAddr, first: Connection, device: &mut Inverse3, shared: &Shared) {
    let clock = Clock::start();
    let mut connection = Some(first);
    while !shared.has_ended() {
        if let Some(Connection {
            mut socket,
            version,
        }) = connection.take()
        {
            shared.take(clock.now(), |give| {
                device.begin(version.as_deref(), give);
                (None, *device.counts())
            });
            if exchange(&mut socket, device, shared, clock).is_ok() {
                part(&mut socket, device);
            }
        }
        if !shared.has_ended() {
            shared.take(clock.now(), |give| {
                device.lose(give);
                (None, *device.counts())
            });
            tracing::warn!("the Inverse Service at {at} is gone");
        }
        while !shared.has_ended() && connection.is_none() {
            clock.sleep_until(clock.now() + RETRY);
            connection = connect(at).ok();
        }
    }
}

/// Asks and listens until the host ends.
///
/// # Errors
/// The connection is broken, or silent for too long.
fn exchange(
    socket: &mut WebSocket<TcpStream>,
    device: &mut Inverse3,
    shared: &Shared,
    clock: Clock,
) -> Result<(), Error> {
    let mut ticker = Ticker::new(clock, TICK);
    let mut last_message = clock.now();
    while !shared.has_ended() {
        let read = socket.read();
        let now = clock.now();
        match read {
            Ok(message) => {
                last_message = now;
                let asks = matches!(message, Message::Text(_) | Message::Binary(_));
                shared.take(now, |give| {
                    match &message {
                        Message::Text(text) => device.handle(now, text, give),
                        Message::Binary(_) => device.handle_other(give),
                        _ => {}
                    }
                    (device.seen(), *device.counts())
                });
                if !asks {
                    continue;
                }
            }
            Err(Error::Io(error))
                if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) =>
            {
                shared.take(now, |give| {
                    device.miss(now, give);
                    (None, *device.counts())
                });
                if now.saturating_since(last_message) > SILENCE {
                    return Err(Error::Io(error));
                }
            }
            Err(error) => return Err(error),
        }
        ticker.wait();
        let answer = device.answer(clock.now(), &shared.cell.load());
        socket.send(Message::text(answer))?;
    }
    Ok(())
}

/// The last word: no force.
fn part(socket: &mut WebSocket<TcpStream>, device: &mut Inverse3) {
    // whoever does not receive it any more has forgotten the force as well
    let _ = socket.send(Message::text(device.no_force()));
    let _ = socket.close(None);
    let _ = socket.flush();
}
