//! Where the two ends run, and that their cores stay awake.
//!
//! Left to the kernel, two threads that wake each other mostly share a core: there nobody has to be woken over the bus, but a
//! message waits until its sender sleeps, which no message between two hosts does. On two cores that sleep, their waking
//! hides what is measured.

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, mpsc};
use std::thread::{self, JoinHandle};

use mmt_shared::io::realtime::yield_to_all;
use rustix::thread::{CpuSet, sched_getaffinity, sched_setaffinity};

use super::config::{BenchError, Cores};
use crate::io::failure::Failure;

/// The cores of the two ends, kept awake until it is dropped.
#[derive(Debug)]
pub(super) struct Placement {
    /// Those of the near and of the far end; none if the kernel chooses.
    cores: Option<[CpuSet; 2]>,
    over: Arc<AtomicBool>,
    awake: Vec<JoinHandle<()>>,
}

impl Placement {
    /// The first two cores that the calling thread may use, or none of their own.
    ///
    /// # Errors
    /// There are two, and the system does not let them be kept awake.
    pub(super) fn try_new(cores: Cores) -> Result<Self, BenchError> {
        let mut placement = Self {
            cores: if cores == Cores::Own {
                first_two()
            } else {
                None
            },
            over: Arc::default(),
            awake: Vec::new(),
        };
        for core in placement.cores.into_iter().flatten() {
            let over = Arc::clone(&placement.over);
            let (report, reports) = mpsc::sync_channel(1);
            let awake = move || keep_awake(&core, &over, &report);
            placement.awake.push(thread::spawn(awake));
            let is_awake = reports.recv().map_err(Failure::from)?;
            is_awake.map_err(BenchError::Cores)?;
        }
        Ok(placement)
    }

    /// What they really are.
    pub(super) fn cores(&self) -> Cores {
        self.cores.map_or(Cores::Any, |_| Cores::Own)
    }

    /// Runs both ends at the same time, each on its core.
    pub(super) fn run<T: Send>(
        &self,
        near: impl FnOnce() -> Result<T, Failure> + Send,
        far: impl FnOnce() -> Result<T, Failure> + Send,
    ) -> Result<(T, T), BenchError> {
        let [near_core, far_core] = self.cores.map_or([None; 2], |cores| cores.map(Some));
        thread::scope(|scope| {
            let near = scope.spawn(move || placed(near_core, near));
            let far = scope.spawn(move || placed(far_core, far));
            let panicked = |_| Failure::from("a thread of the measurement panicked");
            let near = near.join().map_err(panicked)?;
            let far = far.join().map_err(panicked)?;
            Ok((near?, far?))
        })
    }
}

impl Drop for Placement {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
        for thread in self.awake.drain(..) {
            // it has nothing to panic about, and nothing depends on it
            let _ = thread.join();
        }
    }
}

fn first_two() -> Option<[CpuSet; 2]> {
    let allowed = sched_getaffinity(None).ok()?;
    let mut usable = (0..CpuSet::MAX_CPU).filter(|core| allowed.is_set(*core));
    let only = |core| {
        let mut set = CpuSet::new();
        set.set(core);
        set
    };
    Some([only(usable.next()?), only(usable.next()?)])
}

/// Runs an end on its core, if it has one.
fn placed<T>(
    core: Option<CpuSet>,
    end: impl FnOnce() -> Result<T, Failure>,
) -> Result<T, BenchError> {
    if let Some(core) = core {
        stay(&core).map_err(BenchError::Cores)?;
    }
    Ok(end()?)
}

/// Keeps the calling thread on `core`.
fn stay(core: &CpuSet) -> io::Result<()> {
    Ok(sched_setaffinity(None, core)?)
}

/// Spins on `core` while nobody else uses it, once it has reported that it can give way to all others.
fn keep_awake(core: &CpuSet, over: &AtomicBool, report: &mpsc::SyncSender<io::Result<()>>) {
    let able = stay(core).and_then(|()| yield_to_all());
    let spins = able.is_ok();
    if report.send(able).is_ok() && spins {
        while !over.load(Ordering::Relaxed) {
            std::hint::spin_loop();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The cores that the calling thread may use.
    fn mine() -> Result<Vec<usize>, Failure> {
        let allowed = sched_getaffinity(None).unwrap();
        Ok((0..CpuSet::MAX_CPU)
            .filter(|core| allowed.is_set(*core))
            .collect())
    }

    #[test]
    fn each_end_has_its_core_and_the_caller_keeps_its_own() {
        let before = mine().unwrap();
        let placement = Placement::try_new(Cores::Own).unwrap();
        let (near, far) = placement.run(mine, mine).unwrap();
        match before.as_slice() {
            [first, second, ..] => {
                assert_eq!(placement.cores(), Cores::Own);
                assert_eq!((near, far), (vec![*first], vec![*second]));
                let awake = placement
                    .awake
                    .iter()
                    .filter(|thread| !thread.is_finished());
                assert_eq!(awake.count(), 2, "they stay awake until the end");
            }
            _ => assert_eq!(placement.cores(), Cores::Any),
        }
        drop(placement);
        assert_eq!(mine().unwrap(), before);
    }

    #[test]
    fn left_to_the_kernel_they_may_run_anywhere() {
        let placement = Placement::try_new(Cores::Any).unwrap();
        let (near, far) = placement.run(mine, mine).unwrap();
        assert_eq!((&near, &far), (&mine().unwrap(), &mine().unwrap()));
        assert!(placement.awake.is_empty());
        assert_eq!(placement.cores(), Cores::Any);
    }

    #[test]
    fn a_core_that_cannot_be_had_is_reported_with_what_to_do() {
        let mut placement = Placement::try_new(Cores::Any).unwrap();
        placement.cores = Some([CpuSet::new(); 2]);
        let error = placement.run(mine, mine).unwrap_err().to_string();
        assert!(error.contains("--cores any"), "{error}");
    }
}
