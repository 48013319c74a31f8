//! The same session over either transport, and raw datagrams by themselves.

use std::net::SocketAddr;

use bytes::Bytes;

use super::*;
use crate::io::identity::Identity;
use crate::io::raw_udp::{HEADER, PACKET_MAX};
use crate::io::stream::{delivered, read_frame, write_frame};
use crate::io::tests::{PATIENCE, TRAFFIC, open, patiently};

const RAW_UDP: Transport = Transport::RawUdp { insist: false };

/// Hello, welcome, datagrams, farewell, end.
async fn session(transport: Transport) {
    let identity = Identity::ephemeral().unwrap();
    let slave = Endpoint::of_slave(transport, open(), &identity, TRAFFIC).unwrap();
    let master = Endpoint::of_master(transport, open()).unwrap();
    let (address, listener) = (slave.local_addr().unwrap(), Listener::new(slave.clone()));
    let slave_side = async {
        let handshake = listener.next().await.unwrap();
        assert_eq!(handshake.address(), master.local_addr().unwrap());
        let down = handshake.finish().await.unwrap();
        let (mut send, mut receive) = down.accept_bi().await.unwrap();
        assert_eq!(
            read_frame(&mut receive, 10, PATIENCE).await.unwrap(),
            b"hello"
        );
        write_frame(&mut send, b"welcome", PATIENCE).await.unwrap();
        assert_eq!(down.read_datagram().await.unwrap(), "command");
        down.send_datagram("update".into()).unwrap();
        assert_eq!(
            read_frame(&mut receive, 10, PATIENCE).await.unwrap(),
            b"farewell"
        );
        let end = down.closed().await;
        let passed = DatagramCounts {
            sent: 1,
            received: 1,
        };
        assert_eq!(down.datagrams(), passed);
        end
    };
    let master_side = async {
        let connecting = master.connect(address, identity.pin(), TRAFFIC, PATIENCE);
        let up = connecting.await.unwrap();
        assert_eq!(up.remote_address(), address);
        let (mut send, mut receive) = up.open_bi().await.unwrap();
        write_frame(&mut send, b"hello", PATIENCE).await.unwrap();
        assert_eq!(
            read_frame(&mut receive, 10, PATIENCE).await.unwrap(),
            b"welcome"
        );
        up.send_datagram("command".into()).unwrap();
        assert_eq!(up.read_datagram().await.unwrap(), "update");
        write_frame(&mut send, b"farewell", PATIENCE).await.unwrap();
        send.finish().unwrap();
        delivered(&send, PATIENCE).await;
        up.close(CLOSE_FINISHED, b"over");
        master.wait_idle().await;
    };
    let (end, ()) = patiently(async { tokio::join!(slave_side, master_side) }).await;
    let ConnectionError::ApplicationClosed(close) = end else {
        panic!("{end:?}");
    };
    assert_eq!(
        (close.error_code, &*close.reason),
        (CLOSE_FINISHED, &b"over"[..])
    );
    slave.close(CLOSE_FINISHED, b"");
    assert!(patiently(listener.next()).await.is_none());
}

#[tokio::test]
async fn a_session_is_the_same_over_quic() {
    session(Transport::Quic).await;
}

#[tokio::test]
async fn a_session_is_the_same_over_raw_udp() {
    session(RAW_UDP).await;
}

/// A connection over raw UDP: both endpoints, the master's end, the slave's end.
async fn raw_pair() -> (Endpoint, Listener, Connection, Connection) {
    let identity = Identity::ephemeral().unwrap();
    let slave = Endpoint::of_slave(RAW_UDP, open(), &identity, TRAFFIC).unwrap();
    let master = Endpoint::of_master(RAW_UDP, open()).unwrap();
    let (address, listener) = (slave.local_addr().unwrap(), Listener::new(slave));
    let (up, down) = patiently(async {
        let up = master.connect(address, identity.pin(), TRAFFIC, PATIENCE);
        let down = async { listener.next().await.unwrap().finish().await };
        tokio::join!(up, down)
    })
    .await;
    (master, listener, up.unwrap(), down.unwrap())
}

