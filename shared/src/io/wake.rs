//! A wake from the loop thread to tokio: an eventfd.
//!
//! The loop's side is one non-blocking write: it takes no lock, allocates nothing and never waits, which
//! tokio's own notifiers do not promise. Wakes between two waits count as one: look at what there is.

use std::io;
use std::os::fd::OwnedFd;
use std::sync::Arc;

use rustix::event::{EventfdFlags, eventfd};
use rustix::io::Errno;
use tokio::io::unix::AsyncFd;

/// The loop's side. Clones wake the same waiter.
#[derive(Clone, Debug)]
pub struct Waker(Arc<OwnedFd>);

/// Tokio's side.
#[derive(Debug)]
pub struct Wakeup(AsyncFd<Arc<OwnedFd>>);

/// A connected pair. Call it inside of a tokio runtime with I/O; the waiter belongs to that runtime.
///
/// # Errors
/// The process is out of descriptors.
pub fn pair() -> io::Result<(Waker, Wakeup)> {
    let fd = Arc::new(eventfd(0, EventfdFlags::NONBLOCK | EventfdFlags::CLOEXEC)?);
    #[allow(
        deprecated,
        reason = "unsound for a type whose descriptor can change or close early; an `Arc<OwnedFd>` keeps \
                  one descriptor open for as long as it is registered"
    )]
    let waiter = AsyncFd::new(Arc::clone(&fd))?;
    Ok((Waker(fd), Wakeup(waiter)))
}

impl Waker {
    /// Wakes the waiter, or the next one to wait. One system call.
    pub fn wake(&self) {
        // EAGAIN means that 2^64 - 2 wakes are pending: the waiter is awake. No other error can happen to
        // an eventfd that is open.
        let _ = rustix::io::write(&*self.0, &1u64.to_ne_bytes());
    }
}

impl Wakeup {
    /// Waits for a wake since the last return; returns at once if there was one. Cancel-safe: a wake is not
    /// lost when the future is dropped.
    ///
    /// # Errors
    /// The runtime is shutting down.
    pub async fn wait(&mut self) -> io::Result<()> {
        loop {
            let mut ready = self.0.readable().await?;
            let mut count = [0; 8];
            match rustix::io::read(self.0.get_ref(), &mut count) {
                Ok(_) => return Ok(()),
                Err(Errno::AGAIN) => ready.clear_ready(),
                Err(Errno::INTR) => {}
                Err(error) => return Err(error.into()),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use tokio::time::timeout;

    const SOON: Duration = Duration::from_millis(20);
    const LATE: Duration = Duration::from_secs(20);

    #[tokio::test]
    async fn a_wake_from_another_thread_ends_the_wait() {
        let (waker, mut wakeup) = pair().unwrap();
        let thread = std::thread::spawn(move || waker.wake());
        timeout(LATE, wakeup.wait()).await.unwrap().unwrap();
        thread.join().unwrap();
    }

    #[tokio::test]
    async fn wakes_before_the_wait_count_as_one() {
        let (waker, mut wakeup) = pair().unwrap();
        for _ in 0..1000 {
            waker.wake();
        }
        timeout(LATE, wakeup.wait()).await.unwrap().unwrap();
        assert!(timeout(SOON, wakeup.wait()).await.is_err());
        waker.wake();
        timeout(LATE, wakeup.wait()).await.unwrap().unwrap();
    }

    #[tokio::test]
    async fn a_dropped_wait_loses_no_wake() {
        let (waker, mut wakeup) = pair().unwrap();
        assert!(timeout(SOON, wakeup.wait()).await.is_err());
        waker.wake();
        timeout(LATE, wakeup.wait()).await.unwrap().unwrap();
    }

    #[tokio::test]
    async fn a_full_counter_does_not_block_the_loop() {
        let (waker, mut wakeup) = pair().unwrap();
        rustix::io::write(&*waker.0, &(u64::MAX - 1).to_ne_bytes()).unwrap();
        waker.wake();
        timeout(LATE, wakeup.wait()).await.unwrap().unwrap();
    }
}
