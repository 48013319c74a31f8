//! A child of the soak: this very program, with its messages in a file. It never outlives its guard.

use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};

use super::usage::Usage;
use crate::failure::{Failure, INTERRUPTED_TWICE};

/// A start or an end may take so long, however busy the host is.
pub(super) const PATIENCE: Duration = Duration::from_secs(60);
/// Between two looks at whether a process has ended.
const LOOK: Duration = Duration::from_millis(10);
/// Signals that the soak ends processes with, some of them before they listen for it: SIGKILL, SIGUSR1, SIGUSR2, SIGTERM.
const OURS: [i32; 4] = [9, 10, 12, 15];

/// How a process ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ended {
    /// Exit code 0.
    Well,
    /// Exit code 1: the link or the other side was away for too long.
    Early,
    /// Exit code 3.
    Refused,
    /// Exit code 4.
    Unanswered,
    /// By a signal of the soak, or by the second one that asked it to end.
    Killed,
    /// Otherwise: it should not.
    Wrong(ExitStatus),
}

impl Ended {
    fn of(status: ExitStatus) -> Self {
        match (status.code(), status.signal()) {
            // it was asked twice
            (Some(INTERRUPTED_TWICE), _) => Self::Killed,
            (Some(0), _) => Self::Well,
            (Some(1), _) => Self::Early,
            (Some(3), _) => Self::Refused,
            (Some(4), _) => Self::Unanswered,
            (None, Some(signal)) if OURS.contains(&signal) => Self::Killed,
            _ => Self::Wrong(status),
        }
    }

    /// In a table.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Well => "ended well",
            Self::Early => "ended early",
            Self::Refused => "refused",
            Self::Unanswered => "unanswered",
            Self::Killed => "killed",
            Self::Wrong(_) => "ended wrongly",
        }
    }
}

/// A running child.
#[derive(Debug)]
pub(super) struct Process {
    name: String,
    child: Child,
    stdin: Option<ChildStdin>,
    log: PathBuf,
}

impl Process {
    /// Starts `mmt` with arguments; its messages go to `NAME.log` in the folder, what it keeps for itself to `state`.
    ///
    /// # Errors
    /// The file cannot be made, or the system does not start it.
    pub(super) fn start(
        name: &str,
        folder: &Path,
        state: &Path,
        arguments: &[&str],
    ) -> Result<Self, Failure> {
        let log = folder.join(format!("{name}.log"));
        let failed = |error| Failure::failed(format!("cannot start the {name}: {error}"));
        let program = std::env::current_exe().map_err(failed)?;
        let mut child = Command::new(program)
            .args(arguments)
            .env("XDG_STATE_HOME", state)
            // Ctrl-C is the soak's alone
            .process_group(0)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(File::create(&log).map_err(failed)?)
            .spawn()
            .map_err(failed)?;
        Ok(Self {
            name: name.to_owned(),
            stdin: child.stdin.take(),
            child,
            log,
        })
    }

    /// The first line that it prints; nobody keeps the rest.
    ///
    /// # Errors
    /// It prints none.
    pub(super) fn first_line(&mut self) -> Result<String, Failure> {
        let lines = self.child.stdout.take().map(lines_of);
        let line = lines.and_then(|lines| lines.recv_timeout(PATIENCE).ok());
        line.ok_or_else(|| {
            let what = format!("the {} printed nothing for {PATIENCE:?}", self.name);
            Failure::failed(what).remedy(format!("see {}", self.log.display()))
        })
    }

    /// Writes a line to its stdin. One that has ended does not read it, which is seen elsewhere.
    pub(super) fn send_line(&mut self, line: &str) {
        if let Some(stdin) = &mut self.stdin {
            let _ = writeln!(stdin, "{line}");
        }
    }

    /// Sends it a signal. One that has ended gets none.
    pub(super) fn signal(&self, signal: Signal) {
        if let Some(pid) = i32::try_from(self.child.id()).ok().and_then(Pid::from_raw) {
            let _ = kill_process(pid, signal);
        }
    }

    /// How it ended, if it has.
    pub(super) fn ended(&mut self) -> Option<Ended> {
        self.child.try_wait().ok().flatten().map(Ended::of)
    }

    /// Asks it to end, and waits for that; none if it does not end, which is a broken promise.
    pub(super) fn end(mut self) -> (Option<Ended>, Self) {
        self.signal(Signal::TERM);
        self.signal(Signal::CONT);
        let asked = Instant::now();
        loop {
            let ended = self.ended();
            if ended.is_some() || asked.elapsed() > PATIENCE {
                return (ended, self);
            }
            std::thread::sleep(LOOK);
        }
    }

    /// What it has of the system's now; none if it has ended.
    pub(super) fn usage(&self) -> Option<Usage> {
        Usage::of(self.child.id())
    }

    /// Whether a thread of it panicked, by its messages.
    pub(super) fn panicked(&self) -> bool {
        let log = std::fs::read(&self.log).unwrap_or_default();
        String::from_utf8_lossy(&log).contains("panicked at")
    }

    /// What it is.
    pub(super) fn name(&self) -> &str {
        &self.name
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // one that has ended cannot be killed, and that is well
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The lines of a child's stdout, read to the end by a thread of their own.
fn lines_of(stdout: ChildStdout) -> Receiver<String> {
    let (sender, lines) = channel();
    std::thread::spawn(move || {
        for line in BufReader::new(stdout).lines().map_while(Result::ok) {
            // nobody waits for more than the first
            let _ = sender.send(line);
        }
    });
    lines
}