#[tokio::test]
async fn who_uses_another_transport_gets_no_session_and_both_sides_read_what_to_do() {
    for (transport, other) in [(Transport::Quic, RAW_UDP), (RAW_UDP, Transport::Quic)] {
        let identity = Identity::ephemeral().unwrap();
        let slave = Endpoint::of_slave(transport, open(), &identity, TRAFFIC).unwrap();
        let master = Endpoint::of_master(other, open()).unwrap();
        let (address, listener) = (slave.local_addr().unwrap(), Listener::new(slave));
        let up = master.connect(address, identity.pin(), TRAFFIC, PATIENCE);
        let down = async { listener.next().await.unwrap().finish().await };
        let (up, down) = patiently(async { tokio::join!(up, down) }).await;
        for text in [up.unwrap_err().to_string(), down.unwrap_err().to_string()] {
            assert!(text.contains("--transport"), "{text}");
        }
    }
}

#[tokio::test]
async fn raw_datagrams_arrive_as_they_were_sent_and_are_counted() {
    let (_master, _slave, up, down) = raw_pair().await;
    for number in 0..100_u8 {
        up.send_datagram(vec![number; 40].into()).unwrap();
        let received = patiently(down.read_datagram()).await.unwrap();
        assert_eq!(*received, [number; 40]);
    }
    down.send_datagram(Bytes::new()).unwrap();
    assert!(patiently(up.read_datagram()).await.unwrap().is_empty());
    let counts = |sent, received| DatagramCounts { sent, received };
    assert_eq!(
        (up.datagrams(), down.datagrams()),
        (counts(100, 1), counts(1, 100))
    );
    let longest = vec![7; PACKET_MAX - HEADER];
    up.send_datagram(longest.clone().into()).unwrap();
    assert_eq!(patiently(down.read_datagram()).await.unwrap(), longest);
    let longer = vec![7; PACKET_MAX - HEADER + 1];
    assert_eq!(
        up.send_datagram(longer.into()),
        Err(SendDatagramError::TooLarge)
    );
}

#[tokio::test]
async fn raw_datagrams_that_came_before_the_end_are_read() {
    let (_master, _slave, up, down) = raw_pair().await;
    up.send_datagram("last".into()).unwrap();
    up.close(CLOSE_FINISHED, b"enough");
    patiently(down.closed()).await;
    assert_eq!(patiently(down.read_datagram()).await.unwrap(), "last");
    patiently(down.read_datagram()).await.unwrap_err();
    down.send_datagram("late".into()).unwrap_err();
    assert_eq!(up.closed().await, ConnectionError::LocallyClosed);
}

#[tokio::test]
async fn raw_datagrams_that_nobody_reads_are_bounded_and_the_newest_stay() {
    let (_master, _slave, up, down) = raw_pair().await;
    let sent = 600_u32;
    for number in 0..sent {
        up.send_datagram(Bytes::copy_from_slice(&number.to_le_bytes()))
            .unwrap();
        while down.datagrams().received <= number.into() {
            tokio::task::yield_now().await;
        }
    }
    let first = patiently(down.read_datagram()).await.unwrap();
    assert_eq!(*first, (sent - 512).to_le_bytes());
}

#[test]
fn quic_goes_anywhere_and_raw_udp_only_where_it_may() {
    let insist = Transport::RawUdp { insist: true };
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
        let address: SocketAddr = address.parse().unwrap();
        assert_eq!(RAW_UDP.permit(address).is_ok(), loopback, "{address}");
        assert_eq!(insist.permit(address), Ok(()));
        assert_eq!(Transport::Quic.permit(address), Ok(()));
    }
    let refused = RAW_UDP.permit("192.0.2.1:1".parse().unwrap()).unwrap_err();
    let text = refused.to_string();
    for part in ["192.0.2.1:1", "--insecure", "loopback", "QUIC"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    assert_eq!(
        (Transport::default().name(), RAW_UDP.name()),
        ("quic", "udp")
    );
}
