//! The thread that sends each datagram at its time.

use std::io;
use std::pin::Pin;
use std::sync::{Arc, Mutex};
use std::task::{Context, Poll, Waker};
use std::thread::JoinHandle;
use std::time::Duration;

use mmt_shared::io::realtime;
use mmt_shared::time::Time;
use quinn::udp::EcnCodepoint;
use quinn::{AsyncUdpSocket, UdpPoller};

use super::meter::{SocketMeter, Unsent};
use super::{Datagram, SocketExtras, WrapError};
use crate::config::{ConfigError, LinkConfig};
use crate::direction::{Direction, LinkId};
use crate::fate::{Fate, turn_bit};
use crate::io::alarm::{Alarm, now};
use crate::io::lock;
use crate::io::log::{Dropped, Log};
use crate::pipe::{Pipe, Released};

/// How long the thread waits for a full socket before it drops the datagram: long against the time in
/// which a kernel empties a socket, short against the delays that are emulated.
const PATIENCE: Duration = Duration::from_millis(10);

/// The emulated link of a socket, and its thread. Dropping it ends the thread.
pub(super) struct Release {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

/// What the socket, the thread and who controls them share.
#[derive(Debug)]
pub(super) struct Shared {
    queue: Mutex<Queue>,
    alarm: Arc<Alarm>,
    meter: SocketMeter,
    direction: Direction,
    log: Log,
}

#[derive(Debug)]
struct Queue {
    pipe: Pipe<Parcel>,
    closed: bool,
}

/// A datagram on the link.
#[derive(Clone, Debug)]
struct Parcel {
    datagram: Datagram,
    /// Packets in flight when it was offered.
    backlog: u32,
}

impl Shared {
    /// New settings for the datagrams to come.
    ///
    /// # Errors
    /// A setting out of its range; the old settings stay.
    pub(super) fn reconfigure(&self, config: LinkConfig) -> Result<(), ConfigError> {
        lock(&self.queue).pipe.reconfigure(config)
    }

    /// Puts a datagram on the link now; also whether something is now due sooner than before.
    fn push(&self, datagram: Datagram) -> (Fate, bool) {
        let bytes = datagram.contents.len();
        let mut queue = lock(&self.queue);
        let next = queue.pipe.next_due();
        let backlog = u32::try_from(queue.pipe.in_flight()).unwrap_or(u32::MAX);
        let number = queue.pipe.counters().offered.packets;
        // read under the lock: times of offers never go back
        let offered_at = now();
        let capable = datagram.ecn.is_some();
        let parcel = Parcel { datagram, backlog };
        let fate = queue.pipe.push_ecn(offered_at, bytes, capable, parcel);
        let sooner = queue.pipe.next_due() != next;
        drop(queue);
        if let Fate::Drop(cause) = fate {
            let packet = Dropped {
                number,
                offered_at,
                bytes,
                backlog,
                cause,
            };
            self.log.dropped(self.direction, &packet);
        }
        (fate, sooner)
    }
}

impl Release {
    pub(super) fn start(
        inner: &Arc<dyn AsyncUdpSocket>,
        config: LinkConfig,
        seed: u64,
        id: LinkId,
        meter: &SocketMeter,
        extras: SocketExtras,
    ) -> Result<Self, WrapError> {
        let mut pipe = Pipe::try_new(config, seed, id)?;
        pipe.set_origin(now());
        let shared = Arc::new(Shared {
            queue: Mutex::new(Queue {
                pipe,
                closed: false,
            }),
            alarm: Arc::new(Alarm::try_new()?),
            meter: meter.clone(),
            direction: id.direction,
            log: Log::new(extras.record),
        });
        if let Some(control) = extras.control {
            control.attach(&shared)?;
        }
        let sender = Sender {
            poller: inner.clone().create_io_poller(),
            inner: inner.clone(),
            waker: Waker::from(shared.alarm.clone()),
            shared: shared.clone(),
        };
        let thread = std::thread::Builder::new()
            .name("netem-send".to_owned())
            .spawn(move || sender.run())?;
        Ok(Self {
            shared,
            thread: Some(thread),
        })
    }

