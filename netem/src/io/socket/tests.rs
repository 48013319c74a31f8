//! The wrapped socket against a pretended one, and between two real QUIC endpoints.

mod quic;

use std::net::{IpAddr, Ipv4Addr};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::Waker;
use std::time::{Duration, Instant};

use mmt_shared::time::Time;
use quinn::udp::EcnCodepoint;
use quinn::{ClientConfig, Endpoint, EndpointConfig, Runtime, ServerConfig, TokioRuntime};

use super::*;
use crate::config::Limit;
use crate::counters::Tally;
use crate::direction::Direction;
use crate::io::now;
use crate::io::record_file::RecordFile;

const PATIENCE: Duration = Duration::from_secs(30);
const PEER: SocketAddr = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 9);

type Sent = (Time, Vec<u8>, Option<EcnCodepoint>);

/// A socket that keeps what it is given.
#[derive(Debug, Default)]
struct Pretended {
    sent: Mutex<Vec<Sent>>,
    full: AtomicBool,
    broken: AtomicBool,
}

impl Pretended {
    fn contents(&self) -> Vec<Vec<u8>> {
        let sent = self.sent.lock().unwrap();
        sent.iter()
            .map(|(_, contents, _)| contents.clone())
            .collect()
    }
}

#[derive(Debug)]
struct NeverWritable;

impl UdpPoller for NeverWritable {
    fn poll_writable(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Pending
    }
}

impl AsyncUdpSocket for Pretended {
    fn create_io_poller(self: Arc<Self>) -> Pin<Box<dyn UdpPoller>> {
        Box::pin(NeverWritable)
    }

    fn try_send(&self, transmit: &Transmit<'_>) -> io::Result<()> {
        if self.full.load(Ordering::Relaxed) {
            return Err(io::ErrorKind::WouldBlock.into());
        }
        if self.broken.load(Ordering::Relaxed) {
            return Err(io::ErrorKind::NetworkUnreachable.into());
        }
        let contents = transmit.contents.to_owned();
        self.sent
            .lock()
            .unwrap()
            .push((now(), contents, transmit.ecn));
        Ok(())
    }

    fn poll_recv(
        &self,
        _: &mut Context<'_>,
        _: &mut [IoSliceMut<'_>],
        meta: &mut [RecvMeta],
    ) -> Poll<io::Result<usize>> {
        // 2500 bytes in datagrams of 1000, one of 7, an empty one; the fourth slot is not used
        for (slot, (len, stride)) in meta.iter_mut().zip([(2500, 1000), (7, 7), (0, 0), (9, 9)]) {
            (slot.len, slot.stride) = (len, stride);
        }
        Poll::Ready(Ok(3))
    }

    fn local_addr(&self) -> io::Result<SocketAddr> {
        Ok(PEER)
    }

    fn max_transmit_segments(&self) -> usize {
        8
    }
}

fn wrap(inner: &Arc<Pretended>, words: &str) -> EmulatedSocket {
    EmulatedSocket::try_new(
        inner.clone(),
        words.parse().unwrap(),
        1,
        LinkId::UP,
        SocketExtras::default(),
    )
    .unwrap()
}

fn transmit(contents: &[u8], segment_size: Option<usize>) -> Transmit<'_> {
    Transmit {
        destination: PEER,
        ecn: Some(EcnCodepoint::Ect0),
        contents,
        segment_size,
        src_ip: None,
    }
}

/// Waits for something that must come, for as long as a slow machine may need.
fn until(what: &str, mut holds: impl FnMut() -> bool) {
    let start = Instant::now();
    while !holds() {
        assert!(start.elapsed() < PATIENCE, "it never came: {what}");
        std::thread::sleep(Duration::from_millis(1));
    }
}

