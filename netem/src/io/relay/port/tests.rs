//! A port: refusals, times of arrival, the traffic class, what the kernel drops.

use std::net::Ipv4Addr;
use std::time::Duration;

use super::*;
use crate::io::now;

#[test]
fn news_that_nobody_listened_costs_the_next_datagram_nothing() {
    let any = (Ipv4Addr::LOCALHOST, 0);
    let vacant = UdpSocket::bind(any).unwrap().local_addr().unwrap();
    let socket = UdpSocket::bind(any).unwrap();
    socket.connect(vacant).unwrap();
    let port = Port::try_new(socket).unwrap();
    let mut unreachable = 0;
    let sending = Sending {
        to: vacant,
        from: None,
        class: 0,
    };
    let mut send = |contents: &[u8]| port.send(sending, contents, &mut unreachable);
    assert_eq!(send(b"to nobody"), Outcome::Sent);
    let target = UdpSocket::bind(vacant).unwrap();
    assert_eq!(send(b"to you"), Outcome::Sent);
    assert_eq!(unreachable, 1);
    let patience = Duration::from_secs(30);
    target.set_read_timeout(Some(patience)).unwrap();
    let mut buffer = [0; 100];
    let len = target.recv(&mut buffer).unwrap();
    assert_eq!(&buffer[..len], b"to you");
}

/// Two ports, the address of the second.
fn pair() -> (Port, Port, Sending) {
    let bind = || UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    let (near, far) = (bind(), bind());
    let to = far.local_addr().unwrap();
    let sending = Sending {
        to,
        from: None,
        // expedited forwarding, ECT(0)
        class: 46 << 2 | 2,
    };
    let port = |socket| Port::try_new(socket).unwrap();
    (port(near), port(far), sending)
}

#[test]
fn a_datagram_arrives_when_the_kernel_takes_it_in_and_keeps_its_class() {
    let (near, far, sending) = pair();
    // the first socket of a host that asks for time stamps gets them a little later
    let arrives_in_time = || {
        let before = now();
        assert_eq!(near.send(sending, b"early", &mut 0), Outcome::Sent);
        let after = now();
        std::thread::sleep(Duration::from_millis(50));
        let mut seen = None;
        let take = |received: Received<'_>| seen = Some((received.arrived, received.class));
        Receiver::new().receive(&far, take).unwrap();
        assert_eq!(far.new_overflows(), 0);
        let (arrived, class) = seen.unwrap();
        assert_eq!(class, sending.class);
        // two clocks are read one after the other
        let slack = Duration::from_millis(5);
        arrived + slack >= before && arrived <= after + slack
    };
    assert!((0..100).any(|_| arrives_in_time()));
}

#[test]
fn what_the_kernel_drops_is_counted() {
    let (near, far, sending) = pair();
    let contents = [0; 1400];
    let mut sent = 0;
    // more than any buffer that a kernel gives by itself
    while sent < 10_000 {
        sent += u64::from(near.send(sending, &contents, &mut 0) == Outcome::Sent);
    }
    let (mut received, mut dropped) = (0, 0);
    let mut receiver = Receiver::new();
    let mut drain = |received: &mut u64| {
        let mut before = u64::MAX;
        while before != *received {
            before = *received;
            receiver.receive(&far, |_| *received += 1).unwrap();
        }
        dropped += far.new_overflows();
    };
    drain(&mut received);
    assert!(received < sent, "the kernel took all {sent}");
    // the count comes with the next datagram
    assert_eq!(near.send(sending, b"after", &mut 0), Outcome::Sent);
    drain(&mut received);
    assert_eq!(received + dropped, sent + 1);
}
