//! A UDP socket of the relay: what it receives has the kernel's time of arrival, the address that it was sent to and
//! the whole traffic class (DSCP and ECN); what it sends can have the latter two.
//!
//! It counts what the kernel dropped because nobody read in time.

use std::cell::Cell;
use std::io::{self, IoSlice};
use std::net::{IpAddr, SocketAddr, UdpSocket};
use std::os::fd::{AsFd, AsRawFd, BorrowedFd};

use nix::libc::{in_addr, in_pktinfo, in6_addr, in6_pktinfo};
use nix::sys::socket::{
    ControlMessage, MsgFlags, SockaddrStorage, getsockopt, sendmsg, setsockopt, sockopt,
};
use quinn::udp::UdpSocketState;

use crate::io::driver::Outcome;

mod receiver;

pub(super) use receiver::{Received, Receiver};

/// Kernel buffers asked for, bytes: bursts of 1000 full packets. The kernel gives what it may.
const KERNEL_BUFFER: usize = 4 << 20;

/// A non-blocking UDP socket.
#[derive(Debug)]
pub(super) struct Port {
    socket: UdpSocket,
    /// Datagrams that the kernel has dropped so far, as it counts them, and how many of them are reported.
    overflows: Cell<u32>,
    reported: Cell<u32>,
    /// Whom the socket is connected to, if to anybody.
    peer: Option<SocketAddr>,
    /// Whether it is bound to all addresses of the host.
    of_any_address: bool,
    /// The traffic class that the socket gives what it sends, and whether over IPv4; none before the first.
    class: Cell<Option<(bool, u8)>>,
}

impl AsFd for Port {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.socket.as_fd()
    }
}

/// Where a datagram goes, from which address, and in which traffic class.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sending {
    pub(super) to: SocketAddr,
    pub(super) from: Option<IpAddr>,
    pub(super) class: u8,
}

impl Port {
    pub(super) fn try_new(socket: UdpSocket) -> io::Result<Self> {
        socket.set_nonblocking(true)?;
        // asks for addresses, traffic class and joined messages
        let state = UdpSocketState::new((&socket).into())?;
        // Best effort: with small buffers bursts are lost, and the counts show it.
        if setsockopt(&socket, sockopt::RcvBufForce, &KERNEL_BUFFER).is_err() {
            let _ = state.set_recv_buffer_size((&socket).into(), KERNEL_BUFFER);
        }
        let _ = state.set_send_buffer_size((&socket).into(), KERNEL_BUFFER);
        setsockopt(&socket, sockopt::ReceiveTimestampns, &true)?;
        setsockopt(&socket, sockopt::RxqOvfl, &1)?;
        Ok(Self {
            peer: socket.peer_addr().ok(),
            of_any_address: socket.local_addr()?.ip().is_unspecified(),
            class: Cell::new(None),
            socket,
            overflows: Cell::new(0),
            reported: Cell::new(0),
        })
    }

    /// How much the kernel keeps for who reads late, bytes of its own count.
    pub(super) fn room(&self) -> usize {
        getsockopt(&self.socket, sockopt::RcvBuf).unwrap_or_default()
    }

    /// How many datagrams the kernel has dropped since the last call, as far as what was received shows it.
    pub(super) fn new_overflows(&self) -> u64 {
        let all = self.overflows.get();
        all.wrapping_sub(self.reported.replace(all)).into()
    }

    /// Sends one datagram. `unreachable` counts the refusals of earlier datagrams that the kernel reports
    /// at this occasion; they cost this datagram nothing.
    pub(super) fn send(&self, sending: Sending, contents: &[u8], unreachable: &mut u64) -> Outcome {
        let mut sent = self.try_send(sending, contents);
        if matches!(&sent, Err(error) if error.kind() == io::ErrorKind::ConnectionRefused) {
            *unreachable = unreachable.saturating_add(1);
            sent = self.try_send(sending, contents);
        }
        match sent {
            Ok(()) => Outcome::Sent,
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => Outcome::Blocked,
            Err(_) => Outcome::Failed,
        }
    }

    fn try_send(&self, sending: Sending, contents: &[u8]) -> io::Result<()> {
        self.take_class(sending)?;
        if let Some(from) = sending.from.filter(|_| self.of_any_address) {
            return self.send_from(from, sending.to, contents);
        }
        // without an address and a class of its own a packet to the peer needs no look at the routes
        let sent = if self.peer == Some(sending.to) {
            self.socket.send(contents)
        } else {
            self.socket.send_to(contents, sending.to)
        };
        sent.map(|_| ())
    }

    /// Gives all that the socket sends from now on the traffic class of this datagram.
    fn take_class(&self, sending: Sending) -> io::Result<()> {
        let v4 = is_v4(sending.to.ip());
        if self.class.get() == Some((v4, sending.class)) {
            return Ok(());
        }
        let of_all = i32::from(sending.class);
        if v4 {
            setsockopt(&self.socket, sockopt::Ipv4Tos, &of_all)?;
        } else {
            setsockopt(&self.socket, sockopt::Ipv6TClass, &of_all)?;
        }
        self.class.set(Some((v4, sending.class)));
        Ok(())
    }

    fn send_from(&self, from: IpAddr, to: SocketAddr, contents: &[u8]) -> io::Result<()> {
        let (mut from_v4, mut from_v6) = (NO_ADDRESS_V4, NO_ADDRESS_V6);
        let from = match from {
            IpAddr::V4(ip) => {
                from_v4.ipi_spec_dst.s_addr = u32::from(ip).to_be();
                ControlMessage::Ipv4PacketInfo(&from_v4)
            }
            IpAddr::V6(ip) => {
                from_v6.ipi6_addr.s6_addr = ip.octets();
                ControlMessage::Ipv6PacketInfo(&from_v6)
            }
        };
        sendmsg(
            self.socket.as_raw_fd(),
            &[IoSlice::new(contents)],
            &[from],
            MsgFlags::empty(),
            Some(&SockaddrStorage::from(to)),
        )?;
        Ok(())
    }
}

const NO_ADDRESS_V4: in_pktinfo = in_pktinfo {
    ipi_ifindex: 0,
    ipi_spec_dst: in_addr { s_addr: 0 },
    ipi_addr: in_addr { s_addr: 0 },
};

const NO_ADDRESS_V6: in6_pktinfo = in6_pktinfo {
    ipi6_addr: in6_addr { s6_addr: [0; 16] },
    ipi6_ifindex: 0,
};

/// Whether packets to this address are IPv4, even out of an IPv6 socket.
fn is_v4(ip: IpAddr) -> bool {
    match ip {
        IpAddr::V4(_) => true,
        IpAddr::V6(ip) => ip.to_ipv4_mapped().is_some(),
    }
}

#[cfg(test)]
mod tests;
