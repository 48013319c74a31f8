//! The watchdog's own thread, and what the kernel reports of another one.

use std::io;
use std::time::Duration;

use rustix::thread::Pid;

use super::{Doing, LOOK, Pulse, Watchdog};
use crate::io::clock::Clock;
use crate::io::realtime;

/// Watches a loop from a thread of its own until `is_over`, and calls `hung` once if a tick hangs. The loop's thread is `loop_id`.
///
/// # Errors
/// The system gives no thread.
pub fn watch(
    pulse: Pulse,
    loop_id: Pid,
    is_over: impl Fn() -> bool + Send + 'static,
    hung: impl FnOnce() + Send + 'static,
) -> io::Result<()> {
    let run = move || {
        // as sharp as the loop, where the host permits that; the loop has reported what was not granted
        realtime::request();
        let clock = Clock::since_boot();
        let mut watchdog = Watchdog::new(clock.now());
        loop {
            clock.sleep_until(clock.now() + LOOK);
            if is_over() {
                return;
            }
            if watchdog.look(clock.now(), pulse.tick(), || doing(loop_id)) {
                return hung();
            }
        }
    };
    let builder = std::thread::Builder::new().name("mmt-watchdog".to_owned());
    builder.spawn(run).map(|_| ())
}

/// What a thread of this process does, by proc(5).
fn doing(thread: Pid) -> Doing {
    let read = |name: &str| {
        let path = format!("/proc/self/task/{}/{name}", thread.as_raw_nonzero());
        std::fs::read_to_string(path).unwrap_or_default()
    };
    doing_by(&read("stat"), || read("schedstat"))
}

/// The same by the texts of `stat` and `schedstat`.
fn doing_by(stat: &str, schedstat: impl FnOnce() -> String) -> Doing {
    // the name stands in brackets and may hold any
    let state = stat
        .rsplit_once(") ")
        .and_then(|(_, rest)| rest.chars().next());
    match state {
        Some('S') => Doing::Blocked,
        Some('R') => {
            let used = schedstat()
                .split(' ')
                .next()
                .and_then(|nanos| nanos.parse().ok());
            used.map_or(Doing::Kept, |nanos| {
                Doing::Runnable(Duration::from_nanos(nanos))
            })
        }
        _ => Doing::Kept,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_state_of_a_thread_is_read_whatever_its_name() {
        let of = |stat: &str| doing_by(stat, || "2500000 10664554 1".to_owned());
        assert_eq!(of("3706 (mmt-slave) S 3704 3704"), Doing::Blocked);
        let used = Duration::from_micros(2500);
        assert_eq!(of("3706 (a) S 1) R 3704 3704"), Doing::Runnable(used));
        assert_eq!(of("3706 (mmt-slave) D 3704"), Doing::Kept);
        assert_eq!(of("3706 (mmt-slave) T 3704"), Doing::Kept);
        assert_eq!(of(""), Doing::Kept);
        assert_eq!(doing_by("1 (a) R 1", String::new), Doing::Kept);
    }

    #[test]
    fn what_this_thread_does_is_found_and_its_time_grows() {
        let own = rustix::thread::gettid();
        let Doing::Runnable(before) = doing(own) else {
            panic!("a thread that runs is not seen to");
        };
        loop {
            match doing(own) {
                Doing::Runnable(used) if used > before => break,
                _ => {}
            }
        }
    }
}
