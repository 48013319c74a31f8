//! The runtime by itself, and quinn on it: order, timers, wakes from outside, sockets that are full.

use std::sync::atomic::AtomicU32;

use bytes::Bytes;
use quinn::udp::Transmit;
use tokio::sync::{Notify, oneshot};

use super::*;
use crate::io::loopback::{TRAFFIC, slave_on};
use crate::io::quic::{client_config, client_endpoint_on};
use crate::io::socket::bind;
use crate::io::tls::PinVerifier;

fn local() -> UdpSocket {
    bind("127.0.0.1:0".parse().unwrap()).unwrap()
}

/// A reader that is woken for each message.
async fn receive(socket: &Arc<dyn AsyncUdpSocket>) -> Vec<u8> {
    let mut buffer = vec![0; 65_536];
    let mut meta = [quinn::udp::RecvMeta::default()];
    let got = poll_fn(|context| {
        let mut buffers = [io::IoSliceMut::new(&mut buffer)];
        socket.poll_recv(context, &mut buffers, &mut meta)
    });
    assert_eq!(got.await.unwrap(), 1);
    buffer.truncate(meta[0].len);
    buffer
}

fn transmit(contents: &[u8], destination: std::net::SocketAddr) -> Transmit<'_> {
    Transmit {
        destination,
        ecn: None,
        contents,
        segment_size: None,
        src_ip: None,
    }
}

#[test]
fn tasks_run_in_the_order_of_their_wakes_and_outlive_a_call() {
    let runtime = PollRuntime::try_new().unwrap();
    let (order, go) = (Arc::new(Mutex::new(Vec::new())), Arc::new(Notify::new()));
    for name in 1..=3 {
        let (order, go) = (Arc::clone(&order), Arc::clone(&go));
        runtime.handle().spawn(Box::pin(async move {
            lock(&order).push(name);
            go.notified().await;
            lock(&order).push(10 * name);
        }));
    }
    let seven = runtime.block_on(async { 7 }).unwrap();
    assert_eq!(seven, 7);
    runtime.block_on(yield_once()).unwrap();
    assert_eq!(*lock(&order), [1, 2, 3]);
    go.notify_waiters();
    runtime
        .block_on(async {
            while lock(&order).len() < 6 {
                yield_once().await;
            }
        })
        .unwrap();
    assert_eq!(*lock(&order), [1, 2, 3, 10, 20, 30]);
}

async fn yield_once() {
    let mut yielded = false;
    poll_fn(|context| {
        if std::mem::replace(&mut yielded, true) {
            return Poll::Ready(());
        }
        context.waker().wake_by_ref();
        Poll::Pending
    })
    .await;
}

#[test]
fn timers_fire_in_the_order_of_their_deadlines_and_never_early() {
    let runtime = PollRuntime::try_new().unwrap();
    let (handle, start) = (runtime.handle(), Instant::now());
    let fired = Arc::new(Mutex::new(Vec::new()));
    for ms in [20, 5, 10] {
        let due = start + Duration::from_millis(ms);
        let mut timer = handle.new_timer(due);
        let fired = Arc::clone(&fired);
        handle.spawn(Box::pin(async move {
            poll_fn(|context| timer.as_mut().poll(context)).await;
            assert!(Instant::now() >= due);
            lock(&fired).push(ms);
        }));
    }
    let mut last = handle.new_timer(start + Duration::from_secs(3600));
    last.as_mut().reset(start + Duration::from_millis(30));
    let waited = poll_fn(|context| last.as_mut().poll(context));
    runtime.block_on(waited).unwrap();
    assert_eq!(*lock(&fired), [5, 10, 20]);
}

#[test]
fn a_wake_from_another_thread_brings_it_back_from_the_kernel() {
    let runtime = PollRuntime::try_new().unwrap();
    for round in 0..200 {
        let (tell, told) = oneshot::channel();
        let thread = std::thread::spawn(move || tell.send(round).unwrap());
        assert_eq!(runtime.block_on(told).unwrap().unwrap(), round);
        thread.join().unwrap();
    }
}

#[test]
fn a_second_thread_is_refused() {
    let runtime = PollRuntime::try_new().unwrap();
    let inner = runtime.block_on(async { runtime.block_on(async {}) });
    assert_eq!(
        inner.unwrap().unwrap_err().kind(),
        io::ErrorKind::ResourceBusy
    );
    // and it is free again
    runtime.block_on(async {}).unwrap();
}

#[test]
fn tasks_go_with_the_runtime() {
    let runtime = PollRuntime::try_new().unwrap();
    let handle = runtime.handle();
    let held = Arc::new(AtomicU32::new(0));
    let (mine, task) = (Arc::downgrade(&held), handle.clone());
    runtime.handle().spawn(Box::pin(async move {
        let _both = (held, task);
        std::future::pending::<()>().await;
    }));
    drop(runtime);
    assert!(mine.upgrade().is_none());
}

#[test]
fn a_socket_waits_for_what_comes_and_for_room() {
    let runtime = PollRuntime::try_new().unwrap();
    let (plain, handle) = (local(), runtime.handle());
    let address = plain.local_addr().unwrap();
    let socket = handle.wrap_udp_socket(plain).unwrap();
    let sender = std::thread::spawn(move || local().send_to(b"late", address).unwrap());
    assert_eq!(runtime.block_on(receive(&socket)).unwrap(), b"late");
    sender.join().unwrap();
    // a port that says it is full asks the kernel again, which has room
    let port = Arc::new(Port::try_new(local()).unwrap());
    lock(&handle.0.state).ports.push(Arc::downgrade(&port));
    port.full.store(true, Ordering::Relaxed);
    let mut room = Arc::clone(&port).create_io_poller();
    let waited = poll_fn(|context| room.as_mut().poll_writable(context));
    runtime.block_on(waited).unwrap().unwrap();
    port.try_send(&transmit(b"now", address)).unwrap();
    assert_eq!(runtime.block_on(receive(&socket)).unwrap(), b"now");
}

#[test]
fn quinn_runs_on_it() {
    let runtime = PollRuntime::try_new().unwrap();
    let handle = runtime.handle();
    let (server, identity) = slave_on(&handle);
    let socket = handle.wrap_udp_socket(local()).unwrap();
    let client = client_endpoint_on(Arc::new(handle), socket).unwrap();
    let verifier = Arc::new(PinVerifier::new(identity.pin()));
    let config = client_config(verifier, TRAFFIC).unwrap();
    let address = server.local_addr().unwrap();
    let connecting = client.connect_with(config, address, "mmt").unwrap();
    let sent = 100_u32;
    let heard = runtime.block_on(async {
        let accepting = async { server.accept().await.unwrap().await.unwrap() };
        let (up, down) = tokio::join!(async { connecting.await.unwrap() }, accepting);
        let mut heard = 0;
        for number in 0..sent {
            up.send_datagram(Bytes::copy_from_slice(&number.to_le_bytes()))
                .unwrap();
            let came = down.read_datagram().await.unwrap();
            assert_eq!(*came, number.to_le_bytes());
            heard += 1;
        }
        heard
    });
    assert_eq!(heard.unwrap(), sent);
}
