//! Pieces of work on threads, results in order.
//!
//! Every piece is a pure function, so that the order in which threads take them changes nothing.

use std::num::NonZero;

use rayon::ThreadPoolBuilder;
use rayon::prelude::*;

/// Does `work` for every item on so many threads, all cores if none, and returns the results in the order of the
/// items. After an error no new item begins.
///
/// # Errors
/// The error of an item.
pub(super) fn on_threads<T: Sync, R: Send, E: Send>(
    threads: Option<NonZero<usize>>,
    items: &[T],
    work: impl Fn(&T) -> Result<R, E> + Sync + Send,
) -> Result<Vec<R>, E> {
    let pool = ThreadPoolBuilder::new().num_threads(threads.map_or(0, NonZero::get));
    match pool.build() {
        Ok(pool) => pool.install(|| items.par_iter().with_max_len(1).map(work).collect()),
        // a system that has no threads left
        Err(_) => items.iter().map(work).collect(),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::thread;
    use std::time::Duration;

    use super::*;

    #[test]
    fn results_come_in_the_order_of_the_items_whatever_the_threads() {
        let items: Vec<u64> = (0..100).collect();
        for threads in 1..4 {
            let squares = on_threads(NonZero::new(threads), &items, |item| {
                thread::sleep(Duration::from_micros(50 * (100 - item) % 300));
                Ok::<_, ()>(item * item)
            });
            assert_eq!(squares, Ok(items.iter().map(|item| item * item).collect()));
        }
    }

    #[test]
    fn an_error_ends_the_work() {
        let begun = AtomicUsize::new(0);
        let items: Vec<usize> = (0..1000).collect();
        let result = on_threads(NonZero::new(2), &items, |item| {
            begun.fetch_add(1, Ordering::Relaxed);
            thread::sleep(Duration::from_micros(100));
            if *item == 10 { Err(*item) } else { Ok(()) }
        });
        assert_eq!(result, Err(10));
        assert!(begun.into_inner() < 1000);
    }
}
