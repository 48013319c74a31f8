//! The system's allocator with counters, in the place of the system's: how often a thread asked for memory, and how much it had
//! at once.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

/// The system's allocator, with a count of every call that takes memory.
struct Counting;

thread_local! {
    /// Calls by this thread: the test harness's other threads allocate as they please.
    static CALLS: Cell<u64> = const { Cell::new(0) };
    /// Bytes that this thread took, less those that it gave back, and the most of that.
    static HELD: Cell<(i64, i64)> = const { Cell::new((0, 0)) };
}

/// A call that takes so many bytes more than it gives back.
fn count(more: usize, less: usize) {
    // a thread that is ending has no counter any more, and nobody who reads it
    let _ = CALLS.try_with(|calls| calls.set(calls.get() + 1));
    let _ = HELD.try_with(|held| {
        let (now, most) = held.get();
        let now = now + more as i64 - less as i64;
        held.set((now, most.max(now)));
    });
}

#[allow(
    unsafe_code,
    reason = "the trait is unsafe; every call goes on to the system's allocator as it came"
)]
// SAFETY: counting touches no memory but a constant-initialized cell of the thread, and allocates nothing.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size(), 0);
        // SAFETY: the caller's promise is passed on unchanged.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count(layout.size(), 0);
        // SAFETY: the caller's promise is passed on unchanged.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, old: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count(size, layout.size());
        // SAFETY: the caller's promise is passed on unchanged.
        unsafe { System.realloc(old, layout, size) }
    }

    unsafe fn dealloc(&self, old: *mut u8, layout: Layout) {
        // giving memory back takes a lock as well
        count(0, layout.size());
        // SAFETY: the caller's promise is passed on unchanged.
        unsafe { System.dealloc(old, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[allow(dead_code, reason = "one test counts calls, another one bytes")]
/// What `work` returns, and the calls of the allocator that it made.
pub(crate) fn counted<T>(work: impl FnOnce() -> T) -> (T, u64) {
    let before = CALLS.with(Cell::get);
    let result = work();
    (result, CALLS.with(Cell::get) - before)
}

#[allow(dead_code, reason = "one test counts calls, another one bytes")]
/// The most memory that `work` had at once, bytes.
pub(crate) fn peak_of(work: &mut dyn FnMut()) -> u64 {
    let (before, _) = HELD.get();
    HELD.set((before, before));
    work();
    let (_, most) = HELD.get();
    u64::try_from(most - before).unwrap_or(0)
}
