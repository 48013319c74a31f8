//! A host on a thread of its own with a runtime of its own, as it would be in a process of its own.

use std::thread::JoinHandle;

use tokio::runtime::{Builder, Runtime};

use crate::failure::Failure;

/// A host at work.
pub(super) struct Host<T> {
    name: &'static str,
    thread: JoinHandle<Result<T, Failure>>,
}

/// Runs `work`, which is given the runtime to run in, on a thread of that name.
///
/// # Errors
/// The system gives no thread or no runtime.
pub(super) fn spawn<T: Send + 'static>(
    name: &'static str,
    work: impl FnOnce(&Runtime) -> Result<T, Failure> + Send + 'static,
) -> Result<Host<T>, Failure> {
    let no_thread = |error| Failure::failed(format!("no thread for the {name}: {error}"));
    let runtime = Builder::new_current_thread().enable_all().build();
    let runtime = runtime.map_err(no_thread)?;
    let thread = std::thread::Builder::new()
        .name(name.to_owned())
        .spawn(move || work(&runtime))
        .map_err(no_thread)?;
    Ok(Host { name, thread })
}

impl<T> Host<T> {
    /// Whether it is still at work.
    pub(super) fn is_running(&self) -> bool {
        !self.thread.is_finished()
    }

    /// Waits for its end.
    ///
    /// # Errors
    /// What the host failed of.
    pub(super) fn join(self) -> Result<T, Failure> {
        self.thread.join().unwrap_or_else(|_| {
            let what = format!("the {} panicked", self.name);
            Err(Failure::failed(what)
                .remedy("this is a defect of mmt: please report it with what stands above"))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_host_that_panics_is_a_failure_reported_by_its_name() {
        let host = spawn::<()>("slave", |_| panic!("on purpose")).unwrap();
        let failure = host.join().unwrap_err().to_string();
        assert!(failure.contains("the slave panicked"), "{failure}");
    }

    #[test]
    fn a_host_gives_what_its_work_gives() {
        let host = spawn("slave", |runtime| Ok(runtime.block_on(async { 7 }))).unwrap();
        assert_eq!(host.join(), Ok(7));
    }
}
