//! Trials on threads, results in order.
//!
//! Every trial is a pure function, so that the order in which threads take them changes nothing.

use std::num::NonZero;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;

/// Runs pieces of work on a fixed number of threads.
#[derive(Clone, Copy, Debug)]
pub struct Pool {
    threads: NonZero<usize>,
}

impl Pool {
    /// A pool of so many threads; none means as many as the machine has cores.
    #[must_use]
    pub fn new(threads: Option<NonZero<usize>>) -> Self {
        let one = NonZero::<usize>::MIN;
        let threads = threads.unwrap_or_else(|| thread::available_parallelism().unwrap_or(one));
        Self { threads }
    }

    /// Does `work` for every item and returns the results in the order of the items. After an error no new item is
    /// begun; `done` is told the number of finished items, from any thread.
    ///
    /// # Errors
    /// The error of the first item, in the order of the items, that failed.
    pub fn run<T: Sync, R: Send, E: Send>(
        &self,
        items: &[T],
        work: impl Fn(usize, &T) -> Result<R, E> + Sync,
        done: impl Fn(usize) + Sync,
    ) -> Result<Vec<R>, E> {
        let (next, finished, failed) = (
            AtomicUsize::new(0),
            AtomicUsize::new(0),
            AtomicBool::new(false),
        );
        let results: Vec<Mutex<Option<Result<R, E>>>> =
            items.iter().map(|_| Mutex::new(None)).collect();
        let worker = || {
            while !failed.load(Ordering::Relaxed) {
                let index = next.fetch_add(1, Ordering::Relaxed);
                let (Some(item), Some(slot)) = (items.get(index), results.get(index)) else {
                    return;
                };
                let result = work(index, item);
                failed.fetch_or(result.is_err(), Ordering::Relaxed);
                if let Ok(mut slot) = slot.lock() {
                    *slot = Some(result);
                }
                done(finished.fetch_add(1, Ordering::Relaxed) + 1);
            }
        };
        thread::scope(|scope| {
            for _ in 0..self.threads.get().min(items.len()) {
                scope.spawn(worker);
            }
        });
        // items that were never begun come after the one that failed
        results
            .into_iter()
            .filter_map(|slot| slot.into_inner().unwrap_or_default())
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_come_in_the_order_of_the_items_whatever_the_threads() {
        let items: Vec<u64> = (0..100).collect();
        for threads in 1..4 {
            let pool = Pool::new(NonZero::new(threads));
            let seen = AtomicUsize::new(0);
            let squares = pool.run(
                &items,
                |index, item| {
                    thread::sleep(std::time::Duration::from_micros(
                        50 * (items.len() - index) as u64 % 300,
                    ));
                    Ok::<_, ()>(item * item)
                },
                |_| {
                    seen.fetch_add(1, Ordering::Relaxed);
                },
            );
            assert_eq!(squares, Ok(items.iter().map(|item| item * item).collect()));
            assert_eq!(seen.into_inner(), 100);
        }
    }

    #[test]
    fn the_first_error_ends_the_work() {
        let pool = Pool::new(NonZero::new(2));
        let begun = AtomicUsize::new(0);
        let items: Vec<usize> = (0..1000).collect();
        let result = pool.run(
            &items,
            |_, item| {
                begun.fetch_add(1, Ordering::Relaxed);
                if *item == 10 { Err(*item) } else { Ok(()) }
            },
            |_| {},
        );
        assert_eq!(result, Err(10));
        assert!(begun.into_inner() < 1000);
    }
}
