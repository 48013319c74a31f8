//! A UDP socket of the relay: what it receives has the kernel's time of arrival, the address that it was sent to and
//! the whole traffic class (DSCP and ECN); what it sends can have the latter two.
//!
//! It counts what the kernel dropped because nobody read in time.

use std::cell::Cell;
use std::io::{self, IoSlice, IoSliceMut};
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, UdpSocket};
use std::os::fd::{AsFd, AsRawFd, BorrowedFd};
use std::time::{Duration, SystemTime};

use mmt_shared::time::Time;
use nix::libc::{in_addr, in_pktinfo, in6_addr, in6_pktinfo};
use nix::sys::socket::{
    ControlMessage, ControlMessageOwned, MsgFlags, SockaddrStorage, recvmsg, sendmsg, setsockopt,
    sockopt,
};
use quinn::udp::UdpSocketState;
use rustix::event::{PollFd, PollFlags};

use crate::io::driver::Outcome;
use crate::io::now;

/// Kernel buffers asked for, bytes: bursts of 1000 full packets. The kernel gives what it may.
const KERNEL_BUFFER: usize = 4 << 20;
/// Messages taken at one call.
const BATCH: usize = 8;
/// The largest UDP payload, and the most that the kernel joins into one message.
const MESSAGE_MAX: usize = 65_535;
/// Room for the five control messages that the kernel may add to a message, bytes.
const CONTROL_MAX: usize = 256;

/// A non-blocking UDP socket.
#[derive(Debug)]
pub(super) struct Port {
    socket: UdpSocket,
    /// Datagrams that the kernel has dropped so far, as it counts them, and how many of them are reported.
    overflows: Cell<u32>,
    reported: Cell<u32>,
    /// Whom the socket is connected to, if to anybody.
    peer: Option<SocketAddr>,
    /// The traffic class that the socket gives what it sends to its peer; none before the first.
    class: Cell<Option<u8>>,
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
        let _ = state.set_recv_buffer_size((&socket).into(), KERNEL_BUFFER);
        let _ = state.set_send_buffer_size((&socket).into(), KERNEL_BUFFER);
        setsockopt(&socket, sockopt::ReceiveTimestampns, &true)?;
        setsockopt(&socket, sockopt::RxqOvfl, &1)?;
        Ok(Self {
            peer: socket.peer_addr().ok(),
            class: Cell::new(None),
            socket,
            overflows: Cell::new(0),
            reported: Cell::new(0),
        })
    }

    pub(super) fn as_poll_fd(&self) -> PollFd<'_> {
        PollFd::from_borrowed_fd(self.socket.as_fd(), PollFlags::IN)
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
        if self.peer == Some(sending.to) && sending.from.is_none() {
            return self.send_to_peer(sending.class, contents);
        }
        let (class_v4, class_v6) = (sending.class, i32::from(sending.class));
        let class = if is_v4(sending.to.ip()) {
            ControlMessage::Ipv4Tos(&class_v4)
        } else {
            ControlMessage::Ipv6TClass(&class_v6)
        };
        let (mut from_v4, mut from_v6) = (NO_ADDRESS_V4, NO_ADDRESS_V6);
        let from = match sending.from {
            Some(IpAddr::V4(ip)) => {
                from_v4.ipi_spec_dst.s_addr = u32::from(ip).to_be();
                Some(ControlMessage::Ipv4PacketInfo(&from_v4))
            }
            Some(IpAddr::V6(ip)) => {
                from_v6.ipi6_addr.s6_addr = ip.octets();
                Some(ControlMessage::Ipv6PacketInfo(&from_v6))
            }
            None => None,
        };
        let messages = [class].into_iter().chain(from).collect::<Vec<_>>();
        let to = SockaddrStorage::from(sending.to);
        sendmsg(
            self.socket.as_raw_fd(),
            &[IoSlice::new(contents)],
            &messages,
            MsgFlags::empty(),
            Some(&to),
        )?;
        Ok(())
    }
}

