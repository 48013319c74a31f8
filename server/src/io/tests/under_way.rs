//! The port of a session under way: garbage, handshakes that come to nothing, the session's own datagrams again. The session goes
//! on, and nothing of all that is in its counters.

use std::net::UdpSocket;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use mmt_shared::io::connect::connect;
use mmt_shared::io::quic::client_endpoint;
use mmt_shared::io::socket;
use mmt_shared::report::SlaveHalf;
use tokio::task::JoinSet;

use super::master::{PATIENCE, TRAFFIC};
use super::*;

const LOOPBACK: &str = "127.0.0.1:0";
/// Datagrams that are sent to the slave at once: fewer than its socket holds, so that it loses none of the session's.
const AT_ONCE: usize = 40;
/// Handshakes at once: fewer than there are places.
const HANDSHAKES_AT_ONCE: u64 = 20;

/// Between master and slave: sends on what comes, and keeps what the master sent.
#[derive(Clone)]
struct Tap {
    slave: Pairing,
    sent: Arc<Mutex<Vec<Vec<u8>>>>,
    /// What the slave takes for the master.
    as_owner: Arc<UdpSocket>,
    stranger: Arc<UdpSocket>,
}

impl Tap {
    /// Before this slave, and what a master needs to come through it.
    fn before(slave: &Pairing) -> (Self, Pairing) {
        let front = tokio_socket(UdpSocket::bind(LOOPBACK).unwrap());
        let as_owner = UdpSocket::bind(LOOPBACK).unwrap();
        let stranger = UdpSocket::bind(LOOPBACK).unwrap();
        for socket in [&as_owner, &stranger] {
            socket.connect(slave.address.to_string()).unwrap();
        }
        stranger.set_read_timeout(Some(PATIENCE)).unwrap();
        let own = tokio_socket(as_owner.try_clone().unwrap());
        let tap = Self {
            slave: slave.clone(),
            sent: Arc::default(),
            as_owner: Arc::new(as_owner),
            stranger: Arc::new(stranger),
        };
        let pairing = Pairing {
            address: front.local_addr().unwrap().to_string().parse().unwrap(),
            ..slave.clone()
        };
        let sent = Arc::clone(&tap.sent);
        tokio::spawn(async move {
            let (mut up, mut down) = ([0; 2048], [0; 2048]);
            let mut master = None;
            loop {
                tokio::select! {
                    Ok((length, from)) = front.recv_from(&mut up) => {
                        master = Some(from);
                        sent.lock().unwrap().push(up[..length].to_vec());
                        let _ = own.send(&up[..length]).await;
                    }
                    Ok(length) = own.recv(&mut down) => {
                        if let Some(master) = master {
                            let _ = front.send_to(&down[..length], master).await;
                        }
                    }
                }
            }
        });
        (tap, pairing)
    }

    /// Sends these, from the owner's address and a stranger's in turn, no faster than the slave reads.
    fn send(&self, datagrams: impl Iterator<Item = Vec<u8>>) -> usize {
        let mut count = 0;
        for datagram in datagrams {
            let from = [&self.as_owner, &self.stranger][count % 2];
            // the socket is full: the slave loses nothing that it was sent
            while from.send(&datagram).is_err() {
                std::thread::yield_now();
            }
            count += 1;
            if count % AT_ONCE == 0 {
                self.until_read();
            }
        }
        self.until_read();
        count
    }

    /// Until the slave has read what it was sent: it has answered a version of QUIC that is none.
    fn until_read(&self) {
        static NUMBER: AtomicU64 = AtomicU64::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let mut probe = [0; 1200];
        probe[..6].copy_from_slice(&[0xc0, 0x1a, 0x2a, 0x3a, 0x4a, 8]);
        probe[6..14].copy_from_slice(&number.to_be_bytes());
        probe[14] = 8;
        probe[15..23].copy_from_slice(&number.to_be_bytes());
        self.stranger.send(&probe).unwrap();
        let mut answer = [0; 2048];
        loop {
            let length = self.stranger.recv(&mut answer).unwrap();
            // version 0, and our number as the one whom it answers
            let is_answer = answer[1..5] == [0; 4] && answer[6..14] == number.to_be_bytes();
            if length > 14 && is_answer {
                return;
            }
        }
    }

