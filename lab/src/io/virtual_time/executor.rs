//! A scheduler whose clock stands still while tasks run and jumps to the next event between them.
//!
//! Tasks run in the order in which they were woken, timers in the order of their deadlines and then of their
//! making: two runs are equal. It must never wait, and no task may run on another thread.

use std::collections::{BTreeMap, VecDeque};
use std::fmt;
use std::future::Future;
use std::io;
use std::net::UdpSocket;
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll, Wake, Waker};
use std::time::{Duration, Instant};

use mmt_shared::time::{Time, duration_nanos};
use quinn::{AsyncTimer, AsyncUdpSocket, Runtime};

type Task = Pin<Box<dyn Future<Output = ()> + Send>>;

/// The state of a lock whose holders cannot leave it half changed.
pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Tasks, timers and the virtual clock of one run; a handle, cheap to clone.
#[derive(Clone)]
pub(super) struct Executor(Arc<Shared>);

struct Shared {
    /// What virtual zero is called in the type that quinn's clock has.
    epoch: Instant,
    state: Mutex<State>,
    woken: Arc<Mutex<Woken>>,
}

#[derive(Default)]
struct State {
    now: Time,
    tasks: BTreeMap<u64, Task>,
    next_task: u64,
    /// By deadline, then by timer.
    timers: BTreeMap<(Time, u64), Waker>,
    next_timer: u64,
}

/// Tasks that are ready to run, each once, in the order of their wakes.
#[derive(Default)]
struct Woken {
    queue: VecDeque<u64>,
}

struct TaskWaker {
    task: u64,
    woken: Arc<Mutex<Woken>>,
}

impl Wake for TaskWaker {
    fn wake(self: Arc<Self>) {
        let mut woken = lock(&self.woken);
        if !woken.queue.contains(&self.task) {
            woken.queue.push_back(self.task);
        }
    }
}

impl Executor {
    pub(super) fn new() -> Self {
        Self(Arc::new(Shared {
            epoch: Instant::now(),
            state: Mutex::default(),
            woken: Arc::default(),
        }))
    }

    /// The virtual time.
    pub(super) fn time(&self) -> Time {
        lock(&self.0.state).now
    }

    /// The earliest deadline of a timer that somebody waits for.
    pub(super) fn next_timer(&self) -> Option<Time> {
        let state = lock(&self.0.state);
        state.timers.first_key_value().map(|((due, _), _)| *due)
    }

    /// Lets the clock jump to `now`.
    pub(super) fn jump(&self, now: Time) {
        let mut state = lock(&self.0.state);
        state.now = state.now.max(now);
    }

    /// Wakes whoever waits for a time that has come.
    pub(super) fn fire(&self) {
        let mut state = lock(&self.0.state);
        let after = state.now + Duration::from_nanos(1);
        let later = state.timers.split_off(&(after, 0));
        let due = std::mem::replace(&mut state.timers, later);
        drop(state);
        due.into_values().for_each(Waker::wake);
    }

    /// Runs every task that was woken, until none is.
    pub(super) fn settle(&self) {
        loop {
            let Some(id) = lock(&self.0.woken).queue.pop_front() else {
                return;
            };
            // out of the map while it runs, so that it can spawn
            let Some(mut task) = lock(&self.0.state).tasks.remove(&id) else {
                continue;
            };
            let waker = Waker::from(Arc::new(TaskWaker {
                task: id,
                woken: Arc::clone(&self.0.woken),
            }));
            if task
                .as_mut()
                .poll(&mut Context::from_waker(&waker))
                .is_pending()
            {
                lock(&self.0.state).tasks.insert(id, task);
            }
        }
    }

    /// Drops all tasks: what they hold of the sockets and of each other goes with them.
    pub(super) fn stop(&self) {
        let tasks = std::mem::take(&mut lock(&self.0.state).tasks);
        drop(tasks);
    }

    fn time_of(&self, instant: Instant) -> Time {
        Time::ZERO + instant.saturating_duration_since(self.0.epoch)
    }
}

impl fmt::Debug for Executor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Executor at {} ns", self.time().as_nanos())
    }
}

impl Runtime for Executor {
    fn new_timer(&self, deadline: Instant) -> Pin<Box<dyn AsyncTimer>> {
        let mut state = lock(&self.0.state);
        state.next_timer += 1;
        Box::pin(Timer {
            executor: self.clone(),
            key: (self.time_of(deadline), state.next_timer),
        })
    }

    fn spawn(&self, task: Task) {
        let mut state = lock(&self.0.state);
        let id = state.next_task;
        state.next_task += 1;
        state.tasks.insert(id, task);
        lock(&self.0.woken).queue.push_back(id);
    }

    fn wrap_udp_socket(&self, _: UdpSocket) -> io::Result<Arc<dyn AsyncUdpSocket>> {
        Err(io::ErrorKind::Unsupported.into())
    }

    fn now(&self) -> Instant {
        self.0.epoch
            + Duration::from_nanos(duration_nanos(self.time().saturating_since(Time::ZERO)))
    }
}

#[derive(Debug)]
struct Timer {
    executor: Executor,
    key: (Time, u64),
}

impl AsyncTimer for Timer {
    fn reset(mut self: Pin<&mut Self>, deadline: Instant) {
        let due = self.executor.time_of(deadline);
        lock(&self.executor.0.state).timers.remove(&self.key);
        self.key.0 = due;
    }

    fn poll(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<()> {
        let mut state = lock(&self.executor.0.state);
        if state.now >= self.key.0 {
            state.timers.remove(&self.key);
            return Poll::Ready(());
        }
        state.timers.insert(self.key, context.waker().clone());
        Poll::Pending
    }
}

impl Drop for Timer {
    fn drop(&mut self) {
        lock(&self.executor.0.state).timers.remove(&self.key);
    }
}
