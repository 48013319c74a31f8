//! An eventfd that one thread or task waits for and any other rings, and waiting for it or a deadline.
//!
//! Ringing is one non-blocking write: it takes no lock, allocates nothing and never waits. Rings before a wait count as
//! one, and end it at once. Nothing here spins.

use std::io;
use std::os::fd::{AsFd, AsRawFd, BorrowedFd, OwnedFd, RawFd};
use std::sync::Arc;
use std::task::Wake;

use rustix::event::{EventfdFlags, PollFd, PollFlags, Timespec, eventfd, poll};

use super::clock::Clock;
use crate::time::Time;

/// Waits until one of `fds` is ready or the deadline, by [`Clock::since_boot`], has passed. May return early.
///
/// # Errors
/// Those of ppoll, but an interruption counts as an early return.
pub fn wait(fds: &mut [PollFd<'_>], until: Option<Time>) -> io::Result<()> {
    let now = Clock::since_boot().now();
    let timeout = until
        .map(|deadline| deadline.saturating_since(now))
        .and_then(|left| Timespec::try_from(left).ok());
    match poll(fds, timeout.as_ref()) {
        Ok(_) | Err(rustix::io::Errno::INTR) => Ok(()),
        Err(errno) => Err(errno.into()),
    }
}

/// The eventfd.
#[derive(Debug)]
pub struct Alarm(OwnedFd);

impl Alarm {
    /// A silent alarm.
    ///
    /// # Errors
    /// The process is out of descriptors.
    pub fn try_new() -> io::Result<Self> {
        let flags = EventfdFlags::CLOEXEC | EventfdFlags::NONBLOCK;
        Ok(Self(eventfd(0, flags)?))
    }

    /// Ends the wait that is under way, or the next one.
    pub fn ring(&self) {
        // EAGAIN means that 2^64 - 2 rings are pending: it rings already. No other error can happen to an eventfd
        // that is open.
        let _ = rustix::io::write(&self.0, &1_u64.to_ne_bytes());
    }

    /// Stops the ringing, and returns whether it rang. Call it after a wait, before looking for the reason.
    pub fn silence(&self) -> bool {
        rustix::io::read(&self.0, &mut [0; 8]).is_ok()
    }

    /// For a wait that is for other descriptors as well.
    pub fn as_poll_fd(&self) -> PollFd<'_> {
        PollFd::from_borrowed_fd(self.0.as_fd(), PollFlags::IN)
    }

    /// Waits for a ring or the deadline. May return early.
    ///
    /// # Errors
    /// As [`wait`].
    pub fn wait(&self, until: Option<Time>) -> io::Result<()> {
        wait(&mut [self.as_poll_fd()], until)?;
        self.silence();
        Ok(())
    }
}

impl AsFd for Alarm {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.0.as_fd()
    }
}

impl AsRawFd for Alarm {
    fn as_raw_fd(&self) -> RawFd {
        self.0.as_raw_fd()
    }
}

impl Wake for Alarm {
    fn wake(self: Arc<Self>) {
        self.ring();
    }
}

#[cfg(test)]
impl Alarm {
    /// Rings as often as it can.
    pub(super) fn fill(&self) {
        rustix::io::write(&self.0, &(u64::MAX - 1).to_ne_bytes()).unwrap();
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn a_wait_ends_at_its_deadline_and_does_not_spin_until_then() {
        let (alarm, clock) = (Alarm::try_new().unwrap(), Clock::since_boot());
        let deadline = clock.now() + Duration::from_millis(20);
        let mut waits = 0;
        while clock.now() < deadline {
            alarm.wait(Some(deadline)).unwrap();
            waits += 1;
        }
        assert!((1..10).contains(&waits), "{waits} waits");
    }

    #[test]
    fn rings_before_the_wait_end_it_once() {
        let alarm = Alarm::try_new().unwrap();
        alarm.ring();
        alarm.ring();
        // would wait for ever if the rings were lost
        alarm.wait(None).unwrap();
        let mut fds = [alarm.as_poll_fd()];
        wait(&mut fds, Some(Time::ZERO)).unwrap();
        assert!(fds[0].revents().is_empty(), "still ringing");
        assert!(!alarm.silence());
    }
}