fn offered_is_accounted_for(counters: &SocketCounters) {
    let out = &counters.outgoing;
    let gone = [
        out.sent,
        out.blocked,
        out.failed,
        out.abandoned,
        out.link.dropped.total(),
    ];
    let gone = gone.into_iter().fold(Tally::default(), Tally::plus);
    let offered = out.link.offered.plus(out.link.duplicated);
    assert_eq!(
        offered.packets,
        gone.packets + out.in_flight,
        "{counters:?}"
    );
    if out.in_flight == 0 {
        assert_eq!(offered.bytes, gone.bytes, "{counters:?}");
    }
}

#[test]
fn a_datagram_leaves_whole_marked_in_order_and_never_early() {
    let inner = Arc::new(Pretended::default());
    let socket = wrap(&inner, "delay 20ms 10ms");
    let start = now();
    for number in 0..50 {
        socket.try_send(&transmit(&[number], None)).unwrap();
    }
    until("all sent", || inner.contents().len() == 50);
    let in_order: Vec<Vec<u8>> = (0..50).map(|number| vec![number]).collect();
    assert_eq!(inner.contents(), in_order);
    for (at, _, ecn) in inner.sent.lock().unwrap().iter() {
        assert!(at.saturating_since(start) >= Duration::from_millis(10));
        assert_eq!(*ecn, Some(EcnCodepoint::Ect0));
    }
    let meter = socket.meter();
    until("counted", || meter.snapshot().outgoing.sent.packets == 50);
    assert_eq!(meter.lateness().count, 50);
}

#[test]
fn a_datagram_due_sooner_wakes_the_thread_that_waits_for_a_later_one() {
    let inner = Arc::new(Pretended::default());
    // J above the delay: some leave at once while others wait for most of an hour
    let socket = wrap(&inner, "delay 1800s 3000s order free");
    for number in 0..50 {
        socket.try_send(&transmit(&[number], None)).unwrap();
    }
    until("the first", || !inner.contents().is_empty());
    assert!(inner.contents().len() < 50);
}

fn wrap_with(inner: &Arc<Pretended>, words: &str, extras: SocketExtras) -> EmulatedSocket {
    let config = words.parse().unwrap();
    EmulatedSocket::try_new(inner.clone(), config, 1, LinkId::UP, extras).unwrap()
}

#[test]
fn a_socket_at_work_takes_new_settings_and_keeps_the_times_of_what_is_in_flight() {
    let control = SocketControl::default();
    let extras = SocketExtras {
        control: Some(control.clone()),
        ..SocketExtras::default()
    };
    let inner = Arc::new(Pretended::default());
    let socket = wrap_with(&inner, "none", extras.clone());
    socket.try_send(&transmit(b"passes", None)).unwrap();
    until("it passed", || inner.contents().len() == 1);

    let reconfigure = |words: &str| control.reconfigure(words.parse().unwrap());
    reconfigure("delay 20ms").unwrap();
    let start = now();
    socket.try_send(&transmit(b"in flight", None)).unwrap();
    reconfigure("loss 100%").unwrap();
    let refused = LinkConfig {
        limit: Limit {
            packets: 0,
            bytes: 1,
        },
        ..LinkConfig::default()
    };
    assert!(control.reconfigure(refused).is_err());
    socket.try_send(&transmit(b"lost", None)).unwrap();
    until("what was in flight", || inner.contents().len() == 2);
    let (at, contents, _) = inner.sent.lock().unwrap()[1].clone();
    assert_eq!(contents, b"in flight");
    assert!(at.saturating_since(start) >= Duration::from_millis(20));
    assert_eq!(
        socket.meter().snapshot().outgoing.link.dropped.loss.packets,
        1
    );

    // a socket made later begins with the newest settings, not with its own
    let later = wrap_with(&inner, "none", extras);
    later.try_send(&transmit(b"lost too", None)).unwrap();
    assert_eq!(
        later.meter().snapshot().outgoing.link.dropped.loss.packets,
        1
    );
    // and one that is gone is in nobody's way
    drop(socket);
    reconfigure("none").unwrap();
}

