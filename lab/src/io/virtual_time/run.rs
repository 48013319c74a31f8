//! One run: handshake, messages up at a fixed rate, heartbeats down, and what became of each message.
//!
//! Packets are delivered one at a time and every task runs to its end before the next: so each message is known to
//! have come with the packet just delivered. At one instant arrivals come first, then timers, then sending.

use std::future::Future;
use std::net::{Ipv4Addr, SocketAddr};
use std::pin::pin;
use std::sync::{Arc, Mutex};
use std::task::{Context, Poll, Waker};
use std::time::Duration;

use bytes::Bytes;
use mmt_netem::LinkId;
use mmt_shared::time::{Time, duration_nanos};
use quinn::{Connection, ConnectionError, Endpoint};

use super::ends::{Ends, MemorySocket, ends};
use super::executor::{Executor, lock};
use super::path::{Datagram, OneWay};
use crate::io::failure::Failure;
use crate::transport::{Case, FlowOutcome, HEARTBEAT, HEARTBEAT_BYTES, Log, Sent};

/// Is called for each packet that came: when, and what the path itself took for it.
type Arrived<'a> = &'a mut dyn FnMut(Time, Duration) -> Result<(), Failure>;

/// Name given to the TLS library, which requires one; it is not sent.
const SERVER_NAME: &str = "mmt";
/// A handshake that takes longer than this has failed.
const HANDSHAKE_MAX: Time = Time::from_millis(30_000);
/// Messages begin at the first multiple of this after the handshake.
const START_GRID: Duration = Duration::from_secs(1);

/// Runs `case` in virtual time.
///
/// # Errors
/// The link's settings are out of range, or quinn refuses to connect or to send.
pub fn run(case: &Case) -> Result<FlowOutcome, Failure> {
    Setup::new(case)?.measure(case)
}

/// One direction with the socket at its far end.
struct Direction {
    path: Arc<Mutex<OneWay>>,
    far: Arc<MemorySocket>,
}

struct Setup {
    executor: Executor,
    up: Direction,
    down: Direction,
    ends: Ends,
}

/// Both ends of the connection.
struct Pair {
    master: Connection,
    slave: Connection,
}

impl Setup {
    fn new(case: &Case) -> Result<Self, Failure> {
        let executor = Executor::new();
        let address = |host| SocketAddr::from((Ipv4Addr::new(192, 0, 2, host), 4433));
        let path = |id| OneWay::try_new(&case.conditions, case.seed, id);
        let up = Arc::new(Mutex::new(path(LinkId::UP)?));
        let down = Arc::new(Mutex::new(path(LinkId::DOWN)?));
        let master = MemorySocket::new(&executor, address(1), address(2), Arc::clone(&up));
        let slave = MemorySocket::new(&executor, address(2), address(1), Arc::clone(&down));
        let ends = ends(case, &executor, Arc::clone(&master), Arc::clone(&slave))?;
        Ok(Self {
            executor,
            up: Direction {
                path: up,
                far: slave,
            },
            down: Direction {
                path: down,
                far: master,
            },
            ends,
        })
    }

    /// The connection's two ends, once both have finished the handshake.
    fn shake_hands(&self) -> Result<Pair, Failure> {
        let (client, address) = (self.ends.client.clone(), self.ends.slave.local_addr()?);
        let connecting = self
            .ends
            .master
            .connect_with(client, address, SERVER_NAME)?;
        let mut connecting = pin!(connecting);
        let mut accepting = pin!(accept(&self.ends.slave));
        let context = &mut Context::from_waker(Waker::noop());
        let (mut master, mut slave) = (None, None);
        loop {
            self.executor.settle();
            if master.is_none() {
                master = finished(connecting.as_mut().poll(context))?;
            }
            if slave.is_none() {
                slave = finished(accepting.as_mut().poll(context))?.flatten();
            }
            if let (Some(master), Some(slave)) = (&master, &slave) {
                let (master, slave) = (Connection::clone(master), Connection::clone(slave));
                return Ok(Pair { master, slave });
            }
            let next = self.next_event().filter(|at| *at < HANDSHAKE_MAX);
            let next = next.ok_or("the handshake was not over in time")?;
            self.pass(next, &mut |_, _| Ok(()))?;
        }
    }

