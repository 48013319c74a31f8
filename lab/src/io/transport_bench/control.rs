//! The control: two connected sockets that block, nothing of ours between the message and the kernel.

use std::io::{self, ErrorKind};
use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::time::Duration;

use mmt_shared::io::clock::{Clock, thread_cpu_time};

use super::cores::Places;
use super::slice::{Side, Slice, Turn};
use super::{BYTES_MAX, BenchError, Flow};

/// How long a read blocks before it looks whether the slice is over.
const LOOK: Duration = Duration::from_millis(10);

/// Both ends.
pub(super) struct Control {
    clock: Clock,
    near: UdpSocket,
    far: UdpSocket,
}

impl Control {
    pub(super) fn try_new(clock: Clock) -> Result<Self, BenchError> {
        let any = SocketAddr::from((Ipv4Addr::LOCALHOST, 0));
        let (near, far) = (UdpSocket::bind(any)?, UdpSocket::bind(any)?);
        near.connect(far.local_addr()?)?;
        far.connect(near.local_addr()?)?;
        for socket in [&near, &far] {
            socket.set_read_timeout(Some(LOOK))?;
        }
        Ok(Self { clock, near, far })
    }

    pub(super) fn turn(&mut self, places: &Places, slice: &Slice) -> Result<Turn, BenchError> {
        let this = &*self;
        places.turn(|| this.near(slice), || this.far(slice))
    }

    fn near(&self, slice: &Slice) -> Result<Side, BenchError> {
        let mut side = Side::new();
        let before = thread_cpu_time();
        for k in 0..slice.messages {
            self.clock.sleep_until(slice.due(k));
            let message = slice.message(self.clock.now());
            send(&self.near, &message, &mut side)?;
            if slice.flow == Flow::RoundTrip {
                self.await_answer(slice, &message, &mut side)?;
            }
        }
        self.clock.sleep_until(slice.end());
        side.cpu = thread_cpu_time().saturating_sub(before);
        Ok(side)
    }

    /// Waits for the answer to `message`, and takes in those that were late before it. A lost one costs a look, and
    /// the next message is late then.
    fn await_answer(&self, slice: &Slice, message: &[u8], side: &mut Side) -> io::Result<()> {
        let mut buffer = [0; BYTES_MAX];
        while let Some(answer) = receive(&self.near, &mut buffer)? {
            self.note(slice, answer, side);
            if answer == message {
                break;
            }
        }
        Ok(())
    }

    fn far(&self, slice: &Slice) -> Result<Side, BenchError> {
        let mut side = Side::new();
        let before = thread_cpu_time();
        while self.clock.now() < slice.end() {
            let mut buffer = [0; BYTES_MAX];
            let Some(message) = receive(&self.far, &mut buffer)? else {
                continue;
            };
            match slice.flow {
                Flow::OneWay => self.note(slice, message, &mut side),
                Flow::RoundTrip => send(&self.far, message, &mut side)?,
            }
        }
        side.cpu = thread_cpu_time().saturating_sub(before);
        Ok(side)
    }

    fn note(&self, slice: &Slice, message: &[u8], side: &mut Side) {
        let now = self.clock.now();
        let sent = slice.sent_at(message);
        side.took.extend(sent.map(|at| now.saturating_since(at)));
    }
}

fn send(socket: &UdpSocket, message: &[u8], side: &mut Side) -> io::Result<()> {
    socket.send(message)?;
    side.sent += 1;
    side.packets += 1;
    side.bytes += message.len() as u64;
    Ok(())
}

fn receive<'a>(socket: &UdpSocket, buffer: &'a mut [u8]) -> io::Result<Option<&'a [u8]>> {
    match socket.recv(buffer) {
        Ok(length) => Ok(buffer.get(..length)),
        Err(error) => match error.kind() {
            ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted => Ok(None),
            _ => Err(error),
        },
    }
}
