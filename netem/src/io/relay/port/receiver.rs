//! Receives many datagrams with one call of the kernel.

use std::io::{self, IoSliceMut};
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};
use std::os::fd::AsRawFd;
use std::time::{Duration, SystemTime};

use mmt_shared::time::{Time, duration_nanos};
use nix::errno::Errno;
use nix::sys::socket::{
    ControlMessageOwned, MsgFlags, MultiHeaders, RecvMsg, SockaddrStorage, recvmmsg,
};

use super::Port;
use crate::io::now;

/// Messages taken at the first call, which mostly finds one, and at those after it.
const FIRST: usize = 4;
const BATCH: usize = 16;
/// Calls before the times are looked at again.
const BATCHES: usize = 8;
/// The largest UDP payload, and the most that the kernel joins into one message.
const MESSAGE_MAX: usize = 65_535;
/// Room for the five control messages that the kernel may add to a message, bytes.
const CONTROL_MAX: usize = 256;
/// What arrived longer ago than this has a wrong time stamp.
const AGE_MAX: Duration = Duration::from_secs(60);

/// One datagram received.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Received<'a> {
    pub(crate) from: SocketAddr,
    /// The address that it was sent to; an answer should come from there.
    pub(crate) local_ip: Option<IpAddr>,
    /// DSCP and ECN.
    pub(crate) class: u8,
    /// When the kernel took it in.
    pub(crate) arrived: Time,
    pub(crate) contents: &'a [u8],
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

/// The buffer to receive into.
#[derive(Debug)]
pub(crate) struct Receiver(Vec<u8>);

impl Receiver {
    pub(crate) fn new() -> Self {
        Self(vec![0; BATCH * MESSAGE_MAX])
    }

    /// Takes what is there out of `port`, or enough for once.
    ///
    /// # Errors
    /// Those of recvmmsg. That there is nothing to receive is no error.
    pub(crate) fn receive(
        &mut self,
        port: &Port,
        mut take: impl FnMut(Received<'_>),
    ) -> io::Result<()> {
        for call in 0..BATCHES {
            let messages = if call == 0 { FIRST } else { BATCH };
            if self.receive_batch(port, messages, &mut take)? < messages {
                break;
            }
        }
        Ok(())
    }

    /// Takes so many messages at most, and returns how many there were.
    fn receive_batch(
        &mut self,
        port: &Port,
        most: usize,
        take: &mut impl FnMut(Received<'_>),
    ) -> io::Result<usize> {
        // the kernel writes the lengths that it used into the headers, so that they serve once
        let room = Some(Vec::with_capacity(CONTROL_MAX));
        let mut headers = MultiHeaders::<SockaddrStorage>::preallocate(most, room);
        let slices = self.0.chunks_exact_mut(MESSAGE_MAX).take(most);
        let mut slices: Vec<_> = slices.map(|slice| [IoSliceMut::new(slice)]).collect();
        let (fd, flags) = (port.socket.as_raw_fd(), MsgFlags::MSG_DONTWAIT);
        let messages = match recvmmsg(fd, &mut headers, slices.iter_mut(), flags, None) {
            Err(Errno::EAGAIN | Errno::EINTR) => return Ok(0),
            messages => messages?,
        };
        let clocks = Clocks::read();
        let mut received = 0;
        for message in messages {
            received += 1;
            take_apart(port, &message, clocks, take)?;
        }
        Ok(received)
    }
}

/// One moment by the clock of time stamps and by that of all else.
#[derive(Clone, Copy)]
struct Clocks {
    since_epoch: Duration,
    moment: Time,
}

impl Clocks {
    fn read() -> Self {
        let since_epoch = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
        Self {
            since_epoch: since_epoch.unwrap_or_default(),
            moment: now(),
        }
    }

    fn at(self, stamp: Option<Duration>) -> Time {
        // a clock that was set meanwhile must not take it into the future, nor far into the past
        let age = stamp.and_then(|at| self.since_epoch.checked_sub(at));
        let age = age.filter(|age| *age < AGE_MAX).unwrap_or_default();
        let moment = self.moment.as_nanos();
        Time::from_nanos(moment.saturating_sub(duration_nanos(age)))
    }
}

/// Hands on the datagrams of a message: several where the kernel joined them.
fn take_apart(
    port: &Port,
    message: &RecvMsg<'_, '_, SockaddrStorage>,
    clocks: Clocks,
    take: &mut impl FnMut(Received<'_>),
) -> io::Result<()> {
    let mut notes = Notes::default();
    message.cmsgs()?.for_each(|message| notes.take(message));
    if let Some(overflows) = notes.overflows {
        port.overflows.set(overflows);
    }
    let Some(from) = message.address.and_then(address) else {
        return Ok(());
    };
    let contents = message.iovs().next().unwrap_or_default();
    let stride = notes.stride.unwrap_or(contents.len()).max(1);
    // an empty datagram is one datagram too
    let empty = contents.is_empty().then_some(contents);
    for contents in contents.chunks(stride).chain(empty) {
        take(Received {
            from,
            local_ip: notes.local_ip,
            class: notes.class,
            arrived: clocks.at(notes.arrived),
            contents,
        });
    }
    Ok(())
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