    /// Puts a datagram on the link, now.
    pub(super) fn offer(&self, datagram: Datagram) {
        let bytes = datagram.contents.len();
        self.shared.meter.offered(bytes);
        let (fate, sooner) = self.shared.push(datagram);
        match fate {
            Fate::Drop(cause) => self.shared.meter.dropped(cause, bytes),
            Fate::Deliver(deliveries) => {
                for _ in deliveries.copies() {
                    self.shared.meter.duplicated(bytes);
                }
            }
        }
        if sooner {
            self.shared.alarm.ring();
        }
    }
}

impl Drop for Release {
    fn drop(&mut self) {
        lock(&self.shared.queue).closed = true;
        self.shared.alarm.ring();
        if let Some(thread) = self.thread.take() {
            // It panicked: there is nothing left to end.
            let _ = thread.join();
        }
    }
}

/// What the thread does next.
enum Step {
    Send(Released<Parcel>),
    Wait(Option<Time>),
    End,
}

/// The thread's own half.
struct Sender {
    inner: Arc<dyn AsyncUdpSocket>,
    poller: Pin<Box<dyn UdpPoller>>,
    waker: Waker,
    shared: Arc<Shared>,
}

impl Sender {
    fn run(mut self) {
        // what the host does not grant, the lateness shows
        let _ = realtime::request();
        loop {
            match self.step() {
                Step::Send(packet) => self.release(packet),
                // Only a program error makes the wait fail; to end beats to spin.
                Step::Wait(until) if self.shared.alarm.wait(until).is_ok() => {}
                Step::Wait(_) | Step::End => break self.abandon(),
            }
        }
    }

    fn step(&self) -> Step {
        let mut queue = lock(&self.shared.queue);
        if queue.closed {
            return Step::End;
        }
        match queue.pipe.pop_due(now()) {
            Some(packet) => Step::Send(packet),
            None => Step::Wait(queue.pipe.next_due()),
        }
    }

    fn release(&mut self, mut packet: Released<Parcel>) {
        let shared = self.shared.clone();
        if let Some(bit) = packet.corrupted_bit {
            turn_bit(&mut packet.payload.datagram.contents, bit);
        }
        if packet.marked {
            packet.payload.datagram.ecn = Some(EcnCodepoint::Ce);
        }
        let moment = now();
        shared.meter.recorder().record(packet.due, moment);
        let sent = self.send(&packet.payload.datagram);
        match sent {
            Ok(()) => shared.meter.sent(packet.bytes),
            Err(why) => shared.meter.unsent(why, packet.bytes),
        }
        let backlog = packet.payload.backlog;
        let log = &shared.log;
        log.released(shared.direction, &packet, backlog, sent.is_ok(), moment);
    }

    /// Sends, waiting at most [`PATIENCE`] for room in the socket.
    fn send(&mut self, datagram: &Datagram) -> Result<(), Unsent> {
        let deadline = now() + PATIENCE;
        loop {
            match self.inner.try_send(&datagram.as_transmit()) {
                Ok(()) => return Ok(()),
                Err(error) if error.kind() != io::ErrorKind::WouldBlock => {
                    return Err(Unsent::Failed);
                }
                Err(_) if now() >= deadline => return Err(Unsent::Blocked),
                Err(_) => self.wait_for_room(deadline)?,
            }
        }
    }

    fn wait_for_room(&mut self, deadline: Time) -> Result<(), Unsent> {
        let mut cx = Context::from_waker(&self.waker);
        match self.poller.as_mut().poll_writable(&mut cx) {
            Poll::Ready(Ok(())) => Ok(()),
            Poll::Ready(Err(_)) => Err(Unsent::Failed),
            Poll::Pending => {
                let waited = self.shared.alarm.wait(Some(deadline));
                waited.map_err(|_| Unsent::Failed)
            }
        }
    }

    fn abandon(&self) {
        let mut queue = lock(&self.shared.queue);
        while let Some(packet) = queue.pipe.pop_due(Time::MAX) {
            self.shared.meter.unsent(Unsent::Abandoned, packet.bytes);
        }
    }
}
