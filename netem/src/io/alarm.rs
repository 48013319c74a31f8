//! The clock of the drivers, and waiting for a deadline or a call, whichever comes first. It must never
//! spin.

use std::io;
use std::os::fd::{AsFd, OwnedFd};
use std::sync::Arc;
use std::task::Wake;

use mmt_shared::io::clock::Clock;
use mmt_shared::time::Time;
use rustix::event::{EventfdFlags, PollFd, PollFlags, Timespec, eventfd, poll};

/// The time of `CLOCK_MONOTONIC`, which is the clock of every `Time` in the drivers.
#[must_use]
pub fn now() -> Time {
    const CLOCK: Clock = Clock::since_boot();
    CLOCK.now()
}

/// Waits until one of `fds` is ready or the deadline has passed. May return early.
///
/// # Errors
/// Those of ppoll, but an interruption counts as an early return.
pub(crate) fn wait(fds: &mut [PollFd<'_>], until: Option<Time>) -> io::Result<()> {
    let timeout = until
        .map(|deadline| deadline.saturating_since(now()))
        .and_then(|left| Timespec::try_from(left).ok());
    match poll(fds, timeout.as_ref()) {
        Ok(_) | Err(rustix::io::Errno::INTR) => Ok(()),
        Err(errno) => Err(errno.into()),
    }
}

/// A bell that wakes one waiting thread; rung before the wait, it ends the wait at once.
#[derive(Debug)]
pub(crate) struct Alarm(OwnedFd);

impl Alarm {
    pub(crate) fn try_new() -> io::Result<Self> {
        let flags = EventfdFlags::CLOEXEC | EventfdFlags::NONBLOCK;
        Ok(Self(eventfd(0, flags)?))
    }

    pub(crate) fn ring(&self) {
        // It fails only when the bell has been rung 2^64 - 2 times unheard: it rings already.
        let _ = rustix::io::write(&self.0, &1_u64.to_ne_bytes());
    }

    /// Stops the ringing; call it after a wait, before looking for the reason.
    pub(crate) fn silence(&self) {
        // It fails only when the bell does not ring.
        let _ = rustix::io::read(&self.0, &mut [0; 8]);
    }

    pub(crate) fn as_poll_fd(&self) -> PollFd<'_> {
        PollFd::from_borrowed_fd(self.0.as_fd(), PollFlags::IN)
    }

    /// Waits for a ring or the deadline. May return early.
    pub(crate) fn wait(&self, until: Option<Time>) -> io::Result<()> {
        wait(&mut [self.as_poll_fd()], until)?;
        self.silence();
        Ok(())
    }
}

impl Wake for Alarm {
    fn wake(self: Arc<Self>) {
        self.ring();
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn a_wait_ends_at_its_deadline_and_does_not_spin_until_then() {
        let alarm = Alarm::try_new().unwrap();
        let deadline = now() + Duration::from_millis(20);
        let mut waits = 0;
        while now() < deadline {
            alarm.wait(Some(deadline)).unwrap();
            waits += 1;
        }
        assert!((1..10).contains(&waits), "{waits} waits");
    }

    #[test]
    fn a_ring_before_the_wait_is_heard_once() {
        let alarm = Alarm::try_new().unwrap();
        alarm.ring();
        alarm.ring();
        // would wait for ever if the rings were lost
        alarm.wait(None).unwrap();
        let mut fds = [alarm.as_poll_fd()];
        wait(&mut fds, Some(Time::ZERO)).unwrap();
        assert!(fds[0].revents().is_empty(), "still ringing");
    }
}
