//! Two ends of raw UDP on one thread, and strangers: counts, repeats, bounds, ends.

use std::io::{self, IoSliceMut};
use std::net::UdpSocket;
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::task::{Context, Poll};
use std::time::Duration;

use quinn::udp::{RecvMeta, Transmit};
use quinn::{AsyncUdpSocket, ConnectionError, Runtime, SendDatagramError, UdpPoller};

use super::packet::{Body, HEADER, PACKET_MAX, Packet};
use super::*;
use crate::io::runtime::PollRuntime;
use crate::io::socket::bind;
use crate::io::stream::{ReadFrameError, WriteFrameError};

/// Longer than any healthy test needs on any host.
const PATIENCE: Duration = Duration::from_secs(60);

/// Loses the first packet of every three that it sends, and counts.
#[derive(Debug)]
struct Lossy {
    inner: Arc<dyn AsyncUdpSocket>,
    offered: AtomicU64,
}

impl AsyncUdpSocket for Lossy {
    fn create_io_poller(self: Arc<Self>) -> Pin<Box<dyn UdpPoller>> {
        Arc::clone(&self.inner).create_io_poller()
    }

    fn try_send(&self, transmit: &Transmit<'_>) -> io::Result<()> {
        match self
            .offered
            .fetch_add(1, Ordering::Relaxed)
            .is_multiple_of(3)
        {
            true => Ok(()),
            false => self.inner.try_send(transmit),
        }
    }

