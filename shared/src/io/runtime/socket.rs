//! A UDP socket of the runtime: tries first, and is waited for only when the kernel has nothing or no room.

use std::io::{self, IoSliceMut};
use std::net::{SocketAddr, UdpSocket};
use std::os::fd::{AsFd, BorrowedFd};
use std::pin::Pin;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::task::{Context, Poll, Waker};

use quinn::udp::{RecvMeta, Transmit, UdpSocketState};
use quinn::{AsyncUdpSocket, UdpPoller};
use rustix::event::PollFlags;

use super::lock;

/// A socket with who waits for it.
#[derive(Debug)]
pub(super) struct Port {
    socket: UdpSocket,
    udp: UdpSocketState,
    reader: Mutex<Option<Waker>>,
    /// Whether the kernel had no room when it was last asked.
    pub(super) full: AtomicBool,
    writers: Mutex<Vec<Waker>>,
}

impl Port {
    /// Takes `socket`, which becomes non-blocking.
    pub(super) fn try_new(socket: UdpSocket) -> io::Result<Self> {
        Ok(Self {
            // makes it non-blocking as well
            udp: UdpSocketState::new((&socket).into())?,
            socket,
            reader: Mutex::default(),
            full: AtomicBool::new(false),
            writers: Mutex::default(),
        })
    }

    pub(super) fn as_fd(&self) -> BorrowedFd<'_> {
        self.socket.as_fd()
    }

    /// What somebody waits for.
    pub(super) fn interest(&self) -> PollFlags {
        let mut interest = PollFlags::empty();
        interest.set(PollFlags::IN, lock(&self.reader).is_some());
        interest.set(PollFlags::OUT, !lock(&self.writers).is_empty());
        interest
    }

    /// Wakes whoever waited for `events`.
    pub(super) fn fire(&self, events: PollFlags) {
        if events.is_empty() {
            return;
        }
        // an error is news to both: they try again and see it
        let reader = match events.difference(PollFlags::OUT).is_empty() {
            true => None,
            false => lock(&self.reader).take(),
        };
        let writers = match events.difference(PollFlags::IN).is_empty() {
            true => Vec::new(),
            false => {
                self.full.store(false, Ordering::Relaxed);
                std::mem::take(&mut *lock(&self.writers))
            }
        };
        writers.into_iter().chain(reader).for_each(Waker::wake);
    }
}

impl AsyncUdpSocket for Port {
    fn create_io_poller(self: Arc<Self>) -> Pin<Box<dyn UdpPoller>> {
        Box::pin(Room(self))
    }

    fn try_send(&self, transmit: &Transmit<'_>) -> io::Result<()> {
        let sent = self.udp.send((&self.socket).into(), transmit);
        if matches!(&sent, Err(error) if error.kind() == io::ErrorKind::WouldBlock) {
            self.full.store(true, Ordering::Relaxed);
        }
        sent
    }

    fn poll_recv(
        &self,
        context: &mut Context<'_>,
        buffers: &mut [IoSliceMut<'_>],
        meta: &mut [RecvMeta],
    ) -> Poll<io::Result<usize>> {
        match self.udp.recv((&self.socket).into(), buffers, meta) {
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                *lock(&self.reader) = Some(context.waker().clone());
                Poll::Pending
            }
            received => Poll::Ready(received),
        }
    }

    fn local_addr(&self) -> io::Result<SocketAddr> {
        self.socket.local_addr()
    }

    fn max_transmit_segments(&self) -> usize {
        self.udp.max_gso_segments()
    }

    fn max_receive_segments(&self) -> usize {
        self.udp.gro_segments()
    }

    fn may_fragment(&self) -> bool {
        self.udp.may_fragment()
    }
}

/// Waits for room in the kernel's send buffer.
#[derive(Debug)]
struct Room(Arc<Port>);

impl UdpPoller for Room {
    fn poll_writable(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        if !self.0.full.load(Ordering::Relaxed) {
            return Poll::Ready(Ok(()));
        }
        let mut writers = lock(&self.0.writers);
        if !writers.iter().any(|other| other.will_wake(context.waker())) {
            writers.push(context.waker().clone());
        }
        Poll::Pending
    }
}