    /// What the master has sent so far.
    fn captured(&self) -> Vec<Vec<u8>> {
        self.sent.lock().unwrap().clone()
    }
}

fn tokio_socket(socket: UdpSocket) -> tokio::net::UdpSocket {
    socket.set_nonblocking(true).unwrap();
    tokio::net::UdpSocket::from_std(socket).unwrap()
}

/// A session that goes on while strangers do this on a thread of their own: its report, and what they made of it. Each of the
/// session's datagrams is applied once, and it ends as finished.
async fn session_beside<T: Send + 'static>(
    strangers: impl FnOnce(&Tap) -> T + Send + 'static,
) -> (RunReport<SlaveConfiguration>, T) {
    let host = run(options());
    let (tap, pairing) = Tap::before(&host.pairing);
    let (mut master, _) = patiently(Master::operate(&pairing)).await;
    patiently(master.push(50)).await;
    let work = std::thread::spawn(move || strangers(&tap));
    while !work.is_finished() {
        patiently(master.push(10)).await;
    }
    let made = work.join().unwrap();
    // what was on its way has come; the slave sends what its tool does while that stands, and no heartbeat then
    for _ in 0..10 {
        patiently(master.read()).await;
    }
    // every one holds a command, and what this host could not send at all is not among them
    let left = master.connection.stats().frame_tx.datagram;
    let (ending, totals) = patiently(master.farewell()).await;
    assert_eq!(ending, Ending::Finished);
    let report = host.end().await.unwrap();
    assert_eq!(report.ending, Some("finished"));
    nothing_lost_and_nothing_foreign(&totals, left);
    (report, made)
}

fn nothing_lost_and_nothing_foreign(totals: &SlaveHalf, left: u64) {
    let session = &totals.session;
    assert_eq!(session.received.commands, Some(left));
    for name in [
        "datagrams_duplicate",
        "datagrams_malformed",
        "datagrams_too_old",
        "datagrams_ring_full",
        "samples_duplicate",
        "samples_implausible",
        "masters_busy",
    ] {
        assert_eq!(
            session.drops.get(name),
            Some(&0),
            "{name}: {:?}",
            session.drops
        );
    }
}

/// Numbers that look random (xorshift64).
fn noise(seed: u64) -> impl FnMut() -> u64 {
    let mut state = seed;
    move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state
    }
}

/// Garbage of four sorts: noise of any length, noise behind the head of a first packet, and datagrams of the session cut off or
/// with a byte changed.
fn garbage(captured: Vec<Vec<u8>>, count: usize) -> impl Iterator<Item = Vec<u8>> {
    let mut noise = noise(11);
    (0..count).map(move |n| {
        let mut own = captured[noise() as usize % captured.len()].clone();
        let at = noise() as usize % own.len();
        let length = noise() as usize % 1200 + 1;
        let mut bytes: Vec<u8> = (0..length).map(|_| noise() as u8).collect();
        match n % 4 {
            0 => bytes,
            1 => {
                // QUIC version 1, as long as a first packet has to be
                bytes.resize(1200, 0x5a);
                bytes[..6].copy_from_slice(&[0xc0, 0, 0, 0, 1, 8]);
                bytes
            }
            2 => {
                own.truncate(at);
                own
            }
            _ => {
                own[at] ^= 1 << (noise() % 8);
                own
            }
        }
    })
}

#[tokio::test]
async fn ten_thousand_datagrams_of_garbage_do_not_disturb_a_session_under_way() {
    const GARBAGE: usize = 10_000;
    let (_, sent) = session_beside(|tap| tap.send(garbage(tap.captured(), GARBAGE))).await;
    assert_eq!(sent, GARBAGE);
}

