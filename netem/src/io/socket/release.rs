//! The thread that sends each datagram at its time.

use std::io;
use std::net::{IpAddr, SocketAddr};
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard};
use std::task::{Context, Poll, Waker};
use std::thread::JoinHandle;
use std::time::Duration;

use mmt_shared::io::alarm::Alarm;
use mmt_shared::io::realtime;
use mmt_shared::time::Time;
use quinn::udp::Transmit;
use quinn::{AsyncUdpSocket, UdpPoller};

use super::meter::SocketMeter;
use crate::config::{ConfigError, LinkConfig};
use crate::direction::LinkId;
use crate::io::driver::{Datagram, Driver, Outcome};
use crate::io::record_file::RecordWriter;
use crate::io::{lock, now};
use crate::packet::Departure;

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
}

#[derive(Debug)]
struct Queue {
    driver: Driver<Address>,
    closed: bool,
}

impl Shared {
    /// New settings from now on.
    ///
    /// # Errors
    /// A setting out of its range; the old settings stay.
    pub(super) fn reconfigure(&self, config: LinkConfig) -> Result<(), ConfigError> {
        lock(&self.queue).driver.reconfigure(now(), config)?;
        // what waits may be due sooner now
        self.alarm.ring();
        Ok(())
    }

    /// Lets everybody see what was counted, before the lock is given back.
    fn publish(&self, queue: &MutexGuard<'_, Queue>) {
        self.meter.publish(queue.driver.counters());
    }
}

impl Release {
    pub(super) fn start(
        inner: &Arc<dyn AsyncUdpSocket>,
        config: LinkConfig,
        seed: u64,
        id: LinkId,
        meter: &SocketMeter,
        record: Option<RecordWriter>,
    ) -> Result<Self, WrapError> {
        let driver = Driver::try_new(config, seed, id, now(), record, meter.recorder())?;
        let shared = Arc::new(Shared {
            queue: Mutex::new(Queue {
                driver,
                closed: false,
            }),
            alarm: Arc::new(Alarm::try_new()?),
            meter: meter.clone(),
        });
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

    /// What new settings are given to.
    pub(super) fn shared(&self) -> &Arc<Shared> {
        &self.shared
    }

    /// Puts a datagram on the link, now.
    pub(super) fn offer(&self, datagram: Datagram<Address>) {
        let mut queue = lock(&self.shared.queue);
        let next = queue.driver.poll_timeout();
        // read under the lock: times of offers never go back
        queue.driver.offer(now(), datagram);
        let sooner = queue.driver.poll_timeout() != next;
        self.shared.publish(&queue);
        drop(queue);
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
    Send(Departure<Datagram<Address>>),
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
                Step::Send(packet) => self.release(&packet),
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
        if let Some(packet) = queue.driver.poll(now()) {
            return Step::Send(packet);
        }
        self.shared.publish(&queue);
        Step::Wait(queue.driver.poll_timeout())
    }

    fn release(&mut self, packet: &Departure<Datagram<Address>>) {
        let moment = now();
        let outcome = self.send(&packet.payload);
        let mut queue = lock(&self.shared.queue);
        queue.driver.finish(packet, outcome, moment);
        self.shared.publish(&queue);
    }

    /// Sends, waiting at most [`PATIENCE`] for room in the socket.
    fn send(&mut self, datagram: &Datagram<Address>) -> Outcome {
        let transmit = Transmit {
            destination: datagram.address.destination,
            ecn: datagram.ecn,
            contents: &datagram.contents,
            segment_size: None,
            src_ip: datagram.address.src_ip,
        };
        let deadline = now() + PATIENCE;
        loop {
            match self.inner.try_send(&transmit) {
                Ok(()) => return Outcome::Sent,
                Err(error) if error.kind() != io::ErrorKind::WouldBlock => return Outcome::Failed,
                Err(_) if now() >= deadline => return Outcome::Blocked,
                Err(_) if self.wait_for_room(deadline).is_err() => return Outcome::Failed,
                Err(_) => {}
            }
        }
    }

    fn wait_for_room(&mut self, deadline: Time) -> io::Result<()> {
        let mut cx = Context::from_waker(&self.waker);
        match self.poller.as_mut().poll_writable(&mut cx) {
            Poll::Ready(ready) => ready,
            Poll::Pending => self.shared.alarm.wait(Some(deadline)),
        }
    }

    fn abandon(&self) {
        let mut queue = lock(&self.shared.queue);
        queue.driver.abandon();
        self.shared.publish(&queue);
    }
}

/// Where an outgoing datagram goes, and from which address.
#[derive(Clone, Copy, Debug)]
pub(super) struct Address {
    pub(super) destination: SocketAddr,
    pub(super) src_ip: Option<IpAddr>,
}

/// A socket could not be wrapped.
#[derive(Debug, thiserror::Error)]
pub enum WrapError {
    /// The settings of the link are out of range.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The system gave no event descriptor or no thread.
    #[error("no thread for the emulated link: {0}")]
    Thread(#[from] io::Error),
}