#[test]
fn what_a_socket_met_is_on_record_and_is_met_again_by_a_replay() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("session");
    let words = "delay 2ms 1ms loss 30% limit 200";
    let heading = crate::record::Heading {
        seed: 1,
        up: words.to_owned(),
        down: String::new(),
    };
    let file = RecordFile::create(&path, &heading).unwrap();
    let extras = SocketExtras {
        record: Some(file.writer()),
        ..SocketExtras::default()
    };
    let inner = Arc::new(Pretended::default());
    let socket = wrap_with(&inner, words, extras);
    for number in 0..100 {
        socket.try_send(&transmit(&[number], None)).unwrap();
        std::thread::sleep(Duration::from_micros(100));
    }
    let meter = socket.meter();
    until("all decided", || meter.snapshot().outgoing.in_flight == 0);
    // the thread writes the last one down after it has counted it
    drop(socket);
    assert_eq!(file.finish().unwrap(), 0);

    let bytes = std::fs::read(&path).unwrap();
    let (read, entries) = crate::record::read(&bytes).unwrap();
    assert_eq!((read, entries.len()), (heading, 100));
    let summary = crate::record::summary::Summary::of(&entries, Direction::Up);
    let counters = meter.snapshot();
    assert_eq!(summary.sent.packets, counters.outgoing.sent.packets);
    assert!(counters.outgoing.link.dropped.loss.packets > 10);
    // the binary form replays as the CSV does
    let text = crate::record::as_text(bytes).unwrap();
    let replay = crate::words::parse("trace session up", &mut |_| Ok(text.clone())).unwrap();
    let mut link = crate::Link::try_new(replay, 9, LinkId::UP).unwrap();
    link.set_origin(entries.iter().map(|entry| entry.offered).min().unwrap());
    let mut sorted = entries;
    sorted.sort_by_key(|entry| entry.number);
    for entry in sorted {
        link.offer(entry.offered, crate::Packet::new(0, ()));
        let due = link.poll_delivered(Time::MAX).map(|out| out.due);
        let sent = match entry.end {
            crate::record::End::Sent { sent, .. } => Some(sent),
            _ => None,
        };
        assert_eq!(due, sent, "packet {}", entry.number);
    }
}

#[test]
fn dropping_the_socket_ends_its_thread_and_counts_what_was_in_flight() {
    let inner = Arc::new(Pretended::default());
    let socket = wrap(&inner, "delay 3600s");
    socket.try_send(&transmit(b"late", None)).unwrap();
    let meter = socket.meter();
    assert_eq!(meter.snapshot().outgoing.in_flight, 1);
    assert!(Arc::strong_count(&inner) > 2, "the thread holds the socket");
    drop(socket);
    assert_eq!(Arc::strong_count(&inner), 1);
    let counters = meter.snapshot();
    assert_eq!(
        counters.outgoing.abandoned,
        Tally {
            packets: 1,
            bytes: 4
        }
    );
    offered_is_accounted_for(&counters);
}

#[test]
fn each_datagram_of_a_batch_has_its_own_fate() {
    let inner = Arc::new(Pretended::default());
    let socket = wrap(&inner, "delay 1ms loss 50%");
    assert_eq!(socket.max_transmit_segments(), 1);
    let batch: Vec<u8> = (0..=255).collect();
    for _ in 0..4 {
        socket.try_send(&transmit(&batch, Some(3))).unwrap();
    }
    let meter = socket.meter();
    until("all judged and sent", || {
        meter.snapshot().outgoing.in_flight == 0
    });
    let counters = meter.snapshot();
    // 85 datagrams of 3 bytes and one of 1 byte
    assert_eq!(counters.outgoing.link.offered.packets, 4 * 86);
    assert_eq!(counters.outgoing.link.offered.bytes, 4 * 256);
    assert!(counters.outgoing.link.dropped.loss.packets > 0 && counters.outgoing.sent.packets > 0);
    offered_is_accounted_for(&counters);
    let longest = inner.contents().iter().map(Vec::len).max();
    assert_eq!(longest, Some(3));
}

