//! The console over loopback, with viewers of the tests.

use std::net::TcpStream;
use std::sync::atomic::{AtomicU64, Ordering};

use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

use super::*;

/// Longer than any healthy test needs on any host.
const PATIENCE: Duration = Duration::from_secs(60);
/// Bytes of a frame: some tens of them fill the buffers of both sockets.
const FRAME_BYTES: usize = 256 * 1024;

/// A viewer whose page is the console's own.
fn viewer(console: &Console) -> WebSocket<TcpStream> {
    let (host, query) = console.address().split_once("/?").unwrap();
    let host = host.strip_prefix("http://").unwrap();
    let url = format!("ws://{host}/ws?{query}");
    let mut request = url.into_client_request().unwrap();
    let origin = format!("http://{host}").parse().unwrap();
    request.headers_mut().insert("Origin", origin);
    let stream = TcpStream::connect(host).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    tungstenite::client(request, stream).unwrap().0
}

/// The number of the next frame that it gets.
fn next_frame(viewer: &mut WebSocket<TcpStream>) -> u64 {
    loop {
        let message = viewer.read().unwrap();
        let text = message.to_text().unwrap().trim_end();
        let number = text.strip_prefix("{\"frame\":");
        if let Some(number) = number.and_then(|rest| rest.strip_suffix('}')) {
            return number.parse().unwrap();
        }
    }
}

#[test]
fn a_viewer_that_never_reads_costs_nobody_else_anything() {
    let options = ConsoleOptions {
        listen: ([127, 0, 0, 1], 0).into(),
        for_others: None,
        assets: None,
    };
    let emergency = EmergencyStop::default();
    let console = Console::start(options, emergency.clone()).unwrap();
    let made = Arc::new(AtomicU64::new(0));
    let counter = Arc::clone(&made);
    console.show(Box::new(move || {
        let number = counter.fetch_add(1, Ordering::Relaxed) + 1;
        format!("{{\"frame\":{number}}}{}", " ".repeat(FRAME_BYTES))
    }));
    let mut unread = viewer(&console);
    let mut other = viewer(&console);
    // many times what the buffers hold
    let mut seen = 0;
    while seen < 150 {
        let frame = next_frame(&mut other);
        assert!(frame > seen);
        seen = frame;
    }
    // nothing of the console waits for it: neither its places nor what another viewer asks for
    assert_eq!(console.viewers(), 2);
    other.send(Message::text("\"stop\"")).unwrap();
    while !emergency.is_set() {
        next_frame(&mut other);
    }
    // it did stand, and nothing was kept for it: between what the buffers held and the newest there is a gap
    let mut before = next_frame(&mut unread);
    let gap = loop {
        let frame = next_frame(&mut unread);
        if frame > before + 20 {
            break (before, frame);
        }
        before = frame;
        assert!(before < seen, "it was sent each of {seen} frames");
    };
    assert!(gap.1 >= seen, "{gap:?} of {seen}");
    assert!(made.load(Ordering::Relaxed) >= seen);
}

#[test]
fn a_console_that_listens_everywhere_is_named_by_an_address_that_others_open() {
    let named = |local: &str, others: Option<&str>| {
        let others = others.map(|address| address.parse().unwrap());
        reached(local.parse().unwrap(), others).to_string()
    };
    let others = Some("192.0.2.7");
    assert_eq!(named("0.0.0.0:8080", others), "192.0.2.7:8080");
    assert_eq!(named("[::]:8080", others), "192.0.2.7:8080");
    assert_eq!(named("0.0.0.0:8080", None), "127.0.0.1:8080");
    assert_eq!(named("127.0.0.1:8080", others), "127.0.0.1:8080");
    assert_eq!(named("192.0.2.8:8080", others), "192.0.2.8:8080");
}
