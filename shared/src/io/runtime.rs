//! A runtime for quinn on one thread: tasks, timers and sockets around one `ppoll`.
//!
//! The thread that waits in the kernel is the thread that decrypts and hands over: no second thread is woken
//! and no event queue stands between. It must never run on two threads at once, and no task may block.

mod socket;
#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, VecDeque};
use std::fmt;
use std::future::{Future, poll_fn};
use std::io;
use std::net::UdpSocket;
use std::os::fd::{AsFd, OwnedFd};
use std::pin::{Pin, pin};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::task::{Context, Poll, Wake, Waker};
use std::time::{Duration, Instant};

use quinn::{AsyncTimer, AsyncUdpSocket, Runtime};
use rustix::event::{EventfdFlags, PollFd, PollFlags, Timespec, eventfd, poll};

use socket::Port;

/// The future that [`PollRuntime::block_on`] was given; tasks are numbered from 1.
const MAIN: u64 = 0;
/// Tasks that run before timers and sockets are looked at again, so that busy tasks starve nobody.
const BUDGET: usize = 64;

type Task = Pin<Box<dyn Future<Output = ()> + Send>>;

/// The state of a lock whose holders cannot leave it half changed.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Waits for `future`, at most until `deadline`, on any runtime of quinn's; without a deadline as long as it takes.
pub async fn until<T>(
    runtime: &dyn Runtime,
    deadline: Option<Instant>,
    future: impl Future<Output = T>,
) -> Option<T> {
    let mut future = pin!(future);
    let mut timer = deadline.map(|deadline| (deadline, runtime.new_timer(deadline)));
    poll_fn(|context| {
        if let Poll::Ready(result) = future.as_mut().poll(context) {
            return Poll::Ready(Some(result));
        }
        let Some((deadline, timer)) = &mut timer else {
            return Poll::Pending;
        };
        // not every timer is ready as soon as its deadline has passed: tokio's waits for its next millisecond
        if runtime.now() >= *deadline {
            return Poll::Ready(None);
        }
        timer.as_mut().poll(context).map(|()| None)
    })
    .await
}

/// The runtime. Dropping it drops its tasks.
#[derive(Debug)]
pub struct PollRuntime(PollHandle);

/// What quinn is given: spawns tasks, makes timers and sockets. Cheap to clone.
#[derive(Clone)]
pub struct PollHandle(Arc<Shared>);

struct Shared {
    state: Mutex<State>,
    ready: Arc<Ready>,
    running: AtomicBool,
}

#[derive(Default)]
struct State {
    tasks: BTreeMap<u64, (Task, Waker)>,
    last_task: u64,
    /// By deadline, then by timer.
    timers: BTreeMap<(Instant, u64), Waker>,
    last_timer: u64,
    ports: Vec<Weak<Port>>,
}

/// Tasks that want to run, each once, in the order of their wakes.
struct Ready {
    queue: Mutex<VecDeque<u64>>,
    /// Whether the thread is in the kernel, or about to be.
    waiting: AtomicBool,
    /// Brings it back.
    bell: OwnedFd,
}

struct TaskWaker {
    task: u64,
    ready: Arc<Ready>,
}

impl Wake for TaskWaker {
    fn wake(self: Arc<Self>) {
        self.wake_by_ref();
    }

    fn wake_by_ref(self: &Arc<Self>) {
        self.ready.push(self.task);
    }
}

impl Ready {
    fn push(&self, task: u64) {
        let mut queue = lock(&self.queue);
        if !queue.contains(&task) {
            queue.push_back(task);
        }
        drop(queue);
        if self.waiting.load(Ordering::SeqCst) {
            // fails only when it was rung 2^64 - 2 times: it rings already
            let _ = rustix::io::write(&self.bell, &1_u64.to_ne_bytes());
        }
    }

    fn pop(&self) -> Option<u64> {
        lock(&self.queue).pop_front()
    }

    fn is_empty(&self) -> bool {
        lock(&self.queue).is_empty()
    }
}

impl PollRuntime {
    /// A runtime without tasks.
    ///
    /// # Errors
    /// The process is out of descriptors.
    pub fn try_new() -> io::Result<Self> {
        let bell = eventfd(0, EventfdFlags::NONBLOCK | EventfdFlags::CLOEXEC)?;
        let ready = Ready {
            queue: Mutex::default(),
            waiting: AtomicBool::new(false),
            bell,
        };
        Ok(Self(PollHandle(Arc::new(Shared {
            state: Mutex::default(),
            ready: Arc::new(ready),
            running: AtomicBool::new(false),
        }))))
    }

    /// What quinn is given.
    #[must_use]
    pub fn handle(&self) -> PollHandle {
        self.0.clone()
    }

    /// Runs `future`, and the tasks beside it, on this thread until it has its result. Tasks that are not done
    /// then go on in the next call.
    ///
    /// # Errors
    /// Another thread is in here, or the kernel refuses to wait.
    pub fn block_on<F: Future>(&self, future: F) -> io::Result<F::Output> {
        let shared = &self.0.0;
        if shared.running.swap(true, Ordering::Acquire) {
            return Err(io::ErrorKind::ResourceBusy.into());
        }
        let output = shared.run(future);
        shared.running.store(false, Ordering::Release);
        output
    }
}

impl Drop for PollRuntime {
    fn drop(&mut self) {
        // tasks hold the runtime, which holds the tasks
        let tasks = std::mem::take(&mut lock(&self.0.0.state).tasks);
        drop(tasks);
    }
}