#[test]
fn a_full_link_drops_and_counts_instead_of_blocking() {
    let inner = Arc::new(Pretended::default());
    let socket = wrap(&inner, "delay 3600s limit 10");
    for _ in 0..15 {
        socket.try_send(&transmit(b"x", None)).unwrap();
    }
    let counters = socket.meter().snapshot();
    assert_eq!(counters.outgoing.in_flight, 10);
    assert_eq!(
        counters.outgoing.link.dropped.limit,
        Tally {
            packets: 5,
            bytes: 5
        }
    );
}

#[test]
fn a_real_socket_that_is_full_or_broken_costs_the_datagram_and_a_count() {
    let inner = Arc::new(Pretended::default());
    let socket = wrap(&inner, "delay 1ms");
    let meter = socket.meter();
    inner.full.store(true, Ordering::Relaxed);
    socket.try_send(&transmit(b"full", None)).unwrap();
    until("given up", || {
        meter.snapshot().outgoing.blocked.packets == 1
    });
    inner.full.store(false, Ordering::Relaxed);
    inner.broken.store(true, Ordering::Relaxed);
    socket.try_send(&transmit(b"broken", None)).unwrap();
    until("failed", || meter.snapshot().outgoing.failed.packets == 1);
    inner.broken.store(false, Ordering::Relaxed);
    socket.try_send(&transmit(b"well", None)).unwrap();
    until("sent", || meter.snapshot().outgoing.sent.packets == 1);
    assert_eq!(inner.contents(), [b"well"]);
    offered_is_accounted_for(&meter.snapshot());
}

#[test]
fn without_emulation_the_socket_passes_straight_through_and_counts() {
    let inner = Arc::new(Pretended::default());
    let socket = wrap(&inner, "none");
    assert_eq!(socket.max_transmit_segments(), 8);
    assert_eq!(Arc::strong_count(&inner), 2, "no thread");
    socket.try_send(&transmit(&[0; 2500], Some(1000))).unwrap();
    assert_eq!(inner.contents(), [[0; 2500]]);
    inner.full.store(true, Ordering::Relaxed);
    let full = socket.try_send(&transmit(&[0; 10], None)).unwrap_err();
    assert_eq!(full.kind(), io::ErrorKind::WouldBlock);
    inner.full.store(false, Ordering::Relaxed);
    inner.broken.store(true, Ordering::Relaxed);
    socket.try_send(&transmit(&[0; 5], None)).unwrap_err();
    let counters = socket.meter().snapshot();
    assert_eq!(
        (
            counters.outgoing.link.offered.packets,
            counters.outgoing.link.offered.bytes
        ),
        (4, 2505)
    );
    assert_eq!(
        (counters.outgoing.sent.packets, counters.outgoing.sent.bytes),
        (3, 2500)
    );
    assert_eq!(
        counters.outgoing.failed,
        Tally {
            packets: 1,
            bytes: 5
        }
    );
}

#[test]
fn received_datagrams_are_counted_one_by_one() {
    for words in ["none", "delay 5ms"] {
        let socket = wrap(&Arc::new(Pretended::default()), words);
        let mut meta = [RecvMeta::default(); 4];
        let mut cx = Context::from_waker(Waker::noop());
        assert!(socket.poll_recv(&mut cx, &mut [], &mut meta).is_ready());
        let counters = socket.meter().snapshot();
        assert_eq!(counters.received.packets, 3 + 1 + 1);
        assert_eq!(counters.received.bytes, 2507);
    }
}

#[test]
fn settings_out_of_range_are_refused() {
    let config = LinkConfig {
        limit: Limit {
            packets: 0,
            bytes: 1,
        },
        ..LinkConfig::default()
    };
    let inner = Arc::new(Pretended::default());
    let wrapped = EmulatedSocket::try_new(inner, config, 1, LinkId::UP, SocketExtras::default());
    assert!(matches!(wrapped, Err(WrapError::Config(_))));
}
