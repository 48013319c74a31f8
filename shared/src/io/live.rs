//! A snapshot of something that runs, for a screen: the newest value wins, older ones are gone.
//!
//! For tokio's side and screens only: it locks. A loop thread hands its snapshots over through a triple buffer,
//! which a task empties into this cell.

use tokio::sync::watch;

/// The newest snapshot.
#[derive(Debug)]
pub struct LiveCell<T>(watch::Sender<T>);

impl<T: Clone + Default> Default for LiveCell<T> {
    fn default() -> Self {
        Self::new(T::default())
    }
}

impl<T: Clone> LiveCell<T> {
    /// A cell that shows `first` until something is set.
    pub fn new(first: T) -> Self {
        Self(watch::Sender::new(first))
    }

    /// Shows `snapshot` from now on.
    pub fn set(&self, snapshot: T) {
        self.0.send_replace(snapshot);
    }

    /// The newest snapshot. From any thread; waits only while another one copies it in or out.
    pub fn get(&self) -> T {
        self.0.borrow().clone()
    }

    /// A receiver, to wait for changes.
    pub fn subscribe(&self) -> watch::Receiver<T> {
        self.0.subscribe()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn the_newest_snapshot_wins_and_wakes_who_waits() {
        let cell = LiveCell::<u32>::default();
        assert_eq!(cell.get(), 0);
        let mut receiver = cell.subscribe();
        cell.set(1);
        cell.set(2);
        assert_eq!(cell.get(), 2);
        receiver.changed().await.unwrap();
        assert_eq!(*receiver.borrow_and_update(), 2);
        assert!(!receiver.has_changed().unwrap());
    }
}
