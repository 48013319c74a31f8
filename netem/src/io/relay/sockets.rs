//! The sockets of a relay and its alarm, waited for at once whatever their number.

use std::io;
use std::mem::MaybeUninit;
use std::os::fd::{AsFd, OwnedFd};
use std::time::Duration;

use mmt_shared::io::alarm;
use mmt_shared::time::Time;
use rustix::event::{PollFd, PollFlags, Timespec, epoll};
use rustix::io::Errno;

use crate::io::now;

/// Sockets that one wait returns at most; the next one returns others.
const READY_MAX: usize = 64;
/// Names of what is no client's socket.
pub(super) const ALARM: u64 = u64::MAX;
pub(super) const LISTEN: u64 = u64::MAX - 1;

/// Which of them have something to read, or an error.
#[derive(Debug, Default)]
pub(super) struct Ready {
    pub(super) alarm: bool,
    pub(super) listen: bool,
    /// Numbers of clients.
    pub(super) clients: Vec<u64>,
}

/// Those that are waited for, each under a number. One that is closed leaves by itself.
#[derive(Debug)]
pub(super) struct Sockets(OwnedFd);

impl Sockets {
    /// None yet.
    ///
    /// # Errors
    /// The process is out of descriptors.
    pub(super) fn try_new() -> io::Result<Self> {
        Ok(Self(epoll::create(epoll::CreateFlags::CLOEXEC)?))
    }

    /// Waits for this one too from now on.
    ///
    /// # Errors
    /// Those of epoll.
    pub(super) fn add(&self, socket: impl AsFd, number: u64) -> io::Result<()> {
        let data = epoll::EventData::new_u64(number);
        Ok(epoll::add(&self.0, socket, data, epoll::EventFlags::IN)?)
    }

    /// Waits until one is ready or a deadline has passed, and notes which in `ready`. `due` is kept as precisely as the host can
    /// and `about` to a millisecond. May return early.
    ///
    /// # Errors
    /// Those of poll and epoll, but an interruption counts as an early return.
    pub(super) fn wait(
        &self,
        due: Option<Time>,
        about: Option<Time>,
        ready: &mut Ready,
    ) -> io::Result<()> {
        let mut left = about.map(|about| about.saturating_since(now()));
        if due.is_some() {
            // epoll alone counts in milliseconds before Linux 5.11
            let mut all = [PollFd::from_borrowed_fd(self.0.as_fd(), PollFlags::IN)];
            alarm::wait(&mut all, due.into_iter().chain(about).min())?;
            left = Some(Duration::ZERO);
        }
        let left = left.and_then(|left| Timespec::try_from(left).ok());
        let mut room = [MaybeUninit::uninit(); READY_MAX];
        let events: &[epoll::Event] = match epoll::wait(&self.0, &mut room, left.as_ref()) {
            Ok((events, _)) => events,
            Err(Errno::INTR) => &[],
            Err(errno) => return Err(errno.into()),
        };
        (ready.alarm, ready.listen) = (false, false);
        ready.clients.clear();
        for event in events {
            match event.data.u64() {
                ALARM => ready.alarm = true,
                LISTEN => ready.listen = true,
                number => ready.clients.push(number),
            }
        }
        Ok(())
    }
}