impl Port {
    /// Without an address and a class of its own a packet needs no look at the routes.
    fn send_to_peer(&self, class: u8, contents: &[u8]) -> io::Result<()> {
        if self.class.get() != Some(class) {
            let of_all = i32::from(class);
            if self.peer.is_some_and(|peer| is_v4(peer.ip())) {
                setsockopt(&self.socket, sockopt::Ipv4Tos, &of_all)?;
            } else {
                setsockopt(&self.socket, sockopt::Ipv6TClass, &of_all)?;
            }
            self.class.set(Some(class));
        }
        self.socket.send(contents).map(|_| ())
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

/// One datagram received.
#[derive(Clone, Copy, Debug)]
pub(super) struct Received<'a> {
    pub(super) from: SocketAddr,
    /// The address that it was sent to; an answer should come from there.
    pub(super) local_ip: Option<IpAddr>,
    /// DSCP and ECN.
    pub(super) class: u8,
    /// When the kernel took it in.
    pub(super) arrived: Time,
    pub(super) contents: &'a [u8],
}

/// What the kernel adds to a message.
#[derive(Default)]
struct Notes {
    local_ip: Option<IpAddr>,
    class: u8,
    /// Time since the Unix epoch.
    arrived: Option<Duration>,
    stride: Option<usize>,
    overflows: Option<u32>,
}

impl Notes {
    fn take(&mut self, message: ControlMessageOwned) {
        match message {
            ControlMessageOwned::Ipv4PacketInfo(info) => {
                let ip = Ipv4Addr::from(u32::from_be(info.ipi_addr.s_addr));
                self.local_ip = Some(ip.into());
            }
            ControlMessageOwned::Ipv6PacketInfo(info) => {
                self.local_ip = Some(Ipv6Addr::from(info.ipi6_addr.s6_addr).into());
            }
            ControlMessageOwned::Ipv4Tos(class) => self.class = class,
            ControlMessageOwned::Ipv6TClass(class) => self.class = class as u8,
            ControlMessageOwned::ScmTimestampns(at) => self.arrived = Some(at.into()),
            ControlMessageOwned::UdpGroSegments(bytes) => self.stride = usize::try_from(bytes).ok(),
            ControlMessageOwned::RxqOvfl(overflows) => self.overflows = Some(overflows),
            _ => {}
        }
    }
}

/// The buffers to receive into.
#[derive(Debug)]
pub(super) struct Receiver {
    contents: Vec<u8>,
    control: Vec<u8>,
}

impl Receiver {
    pub(super) fn new() -> Self {
        Self {
            contents: vec![0; MESSAGE_MAX],
            control: vec![0; CONTROL_MAX],
        }
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
        let since_epoch = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
        let (since_epoch, moment) = (since_epoch.unwrap_or_default(), now());
        for taken in 0..BATCH {
            match self.receive_one(port, since_epoch, moment, &mut take) {
                Ok(()) => {}
                // the next call meets it again
                Err(error) if taken > 0 && error.kind() == io::ErrorKind::WouldBlock => break,
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    fn receive_one(
        &mut self,
        port: &Port,
        since_epoch: Duration,
        moment: Time,
        take: &mut impl FnMut(Received<'_>),
    ) -> io::Result<()> {
        let mut slices = [IoSliceMut::new(&mut self.contents)];
        let fd = port.socket.as_raw_fd();
        let control = Some(self.control.as_mut_slice());
        let message = recvmsg::<SockaddrStorage>(fd, &mut slices, control, MsgFlags::empty())?;
        let mut notes = Notes::default();
        message.cmsgs()?.for_each(|message| notes.take(message));
        let (bytes, from) = (message.bytes, message.address.and_then(address));
        if let Some(overflows) = notes.overflows {
            port.overflows.set(overflows);
        }
        let Some(from) = from else {
            return Ok(());
        };
        // a clock that was set meanwhile must not take it into the future, nor far into the past
        let age = notes.arrived.and_then(|at| since_epoch.checked_sub(at));
        let age = age.filter(|age| *age < Duration::from_secs(60));
        let arrived = moment.as_nanos() - nanos(age.unwrap_or_default()).min(moment.as_nanos());
        let contents = self.contents.get(..bytes).unwrap_or_default();
        let stride = notes.stride.unwrap_or(bytes).max(1);
        // an empty datagram is one datagram too
        let empty = contents.is_empty().then_some(contents);
        for contents in contents.chunks(stride).chain(empty) {
            take(Received {
                from,
                local_ip: notes.local_ip,
                class: notes.class,
                arrived: Time::from_nanos(arrived),
                contents,
            });
        }
        Ok(())
    }
}

fn nanos(duration: Duration) -> u64 {
    mmt_shared::time::duration_nanos(duration)
}

fn address(storage: SockaddrStorage) -> Option<SocketAddr> {
    let v4 = storage
        .as_sockaddr_in()
        .map(|v4| SocketAddr::V4((*v4).into()));
    v4.or_else(|| {
        storage
            .as_sockaddr_in6()
            .map(|v6| SocketAddr::V6((*v6).into()))
    })
}

#[cfg(test)]
mod tests;