#[tokio::test]
async fn a_sessions_datagrams_sent_again_are_applied_once() {
    const ROUNDS: usize = 50;
    let again = |tap: &Tap| {
        let captured = tap.captured();
        // an odd number of them: each comes from either address in turn
        let odd = captured.len() - (captured.len() + 1) % 2;
        let rounds = (0..ROUNDS).flat_map(|_| captured.iter().take(odd).cloned());
        tap.send(rounds)
    };
    let (_, sent) = session_beside(again).await;
    // commands had left, and what the handshake took; a busy host packs more into each
    assert!(sent > ROUNDS * 20, "{sent}");
}

/// A handshake of which so many datagrams reach the slave, and then nothing more.
async fn half_way(slave: Pairing, datagrams: usize) {
    let front = tokio_socket(UdpSocket::bind(LOOPBACK).unwrap());
    let own = UdpSocket::bind(LOOPBACK).unwrap();
    own.connect(slave.address.to_string()).unwrap();
    let own = tokio_socket(own);
    let endpoint = socket::bind(LOOPBACK.parse().unwrap()).unwrap();
    let endpoint = client_endpoint(socket::for_quic(endpoint).unwrap()).unwrap();
    let address = front.local_addr().unwrap();
    let client = connect(&endpoint, address, slave.pin, TRAFFIC, PATIENCE);
    let path = async {
        let (mut up, mut down) = ([0; 2048], [0; 2048]);
        let (mut client, mut left) = (None, datagrams);
        loop {
            tokio::select! {
                Ok((length, from)) = front.recv_from(&mut up) => {
                    if left == 0 {
                        return;
                    }
                    (client, left) = (Some(from), left - 1);
                    let _ = own.send(&up[..length]).await;
                }
                Ok(length) = own.recv(&mut down) => {
                    if let Some(client) = client {
                        let _ = front.send_to(&down[..length], client).await;
                    }
                }
            }
        }
    };
    tokio::select! {
        _ = client => {}
        () = path => {}
    }
}

/// A handshake whose hello has a wrong token.
async fn wrong_token(slave: Pairing, n: u64) {
    let mut stranger = Master::connect(&slave).await;
    let token = Token::new([n as u8; 32]);
    let refused = stranger.hello(token, 1000.0).await;
    assert_eq!(refused.unwrap_err(), Refusal::WrongToken);
}

/// Does this so often, so many at once.
async fn often<F>(times: u64, one: impl Fn(u64) -> F)
where
    F: Future<Output = ()> + Send + 'static,
{
    let mut at_work = JoinSet::new();
    for n in 0..times {
        if n >= HANDSHAKES_AT_ONCE {
            at_work.join_next().await.unwrap().unwrap();
        }
        at_work.spawn(one(n));
    }
    while let Some(done) = at_work.join_next().await {
        done.unwrap();
    }
}

#[tokio::test]
async fn a_thousand_handshakes_that_come_to_nothing_do_not_disturb_a_session_under_way() {
    const WRONG: u64 = 300;
    const HALF_WAY: u64 = 700;
    let strangers = |tap: &Tap| {
        let mut runtime = tokio::runtime::Builder::new_current_thread();
        let runtime = runtime.enable_all().build().unwrap();
        runtime.block_on(async {
            often(WRONG, |n| wrong_token(tap.slave.clone(), n)).await;
            // the first packet; with the proof of the address; with the end of the handshake
            often(HALF_WAY, |n| {
                half_way(tap.slave.clone(), n as usize % 3 + 1)
            })
            .await;
        });
    };
    let (report, ()) = session_beside(strangers).await;
    let drops = report.drops.unwrap();
    assert_eq!(drops.get("masters_wrong_token"), Some(&WRONG));
    // those that had proven their address were judged: others took their places, or on a slow host their time ran out
    let judged = ["masters_crowded", "handshakes_failed", "masters_no_hello"];
    let judged: u64 = judged.iter().map(|name| drops[*name]).sum();
    assert!(judged > 100, "{drops:?}");
}
