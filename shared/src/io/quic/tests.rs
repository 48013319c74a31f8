//! What the settings do, on loopback.

use bytes::Bytes;
use quinn::ConnectionError;
use tokio::time::timeout;

use super::*;
use crate::io::connect::connect;
use crate::io::socket;
use crate::io::tests::{PATIENCE, TRAFFIC, open, pair, patiently};
use crate::io::transport::Listener;

#[tokio::test]
async fn of_datagrams_that_cannot_leave_only_the_newest_two_are_kept() {
    let (_endpoint, _slave, up, down) = pair().await;
    // The runtime has one thread: nothing leaves before this task waits.
    for number in 0..100u8 {
        up.send_datagram(Bytes::from(vec![number; 100])).unwrap();
    }
    let (first, second) = (down.read_datagram(), down.read_datagram());
    assert_eq!(patiently(first).await.unwrap()[0], 98);
    assert_eq!(patiently(second).await.unwrap()[0], 99);
    let third = timeout(Duration::from_millis(100), down.read_datagram()).await;
    assert!(third.is_err(), "an old one was delivered");
}

#[tokio::test]
async fn acknowledgements_are_a_fraction_of_the_packets() {
    let (_endpoint, _slave, up, down) = pair().await;
    let before = down.stats().udp_tx.datagrams;
    for number in 0..200u8 {
        up.send_datagram(Bytes::from(vec![number; 100])).unwrap();
        assert_eq!(patiently(down.read_datagram()).await.unwrap()[0], number);
    }
    let answered = down.stats().udp_tx.datagrams - before;
    let sent = up.stats().frame_tx.datagram;
    assert_eq!(sent, 200);
    // a stalled host may add one for each 25 ms; quinn's default is 100
    assert!(answered <= 70, "{answered} packets back for {sent}");
}

#[tokio::test]
async fn a_slave_that_was_killed_and_restarted_resets_the_old_connection() {
    let identity = Arc::new(Identity::ephemeral().unwrap());
    let (address_out, address_in) = tokio::sync::oneshot::channel();
    let theirs = Arc::clone(&identity);
    let killed = std::thread::spawn(move || {
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build();
        let runtime = runtime.unwrap();
        let connection = runtime.block_on(async move {
            let endpoint = server_endpoint(open(), &theirs, TRAFFIC).unwrap();
            address_out.send(endpoint.local_addr().unwrap()).unwrap();
            let connection = Listener::new(endpoint)
                .next()
                .await
                .unwrap()
                .finish()
                .await
                .unwrap();
            connection.read_datagram().await.unwrap();
            connection
        });
        // The runtime first: without it the connection cannot close.
        drop(runtime);
        drop(connection);
    });
    let endpoint = client_endpoint(open()).unwrap();
    let address = address_in.await.unwrap();
    let up = connect(&endpoint, address, identity.pin(), TRAFFIC, PATIENCE)
        .await
        .unwrap();
    up.send_datagram(Bytes::from_static(b"die")).unwrap();
    while !killed.is_finished() {
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
    assert_eq!(up.close_reason(), None, "a killed slave sends nothing");
    let socket = socket::for_quic(socket::bind(address).unwrap()).unwrap();
    let _restarted = server_endpoint(socket, &identity, TRAFFIC).unwrap();
    let beat = async {
        loop {
            let _ = up.send_datagram(Bytes::from_static(&[0; 40]));
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    };
    let end = tokio::select! {
        end = patiently(up.closed()) => end,
        () = beat => unreachable!(),
    };
    assert_eq!(end, ConnectionError::Reset);
}
