//! The same session over either transport.

use super::*;
use crate::io::identity::Identity;
use crate::io::loopback::{PATIENCE, TRAFFIC, open, patiently};
use crate::io::versions::CLOSE_FINISHED;

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
        assert_eq!(receive.read_frame(10, PATIENCE).await.unwrap(), b"hello");
        send.write_frame(b"welcome", PATIENCE).await.unwrap();
        assert_eq!(down.read_datagram().await.unwrap(), "command");
        down.send_datagram("update".into()).unwrap();
        assert_eq!(receive.read_frame(10, PATIENCE).await.unwrap(), b"farewell");
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
        send.write_frame(b"hello", PATIENCE).await.unwrap();
        assert_eq!(receive.read_frame(10, PATIENCE).await.unwrap(), b"welcome");
        up.send_datagram("command".into()).unwrap();
        assert_eq!(up.read_datagram().await.unwrap(), "update");
        send.write_frame(b"farewell", PATIENCE).await.unwrap();
        send.finish();
        send.delivered(PATIENCE).await;
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

#[tokio::test]
async fn who_uses_another_transport_gets_no_answer_and_is_told_to_look_at_that() {
    for (transport, other) in [(Transport::Quic, RAW_UDP), (RAW_UDP, Transport::Quic)] {
        let identity = Identity::ephemeral().unwrap();
        let slave = Endpoint::of_slave(transport, open(), &identity, TRAFFIC).unwrap();
        let master = Endpoint::of_master(other, open()).unwrap();
        let (address, soon) = (slave.local_addr().unwrap(), Duration::from_millis(300));
        let refused = master.connect(address, identity.pin(), TRAFFIC, soon).await;
        let text = refused.unwrap_err().to_string();
        assert!(text.contains("--transport"), "{text}");
    }
}

#[test]
fn quic_goes_anywhere_and_raw_udp_only_where_it_may() {
    let far = "192.0.2.1:4433".parse().unwrap();
    assert_eq!(Transport::Quic.permit(far), Ok(()));
    assert!(RAW_UDP.permit(far).is_err());
    assert_eq!(Transport::RawUdp { insist: true }.permit(far), Ok(()));
    assert_eq!(
        (Transport::default().to_string(), RAW_UDP.to_string()),
        ("quic".to_owned(), "udp".to_owned())
    );
}
