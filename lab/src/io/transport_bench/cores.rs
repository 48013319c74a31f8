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

use super::BenchError;
use super::slice::{Side, Turn};

/// Where the two ends run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Cores {
    /// Each end on a core of its own that never sleeps, as on two hosts that are set up for low latency; on a machine
    /// with one core as [`Cores::Any`].
    #[default]
    Own,
    /// Where the kernel puts them, which for two threads that wake each other is mostly one core.
    Any,
}

impl Cores {
    /// As the command spells it.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Own => "own",
            Self::Any => "any",
        }
    }

    /// In words, after "over loopback,".
    pub(super) fn words(self) -> &'static str {
        match self {
            Self::Own => "each end on a core of its own that stays awake",
            Self::Any => "each end where the kernel puts it",
        }
    }
}

/// The cores of the two ends, kept awake until it is dropped.
#[derive(Debug)]
pub(super) struct Places {
    near: Option<CpuSet>,
    far: Option<CpuSet>,
    over: Arc<AtomicBool>,
    awake: Vec<JoinHandle<()>>,
}

impl Places {
    /// The first two cores that the calling thread may use, or none of their own.
    ///
    /// # Errors
    /// There are two, and the system does not let them be kept awake.
    pub(super) fn try_new(cores: Cores) -> Result<Self, BenchError> {
        let mut places = Self {
            near: None,
            far: None,
            over: Arc::default(),
            awake: Vec::new(),
        };
        if let (Cores::Own, Some((near, far))) = (cores, first_two()) {
            (places.near, places.far) = (Some(near), Some(far));
            for core in [near, far] {
                let over = Arc::clone(&places.over);
                let (tell, told) = mpsc::sync_channel(1);
                let awake = move || keep_awake(&core, &over, &tell);
                places.awake.push(thread::spawn(awake));
                let is_awake = told.recv().map_err(|_| BenchError::Panicked)?;
                is_awake.map_err(BenchError::Cores)?;
            }
        }
        Ok(places)
    }

    /// What they really are.
    pub(super) fn cores(&self) -> Cores {
        match self.near {
            Some(_) => Cores::Own,
            None => Cores::Any,
        }
    }

    /// Runs both ends at the same time, each in its place.
    pub(super) fn run<N: Send, F: Send>(
        &self,
        near: impl FnOnce() -> Result<N, BenchError> + Send,
        far: impl FnOnce() -> Result<F, BenchError> + Send,
    ) -> Result<(N, F), BenchError> {
        thread::scope(|scope| {
            let near = scope.spawn(|| placed(self.near.as_ref(), near));
            let far = scope.spawn(|| placed(self.far.as_ref(), far));
            let near = near.join().map_err(|_| BenchError::Panicked)?;
            let far = far.join().map_err(|_| BenchError::Panicked)?;
            Ok((near?, far?))
        })
    }

    /// A turn of both ends.
    pub(super) fn turn(
        &self,
        near: impl FnOnce() -> Result<Side, BenchError> + Send,
        far: impl FnOnce() -> Result<Side, BenchError> + Send,
    ) -> Result<Turn, BenchError> {
        let (near, far) = self.run(near, far)?;
        Ok(Turn { near, far })
    }
}

impl Drop for Places {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
        for thread in self.awake.drain(..) {
            // it has nothing to panic about, and nothing depends on it
            let _ = thread.join();
        }
    }
}

fn first_two() -> Option<(CpuSet, CpuSet)> {
    let allowed = sched_getaffinity(None).ok()?;
    let mut usable = (0..CpuSet::MAX_CPU).filter(|core| allowed.is_set(*core));
    let only = |core| {
        let mut set = CpuSet::new();
        set.set(core);
        set
    };
    Some((only(usable.next()?), only(usable.next()?)))
}

/// Runs an end on its core, if it has one.
fn placed<T>(
    core: Option<&CpuSet>,
    end: impl FnOnce() -> Result<T, BenchError>,
) -> Result<T, BenchError> {
    core.map_or(Ok(()), stay).map_err(BenchError::Cores)?;
    end()
}

/// Keeps the calling thread on `core`.
fn stay(core: &CpuSet) -> io::Result<()> {
    Ok(sched_setaffinity(None, core)?)
}

/// Spins on `core` while nobody else wants it, once it has told that it can give way to all others.
fn keep_awake(core: &CpuSet, over: &AtomicBool, tell: &mpsc::SyncSender<io::Result<()>>) {
    let able = stay(core).and_then(|()| yield_to_all());
    let spins = able.is_ok();
    if tell.send(able).is_ok() && spins {
        while !over.load(Ordering::Relaxed) {
            std::hint::spin_loop();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The cores that the calling thread may use.
    fn mine() -> Result<Vec<usize>, BenchError> {
        let allowed = sched_getaffinity(None).unwrap();
        Ok((0..CpuSet::MAX_CPU)
            .filter(|core| allowed.is_set(*core))
            .collect())
    }

    #[test]
    fn each_end_has_its_core_and_the_caller_keeps_its_own() {
        let before = mine().unwrap();
        let places = Places::try_new(Cores::Own).unwrap();
        let (near, far) = places.run(mine, mine).unwrap();
        match before.as_slice() {
            [first, second, ..] => {
                assert_eq!(places.cores(), Cores::Own);
                assert_eq!((near, far), (vec![*first], vec![*second]));
                let awake = places.awake.iter().filter(|thread| !thread.is_finished());
                assert_eq!(awake.count(), 2, "they stay awake until the end");
            }
            _ => assert_eq!(places.cores(), Cores::Any),
        }
        drop(places);
        assert_eq!(mine().unwrap(), before);
    }

    #[test]
    fn left_to_the_kernel_they_may_run_anywhere() {
        let places = Places::try_new(Cores::Any).unwrap();
        let (near, far) = places.run(mine, mine).unwrap();
        assert_eq!((&near, &far), (&mine().unwrap(), &mine().unwrap()));
        assert!(places.awake.is_empty());
        assert_eq!(places.cores(), Cores::Any);
    }

    #[test]
    fn a_core_that_cannot_be_had_is_told_with_what_to_do() {
        let mut places = Places::try_new(Cores::Any).unwrap();
        places.far = Some(CpuSet::new());
        let error = places.run(mine, mine).unwrap_err().to_string();
        assert!(error.contains("--cores any"), "{error}");
    }
}
