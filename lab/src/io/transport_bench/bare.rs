//! The control: two connected sockets that block, nothing of ours between the message and the kernel.

use std::io::{self, ErrorKind};
use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::time::Duration;

use mmt_shared::io::clock::{Clock, thread_cpu_time};

use super::config::BYTES_MAX;
use super::slice::{Flow, Side, Slice};
use crate::io::failure::Failure;

/// How long a read blocks before it checks whether the slice is over.
const READ_MAX: Duration = Duration::from_millis(10);

/// Both ends.
pub(super) struct BarePair {
    near: UdpSocket,
    far: UdpSocket,
}

impl BarePair {
    pub(super) fn try_new() -> Result<Self, Failure> {
        let any = SocketAddr::from((Ipv4Addr::LOCALHOST, 0));
        let (near, far) = (UdpSocket::bind(any)?, UdpSocket::bind(any)?);
        near.connect(far.local_addr()?)?;
        far.connect(near.local_addr()?)?;
        for socket in [&near, &far] {
            socket.set_read_timeout(Some(READ_MAX))?;
        }
        Ok(Self { near, far })
    }

    /// Sends the slice's messages at their times and takes their answers.
    pub(super) fn near(&self, slice: &Slice, clock: Clock) -> Result<Side, Failure> {
        let mut side = Side::default();
        let (before, mut buffer) = (thread_cpu_time(), [0; BYTES_MAX]);
        for k in 0..slice.messages {
            clock.sleep_until(slice.due(k));
            let message = slice.message(clock.now());
            send(&self.near, &message, &mut side)?;
            if slice.flow == Flow::RoundTrip {
                // a lost answer costs a read's longest time, and the next message is late then
                while let Some(answer) = receive(&self.near, &mut buffer)? {
                    side.note(slice, answer, clock.now());
                    if answer == message {
                        break;
                    }
                }
            }
        }
        clock.sleep_until(slice.end());
        side.cpu = thread_cpu_time().saturating_sub(before);
        Ok(side)
    }

    /// Takes the slice's messages, and answers them in a round trip.
    pub(super) fn far(&self, slice: &Slice, clock: Clock) -> Result<Side, Failure> {
        let mut side = Side::default();
        let (before, mut buffer) = (thread_cpu_time(), [0; BYTES_MAX]);
        while clock.now() < slice.end() {
            let Some(message) = receive(&self.far, &mut buffer)? else {
                continue;
            };
            match slice.flow {
                Flow::OneWay => side.note(slice, message, clock.now()),
                Flow::RoundTrip => send(&self.far, message, &mut side)?,
            }
        }
        side.cpu = thread_cpu_time().saturating_sub(before);
        Ok(side)
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