impl Shared {
    fn run<F: Future>(&self, future: F) -> io::Result<F::Output> {
        let mut future = pin!(future);
        let waker = self.waker(MAIN);
        self.ready.push(MAIN);
        loop {
            for _ in 0..BUDGET {
                match self.ready.pop() {
                    None => break,
                    Some(MAIN) => {
                        let context = &mut Context::from_waker(&waker);
                        if let Poll::Ready(output) = future.as_mut().poll(context) {
                            return Ok(output);
                        }
                    }
                    Some(task) => self.turn(task),
                }
            }
            self.wait()?;
        }
    }

    fn waker(&self, task: u64) -> Waker {
        let ready = Arc::clone(&self.ready);
        Waker::from(Arc::new(TaskWaker { task, ready }))
    }

    fn turn(&self, id: u64) {
        // out of the map while it runs, so that it can spawn
        let Some((mut task, waker)) = lock(&self.state).tasks.remove(&id) else {
            return;
        };
        let context = &mut Context::from_waker(&waker);
        if task.as_mut().poll(context).is_pending() {
            lock(&self.state).tasks.insert(id, (task, waker));
        }
    }

    /// Waits until a socket, a timer or a wake has news; does not wait if somebody wants to run.
    fn wait(&self) -> io::Result<()> {
        let (ports, due) = self.awaited();
        self.ready.waiting.store(true, Ordering::SeqCst);
        let left = due.map(|due| due.saturating_duration_since(Instant::now()));
        let left = match self.ready.is_empty() {
            true => left,
            false => Some(Duration::ZERO),
        };
        let happened = self.ask_kernel(&ports, left);
        self.ready.waiting.store(false, Ordering::SeqCst);
        let happened = happened?;
        for (port, events) in ports.iter().zip(happened) {
            port.fire(events);
        }
        self.fire();
        Ok(())
    }

    /// The sockets that somebody waits for, and the earliest deadline.
    fn awaited(&self) -> (Vec<Arc<Port>>, Option<Instant>) {
        let mut state = lock(&self.state);
        state.ports.retain(|port| port.strong_count() > 0);
        let ports = state.ports.iter().filter_map(Weak::upgrade);
        let ports = ports.filter(|port| !port.interest().is_empty()).collect();
        let due = state.timers.first_key_value().map(|((due, _), _)| *due);
        (ports, due)
    }

    /// What has happened to each port.
    fn ask_kernel(
        &self,
        ports: &[Arc<Port>],
        left: Option<Duration>,
    ) -> io::Result<Vec<PollFlags>> {
        let bell = PollFd::from_borrowed_fd(self.ready.bell.as_fd(), PollFlags::IN);
        let sockets = ports
            .iter()
            .map(|port| PollFd::from_borrowed_fd(port.as_fd(), port.interest()));
        let mut fds: Vec<_> = std::iter::once(bell).chain(sockets).collect();
        let left = left.and_then(|left| Timespec::try_from(left).ok());
        match poll(&mut fds, left.as_ref()) {
            Ok(_) | Err(rustix::io::Errno::INTR) => {}
            Err(errno) => return Err(errno.into()),
        }
        let mut events = fds.iter().map(PollFd::revents);
        if events.next().is_some_and(|rung| !rung.is_empty()) {
            // fails only when the bell does not ring
            let _ = rustix::io::read(&self.ready.bell, &mut [0; 8]);
        }
        Ok(events.collect())
    }

    /// Wakes whoever waits for a time that has come.
    fn fire(&self) {
        let mut state = lock(&self.state);
        let later = state.timers.split_off(&(Instant::now(), u64::MAX));
        let due = std::mem::replace(&mut state.timers, later);
        drop(state);
        due.into_values().for_each(Waker::wake);
    }
}

impl fmt::Debug for PollHandle {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let tasks = lock(&self.0.state).tasks.len();
        write!(f, "PollHandle of {tasks} tasks")
    }
}

impl Runtime for PollHandle {
    fn new_timer(&self, deadline: Instant) -> Pin<Box<dyn AsyncTimer>> {
        let mut state = lock(&self.0.state);
        state.last_timer += 1;
        Box::pin(Timer {
            shared: Arc::clone(&self.0),
            key: (deadline, state.last_timer),
        })
    }

    fn spawn(&self, task: Task) {
        let mut state = lock(&self.0.state);
        state.last_task += 1;
        let id = state.last_task;
        state.tasks.insert(id, (task, self.0.waker(id)));
        drop(state);
        self.0.ready.push(id);
    }

    fn wrap_udp_socket(&self, socket: UdpSocket) -> io::Result<Arc<dyn AsyncUdpSocket>> {
        let port = Arc::new(Port::try_new(socket)?);
        lock(&self.0.state).ports.push(Arc::downgrade(&port));
        Ok(port)
    }
}

struct Timer {
    shared: Arc<Shared>,
    key: (Instant, u64),
}

impl AsyncTimer for Timer {
    fn reset(mut self: Pin<&mut Self>, deadline: Instant) {
        lock(&self.shared.state).timers.remove(&self.key);
        self.key.0 = deadline;
    }

    fn poll(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<()> {
        let mut state = lock(&self.shared.state);
        if Instant::now() >= self.key.0 {
            state.timers.remove(&self.key);
            return Poll::Ready(());
        }
        state.timers.insert(self.key, context.waker().clone());
        Poll::Pending
    }
}

impl fmt::Debug for Timer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Timer {}", self.key.1)
    }
}

impl Drop for Timer {
    fn drop(&mut self) {
        lock(&self.shared.state).timers.remove(&self.key);
    }
}
