//! A UDP socket of the relay: sends and receives with ECN marks and local addresses, many at a time.

use std::io::{self, IoSliceMut};
use std::net::{IpAddr, SocketAddr, UdpSocket};
use std::os::fd::AsFd;

use quinn::udp::{EcnCodepoint, RecvMeta, Transmit, UdpSocketState};
use rustix::event::{PollFd, PollFlags};

use crate::io::driver::Outcome;

/// Kernel buffers asked for, bytes: bursts of 1000 full packets. The kernel gives what it may.
const KERNEL_BUFFER: usize = 4 << 20;
/// Messages taken at one call.
const BATCH: usize = 8;
/// The largest UDP payload, and the most that the kernel joins into one message.
const MESSAGE_MAX: usize = 65_535;

/// A non-blocking UDP socket.
#[derive(Debug)]
pub(super) struct Port {
    socket: UdpSocket,
    state: UdpSocketState,
}

impl Port {
    pub(super) fn try_new(socket: UdpSocket) -> io::Result<Self> {
        socket.set_nonblocking(true)?;
        let state = UdpSocketState::new((&socket).into())?;
        // Best effort: with small buffers bursts are lost, and the other side's counts show it.
        let _ = state.set_recv_buffer_size((&socket).into(), KERNEL_BUFFER);
        let _ = state.set_send_buffer_size((&socket).into(), KERNEL_BUFFER);
        Ok(Self { socket, state })
    }

    pub(super) fn as_poll_fd(&self) -> PollFd<'_> {
        PollFd::from_borrowed_fd(self.socket.as_fd(), PollFlags::IN)
    }

    /// Sends one datagram. `unreachable` counts the refusals of earlier datagrams that the kernel reports
    /// at this occasion; they cost this datagram nothing.
    pub(super) fn send(&self, transmit: &Transmit<'_>, unreachable: &mut u64) -> Outcome {
        let try_send = || self.state.try_send((&self.socket).into(), transmit);
        let mut sent = try_send();
        if matches!(&sent, Err(error) if error.kind() == io::ErrorKind::ConnectionRefused) {
            *unreachable = unreachable.saturating_add(1);
            sent = try_send();
        }
        match sent {
            Ok(()) => Outcome::Sent,
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => Outcome::Blocked,
            Err(_) => Outcome::Failed,
        }
    }
}

/// One datagram received.
#[derive(Clone, Copy, Debug)]
pub(super) struct Received<'a> {
    pub(super) from: SocketAddr,
    /// The address that it was sent to; an answer should come from there.
    pub(super) local_ip: Option<IpAddr>,
    pub(super) ecn: Option<EcnCodepoint>,
    pub(super) contents: &'a [u8],
}

/// The buffers to receive into.
#[derive(Debug)]
pub(super) struct Receiver(Vec<u8>);

impl Receiver {
    pub(super) fn new() -> Self {
        Self(vec![0; BATCH * MESSAGE_MAX])
    }

    /// Takes one batch out of `port`.
    ///
    /// # Errors
    /// Those of recvmsg; `WouldBlock` when there is nothing more.
    pub(super) fn receive(
        &mut self,
        port: &Port,
        mut take: impl FnMut(Received<'_>),
    ) -> io::Result<()> {
        let mut metas = [RecvMeta::default(); BATCH];
        let mut rest = self.0.chunks_mut(MESSAGE_MAX);
        let mut slices: [IoSliceMut<'_>; BATCH] =
            std::array::from_fn(|_| IoSliceMut::new(rest.next().unwrap_or_default()));
        let messages = port
            .state
            .recv((&port.socket).into(), &mut slices, &mut metas)?;
        for (meta, slice) in metas.iter().zip(&slices).take(messages) {
            let message = slice.get(..meta.len).unwrap_or_default();
            // an empty datagram is one datagram too
            let empty = message.is_empty().then_some(message);
            for contents in message.chunks(meta.stride.max(1)).chain(empty) {
                take(Received {
                    from: meta.addr,
                    local_ip: meta.dst_ip,
                    ecn: meta.ecn,
                    contents,
                });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;
    use std::time::Duration;

    use super::*;

    #[test]
    fn news_that_nobody_listened_costs_the_next_datagram_nothing() {
        let any = (Ipv4Addr::LOCALHOST, 0);
        let vacant = UdpSocket::bind(any).unwrap().local_addr().unwrap();
        let socket = UdpSocket::bind(any).unwrap();
        socket.connect(vacant).unwrap();
        let port = Port::try_new(socket).unwrap();
        let mut unreachable = 0;
        let mut send = |contents: &[u8]| {
            let transmit = Transmit {
                destination: vacant,
                ecn: None,
                contents,
                segment_size: None,
                src_ip: None,
            };
            port.send(&transmit, &mut unreachable)
        };
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
}