    fn poll_recv(
        &self,
        context: &mut Context<'_>,
        buffers: &mut [IoSliceMut<'_>],
        meta: &mut [RecvMeta],
    ) -> Poll<io::Result<usize>> {
        self.inner.poll_recv(context, buffers, meta)
    }

    fn local_addr(&self) -> io::Result<SocketAddr> {
        self.inner.local_addr()
    }
}

fn local() -> UdpSocket {
    bind("127.0.0.1:0".parse().unwrap()).unwrap()
}

fn endpoint(runtime: &PollRuntime, accepts: bool) -> Endpoint {
    let handle = runtime.handle();
    let socket = handle.wrap_udp_socket(local()).unwrap();
    Endpoint::new(socket, Arc::new(handle), accepts)
}

fn lossy(runtime: &PollRuntime, accepts: bool) -> Endpoint {
    let handle = runtime.handle();
    let inner = handle.wrap_udp_socket(local()).unwrap();
    let offered = AtomicU64::new(0);
    Endpoint::new(
        Arc::new(Lossy { inner, offered }),
        Arc::new(handle),
        accepts,
    )
}

async fn pair(master: &Endpoint, slave: &Endpoint) -> (Connection, Connection) {
    let address = slave.local_addr().unwrap();
    let (up, down) = tokio::join!(master.connect(address, PATIENCE), slave.accept());
    (up.unwrap(), down.unwrap())
}

#[test]
fn datagrams_arrive_as_they_were_sent_and_are_counted() {
    let runtime = PollRuntime::try_new().unwrap();
    let (master, slave) = (endpoint(&runtime, false), endpoint(&runtime, true));
    let exchange = async {
        let (up, down) = pair(&master, &slave).await;
        for number in 0..100_u8 {
            up.send_datagram(&[number; 40]).unwrap();
            assert_eq!(*down.read_datagram().await.unwrap(), [number; 40]);
        }
        down.send_datagram(b"").unwrap();
        assert!(up.read_datagram().await.unwrap().is_empty());
        assert_eq!((up.datagrams(), down.datagrams()), ((100, 1), (1, 100)));
        let longest = vec![7; PACKET_MAX - HEADER];
        up.send_datagram(&longest).unwrap();
        assert_eq!(down.read_datagram().await.unwrap(), longest);
        let longer = vec![7; PACKET_MAX - HEADER + 1];
        let refused = up.send_datagram(&longer);
        assert_eq!(refused, Err(SendDatagramError::TooLarge));
    };
    runtime.block_on(exchange).unwrap();
}

#[test]
fn letters_arrive_once_and_in_order_although_packets_are_lost() {
    let runtime = PollRuntime::try_new().unwrap();
    let (master, slave) = (lossy(&runtime, false), lossy(&runtime, true));
    let exchange = async {
        let (up, down) = pair(&master, &slave).await;
        for number in 0..5_u8 {
            let letter = [number];
            let written = up.write_letter(&letter, PATIENCE);
            let read = down.read_letter(100, PATIENCE);
            let (written, read) = tokio::join!(written, read);
            written.unwrap();
            assert_eq!(read.unwrap(), [number]);
        }
        let none = down.read_letter(100, Duration::from_millis(20)).await;
        assert!(matches!(none, Err(ReadFrameError::Slow { .. })), "{none:?}");
    };
    runtime.block_on(exchange).unwrap();
}

#[test]
fn letters_have_bounds() {
    let runtime = PollRuntime::try_new().unwrap();
    let (master, slave) = (endpoint(&runtime, false), endpoint(&runtime, true));
    let exchange = async {
        let (up, down) = pair(&master, &slave).await;
        let long = up.write_letter(&[0; PACKET_MAX], PATIENCE).await;
        assert!(
            matches!(long, Err(WriteFrameError::TooLong { bytes: PACKET_MAX })),
            "{long:?}"
        );
        up.write_letter(&[0; 50], PATIENCE).await.unwrap();
        let long = down.read_letter(49, PATIENCE).await;
        let expected = ReadFrameError::TooLong { bytes: 50, max: 49 };
        assert_eq!(long.unwrap_err().to_string(), expected.to_string());
    };
    runtime.block_on(exchange).unwrap();
}

#[test]
fn an_end_is_told_with_its_reason_and_what_came_before_is_read() {
    let runtime = PollRuntime::try_new().unwrap();
    let (master, slave) = (endpoint(&runtime, false), endpoint(&runtime, true));
    let exchange = async {
        let (up, down) = pair(&master, &slave).await;
        up.send_datagram(b"last").unwrap();
        up.close(0, b"enough");
        let why = down.closed().await;
        let ConnectionError::ApplicationClosed(close) = why else {
            panic!("{why:?}");
        };
        assert_eq!(&*close.reason, b"enough");
        assert_eq!(down.read_datagram().await.unwrap(), "last");
        down.read_datagram().await.unwrap_err();
        down.send_datagram(b"late").unwrap_err();
        assert_eq!(up.closed().await, ConnectionError::LocallyClosed);
    };
    runtime.block_on(exchange).unwrap();
}

#[test]
fn a_connection_that_nobody_holds_is_closed_and_so_are_those_of_an_endpoint_that_goes() {
    let runtime = PollRuntime::try_new().unwrap();
    let (master, slave) = (endpoint(&runtime, false), endpoint(&runtime, true));
    let exchange = async {
        let (up, down) = pair(&master, &slave).await;
        drop(up);
        down.closed().await;
        let (up, _down) = pair(&master, &slave).await;
        drop(slave);
        up.closed().await;
    };
    runtime.block_on(exchange).unwrap();
}

#[test]
fn a_slave_that_was_started_again_ends_the_old_connections_at_once() {
    let runtime = PollRuntime::try_new().unwrap();
    let master = endpoint(&runtime, false);
    let stranger = local();
    stranger.set_nonblocking(false).unwrap();
    let address = stranger.local_addr().unwrap();
    let thread = std::thread::spawn(move || {
        let mut buffer = [0; 2000];
        let (length, from) = stranger.recv_from(&mut buffer).unwrap();
        let connection = Packet::read(&buffer[..length]).unwrap().connection;
        let body = Body::Receipt { number: 0 };
        let mut receipt = Vec::new();
        Packet { connection, body }.write(&mut receipt);
        stranger.send_to(&receipt, from).unwrap();
        stranger
    });
    let up = runtime.block_on(master.connect(address, PATIENCE));
    let up = up.unwrap().unwrap();
    // the same port, and nothing known of the connection
    let handle = runtime.handle();
    let socket = handle.wrap_udp_socket(thread.join().unwrap()).unwrap();
    let _slave = Endpoint::new(socket, Arc::new(handle), true);
    up.send_datagram(b"are you there?").unwrap();
    let why = runtime.block_on(up.closed()).unwrap();
    assert!(
        matches!(why, ConnectionError::ApplicationClosed(_)),
        "{why:?}"
    );
}

#[test]
fn another_version_is_named_and_silence_is_no_answer() {
    let runtime = PollRuntime::try_new().unwrap();
    let (master, slave) = (endpoint(&runtime, false), endpoint(&runtime, true));
    let (stranger, address) = (local(), slave.local_addr().unwrap());
    let body = Body::Letter {
        number: 0,
        message: b"mmt/0",
    };
    let mut knock = Vec::new();
    Packet {
        connection: 9,
        body,
    }
    .write(&mut knock);
    stranger.send_to(&knock, address).unwrap();
    let mut answer = [0; 2000];
    let deaf = local().local_addr().unwrap();
    let silence = runtime.block_on(master.connect(deaf, Duration::from_millis(250)));
    assert!(matches!(silence, Ok(Err(OpenError::NoAnswer { .. }))));
    let (length, _) = stranger.recv_from(&mut answer).unwrap();
    let expected = Packet {
        connection: 9,
        body: Body::Close {
            code: 1,
            reason: crate::wire::ALPN.as_bytes(),
        },
    };
    assert_eq!(Packet::read(&answer[..length]), Some(expected));
}

#[test]
fn what_is_not_read_is_bounded_and_the_newest_stays() {
    let runtime = PollRuntime::try_new().unwrap();
    let (master, slave) = (endpoint(&runtime, false), endpoint(&runtime, true));
    let exchange = async {
        let (up, down) = pair(&master, &slave).await;
        let sent = 600_u32;
        for number in 0..sent {
            up.send_datagram(&number.to_le_bytes()).unwrap();
            // the receipt shows that what came before has been dealt out
            if number % 50 == 49 {
                up.write_letter(b"x", PATIENCE).await.unwrap();
                down.read_letter(1, PATIENCE).await.unwrap();
            }
        }
        assert_eq!(down.datagrams().1, u64::from(sent));
        let first = down.read_datagram().await.unwrap();
        assert_eq!(*first, (sent - 512).to_le_bytes());
    };
    runtime.block_on(exchange).unwrap();
}

#[test]
fn only_loopback_is_permitted_unless_somebody_insists() {
    for (address, loopback) in [
        ("127.0.0.1:1", true),
        ("127.9.9.9:1", true),
        ("[::1]:1", true),
        ("[::ffff:127.0.0.1]:1", true),
        ("0.0.0.0:1", false),
        ("[::]:1", false),
        ("192.0.2.1:1", false),
        ("[2001:db8::1]:1", false),
    ] {
        let address = address.parse().unwrap();
        assert_eq!(permit(address, false).is_ok(), loopback, "{address}");
        assert_eq!(permit(address, true), Ok(()));
    }
    let refused = permit("192.0.2.1:1".parse().unwrap(), false).unwrap_err();
    let text = refused.to_string();
    for part in ["192.0.2.1:1", "--insecure", "loopback", "QUIC"] {
        assert!(text.contains(part), "{part}: {text}");
    }
}
