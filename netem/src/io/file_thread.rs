//! Writes what a driver has for a file on a thread of its own. A driver must never wait for a disk.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread::JoinHandle;

/// A file being written.
#[derive(Debug)]
pub(super) struct FileThread<T> {
    queue: Queue<T>,
    thread: Option<JoinHandle<io::Result<()>>>,
}

/// What puts items before the thread; copies put them before the same one.
#[derive(Debug)]
pub(super) struct Queue<T> {
    /// None: the end.
    sender: SyncSender<Option<T>>,
    missed: Arc<AtomicU64>,
}

impl<T> Clone for Queue<T> {
    fn clone(&self) -> Self {
        Self {
            sender: self.sender.clone(),
            missed: Arc::clone(&self.missed),
        }
    }
}

impl<T> Queue<T> {
    /// Hands over an item; never waits.
    pub(super) fn push(&self, item: T) {
        if self.sender.try_send(Some(item)).is_err() {
            self.missed.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Items that the file misses: the disk was too slow or full, or the file was finished before.
    pub(super) fn missed(&self) -> u64 {
        self.missed.load(Ordering::Relaxed)
    }
}

impl<T: Send + 'static> FileThread<T> {
    /// Starts a thread of this name that writes the items, of which `waiting_max` may wait.
    ///
    /// # Errors
    /// No thread is to be had.
    pub(super) fn start(
        name: &str,
        waiting_max: usize,
        write: impl FnOnce(&mut dyn Iterator<Item = T>) -> io::Result<()> + Send + 'static,
    ) -> io::Result<Self> {
        let (sender, receiver) = sync_channel(waiting_max);
        let thread = std::thread::Builder::new()
            .name(name.to_owned())
            .spawn(move || write(&mut receiver.iter().map_while(|item| item)))?;
        let missed = Arc::default();
        Ok(Self {
            queue: Queue { sender, missed },
            thread: Some(thread),
        })
    }
}

impl<T> FileThread<T> {
    /// For a driver.
    pub(super) fn queue(&self) -> Queue<T> {
        self.queue.clone()
    }

    /// Waits until all that was put in so far is written; what comes later is missed. Returns how many
    /// items the file misses.
    ///
    /// # Errors
    /// Those of the file.
    pub(super) fn finish(mut self) -> io::Result<u64> {
        self.end().map(|()| self.queue.missed())
    }

    fn end(&mut self) -> io::Result<()> {
        // It fails only when the thread has ended with an error, which joining it returns.
        let _ = self.queue.sender.send(None);
        match self.thread.take().map(JoinHandle::join) {
            None => Ok(()),
            Some(Ok(written)) => written,
            Some(Err(_)) => Err(io::Error::other("its thread panicked")),
        }
    }
}

impl<T> Drop for FileThread<T> {
    fn drop(&mut self) {
        // Whoever wants to know the error calls `finish`.
        let _ = self.end();
    }
}
