//! A wake from the loop thread to tokio: an [`Alarm`].
//!
//! The loop's side takes no lock, allocates nothing and never waits, which tokio's own notifiers do not promise.
//! Wakes between two waits count as one.

use std::io;
use std::sync::Arc;

use tokio::io::unix::AsyncFd;

use super::alarm::Alarm;

/// The loop's side. Clones wake the same waiter.
#[derive(Clone, Debug)]
pub struct Waker(Arc<Alarm>);

/// Tokio's side.
#[derive(Debug)]
pub struct Wakeup(AsyncFd<Arc<Alarm>>);

/// A connected pair. Call it inside of a tokio runtime with I/O; the waiter belongs to that runtime.
///
/// # Errors
/// The process is out of descriptors.
pub fn pair() -> io::Result<(Waker, Wakeup)> {
    let alarm = Arc::new(Alarm::try_new()?);
    #[allow(
        deprecated,
        reason = "unsound for a type whose descriptor can change or close early; an `Arc<Alarm>` keeps \
                  one descriptor open for as long as it is registered"
    )]
    let waiter = AsyncFd::new(Arc::clone(&alarm))?;
    Ok((Waker(alarm), Wakeup(waiter)))
}

impl Waker {
    /// Wakes the waiter, or the next one to wait. One system call.
    pub fn wake(&self) {
        self.0.ring();
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
            if self.0.get_ref().silence() {
                return Ok(());
            }
            ready.clear_ready();
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
        waker.0.fill();
        waker.wake();
        timeout(LATE, wakeup.wait()).await.unwrap().unwrap();
    }
}
