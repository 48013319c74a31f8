//! How the host schedules a thread: real time and locked memory for a loop, where it permits them, or behind all others.
//!
//! The small OS file: the only one with `unsafe`, because no safe wrapper of `sched_setscheduler` exists.
//! What a loop asks for never fails the program: what was not obtained is reported with the reason and the remedy. A
//! thread under `SCHED_FIFO` must never spin: it would starve the host and be throttled.

use std::fmt;
use std::io;
use std::num::NonZeroU64;

use rustix::mm::{MlockAllFlags, mlockall};
use rustix::process::{Resource, getrlimit};
use rustix::thread::{CapabilitySet, capabilities, set_current_timer_slack};

/// `SCHED_FIFO` priority of the loops, of 1 to 99: above every ordinary thread, below the kernel's own
/// interrupt threads (50).
pub const PRIORITY: u8 = 40;

/// What one request to the host came to.
#[derive(Debug)]
pub enum Obtained {
    /// Granted.
    Yes,
    /// Not granted, with the remedy.
    No {
        /// Why.
        reason: io::Error,
        /// What to do, one sentence.
        remedy: &'static str,
    },
}

/// What the calling thread obtained.
#[derive(Debug)]
pub struct RealTime {
    /// `SCHED_FIFO` at [`PRIORITY`], for this thread; threads that it starts do not inherit it.
    pub fifo: Obtained,
    /// All memory of the process locked, so that no tick waits for a page.
    pub memory: Obtained,
    /// Timer slack 1 ns instead of 50 µs, for this thread.
    pub slack: Obtained,
}

/// Asks for everything that makes the calling thread's deadlines sharper. Call it on the loop's own thread,
/// once, before the first deadline.
pub fn request() -> RealTime {
    RealTime {
        fifo: Obtained::from(
            set_fifo(),
            "raise the limit (`ulimit -r 40`, or `rtprio` in /etc/security/limits.conf) or grant \
             CAP_SYS_NICE (`setcap cap_sys_nice,cap_ipc_lock+ep PROGRAM`)",
        ),
        memory: Obtained::from(
            lock_memory(),
            "raise the limit (`ulimit -l unlimited`, or `memlock` in /etc/security/limits.conf) or \
             grant CAP_IPC_LOCK (`setcap cap_sys_nice,cap_ipc_lock+ep PROGRAM`)",
        ),
        slack: Obtained::from(
            set_current_timer_slack(Some(NonZeroU64::MIN)).map_err(io::Error::from),
            "run outside of a sandbox that forbids prctl(PR_SET_TIMERSLACK)",
        ),
    }
}

impl Obtained {
    fn from(result: io::Result<()>, remedy: &'static str) -> Self {
        match result {
            Ok(()) => Self::Yes,
            Err(reason) => Self::No { reason, remedy },
        }
    }

    /// Whether it was granted.
    pub fn granted(&self) -> bool {
        matches!(self, Self::Yes)
    }
}

impl fmt::Display for RealTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let parts = [
            ("SCHED_FIFO", &self.fifo),
            ("locked memory", &self.memory),
            ("timer slack 1 ns", &self.slack),
        ];
        for (index, (name, obtained)) in parts.into_iter().enumerate() {
            let separator = if index == 0 { "" } else { "; " };
            match obtained {
                Obtained::Yes => write!(f, "{separator}{name}: yes")?,
                Obtained::No { reason, remedy } => {
                    write!(f, "{separator}{name}: no ({reason}): {remedy}")?;
                }
            }
        }
        Ok(())
    }
}

/// Lets the calling thread run only where nobody else is ready to (`SCHED_IDLE`); every host permits it.
///
/// # Errors
/// A sandbox forbids the call.
pub fn yield_to_all() -> io::Result<()> {
    set_policy(libc::SCHED_IDLE, 0)
}

fn set_fifo() -> io::Result<()> {
    set_policy(libc::SCHED_FIFO | libc::SCHED_RESET_ON_FORK, PRIORITY)
}

fn set_policy(policy: libc::c_int, priority: u8) -> io::Result<()> {
    // all that the kernel's sched_param holds
    let priority = libc::c_int::from(priority);
    #[allow(unsafe_code, reason = "no safe wrapper of this call exists")]
    // SAFETY: process 0 is the calling thread, and the kernel only reads `priority`, which outlives the call. The system call
    // itself, since the function of this name in musl only fails.
    let status =
        unsafe { libc::syscall(libc::SYS_sched_setscheduler, 0, policy, &raw const priority) };
    if status == 0 {
        Ok(())
    } else {
        Err(io::Error::last_os_error())
    }
}

/// Locks memory only where no limit applies: under a limit, `MCL_FUTURE` makes later allocations fail, and
/// a failed allocation ends the program.
fn lock_memory() -> io::Result<()> {
    let privileged =
        capabilities(None).is_ok_and(|sets| sets.effective.contains(CapabilitySet::IPC_LOCK));
    if let Some(limit) = getrlimit(Resource::Memlock).current.filter(|_| !privileged) {
        return Err(io::Error::new(
            io::ErrorKind::PermissionDenied,
            format!("the limit on locked memory is {} kB", limit / 1024),
        ));
    }
    mlockall(MlockAllFlags::CURRENT | MlockAllFlags::FUTURE).map_err(io::Error::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_never_fails_the_program_and_reports_what_it_obtained() {
        // on a thread of its own, which takes the priority with it
        let text = std::thread::spawn(|| request().to_string()).join().unwrap();
        for name in ["SCHED_FIFO", "locked memory", "timer slack"] {
            assert!(text.contains(name), "{text}");
        }
    }

    #[test]
    fn a_thread_can_give_way_to_all_others_and_no_other_thread_does() {
        #[allow(unsafe_code, reason = "no safe wrapper of this call exists")]
        // SAFETY: process 0 is the calling thread; nothing is written.
        let policy = || unsafe { libc::sched_getscheduler(0) };
        let before = policy();
        let during = std::thread::spawn(move || yield_to_all().map(|()| policy()));
        assert_eq!(during.join().unwrap().unwrap(), libc::SCHED_IDLE);
        assert_eq!(policy(), before);
    }

    #[test]
    fn what_was_not_granted_comes_with_reason_and_remedy() {
        let refused =
            |remedy| Obtained::from(Err(io::Error::from_raw_os_error(libc::EPERM)), remedy);
        let report = RealTime {
            fifo: refused("raise the limit"),
            memory: Obtained::Yes,
            slack: refused("leave the sandbox"),
        };
        assert!(!report.fifo.granted() && report.memory.granted());
        let text = report.to_string();
        assert!(text.contains("Operation not permitted"), "{text}");
        assert!(text.contains("raise the limit") && text.contains("leave the sandbox"));
        assert!(text.contains("locked memory: yes"));
    }
}