    fn measure(&self, case: &Case) -> Result<FlowOutcome, Failure> {
        let pair = self.shake_hands()?;
        let start = next_on_grid(self.executor.time());
        let (now, outage) = (self.executor.time(), case.outage(start));
        for direction in [&self.up, &self.down] {
            lock(&direction.path).set_outage(now, &outage)?;
        }
        let mut log = Log::new(case, start);
        let before = self.sent();
        let (end, over) = (case.end(start), case.over(start));
        let mut beat = start;
        while self.executor.time() < over {
            let due = log.next_send().min(beat);
            let due = Some(due).filter(|due| *due < end);
            let now = self.next_event().into_iter().chain(due).min();
            let now = now.unwrap_or(over).min(over);
            self.pass(now, &mut |at, own| {
                read_all(&pair.master, |_| {})?;
                read_all(&pair.slave, |message| log.arrived(message, at, own))
            })?;
            if due == Some(now) && log.next_send() == now {
                let message = Bytes::from(log.send());
                pair.master.send_datagram(message)?;
            }
            if due == Some(now) && beat == now {
                pair.slave
                    .send_datagram(Bytes::from_static(&[0; HEARTBEAT_BYTES]))?;
                beat += HEARTBEAT;
            }
            self.executor.settle();
        }
        let after = self.sent();
        Ok(log.outcome(after.0.since(before.0), after.1.since(before.1)))
    }

    /// Lets time go on to `now` and everything happen that is due; calls `arrived` for each packet, after the
    /// tasks have run.
    fn pass(&self, now: Time, arrived: Arrived<'_>) -> Result<(), Failure> {
        self.executor.jump(now);
        for direction in [&self.up, &self.down] {
            while let Some(datagram) = direction.poll(now) {
                let own = datagram.own;
                direction.far.deliver(datagram);
                self.executor.settle();
                arrived(now, own)?;
            }
        }
        self.executor.fire();
        self.executor.settle();
        Ok(())
    }

    /// When something happens next if nobody sends.
    fn next_event(&self) -> Option<Time> {
        let timer = self.executor.next_timer();
        let packets = [&self.up, &self.down].map(|way| lock(&way.path).poll_timeout());
        timer.into_iter().chain(packets.into_iter().flatten()).min()
    }

    fn sent(&self) -> (Sent, Sent) {
        (lock(&self.up.path).sent(), lock(&self.down.path).sent())
    }
}

impl Direction {
    fn poll(&self, now: Time) -> Option<Datagram> {
        lock(&self.path).poll(now)
    }
}

impl Drop for Setup {
    fn drop(&mut self) {
        // tasks hold the executor, which holds the tasks
        self.executor.stop();
    }
}

async fn accept(endpoint: &Endpoint) -> Result<Option<Connection>, ConnectionError> {
    match endpoint.accept().await {
        Some(incoming) => incoming.await.map(Some),
        None => Ok(None),
    }
}

fn finished<T, E>(poll: Poll<Result<T, E>>) -> Result<Option<T>, E> {
    match poll {
        Poll::Ready(result) => result.map(Some),
        Poll::Pending => Ok(None),
    }
}

/// Hands every datagram that has come to `each`. Nobody need be woken: who calls this calls it after each packet.
fn read_all(connection: &Connection, mut each: impl FnMut(&[u8])) -> Result<(), Failure> {
    let context = &mut Context::from_waker(Waker::noop());
    while let Poll::Ready(message) = pin!(connection.read_datagram()).poll(context) {
        each(&message?);
    }
    Ok(())
}

fn next_on_grid(now: Time) -> Time {
    let grid = duration_nanos(START_GRID);
    Time::from_nanos(now.as_nanos().div_ceil(grid).saturating_mul(grid))
}
