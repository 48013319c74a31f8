//! A process, most of all the command `mmt`: started, watched, and killed when the test is over.
//!
//! No call waits without a bound, and no process outlives its guard.

use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread;
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use thiserror::Error;

use super::judge::Records;

/// How often a process is asked whether it has ended.
const ASK: Duration = Duration::from_millis(10);

/// Why a process did not do what was asked of it.
#[derive(Debug, Error)]
pub(crate) enum ProcessError {
    /// It could not be started, asked or signalled.
    #[error("{what}: {source}")]
    System {
        /// What was tried.
        what: String,
        /// The system's error.
        source: std::io::Error,
    },
    /// It printed or ended nothing in time.
    #[error("{what} within {seconds} s; so far it printed:\n{printed}")]
    Late {
        /// What was waited for.
        what: String,
        /// For how long.
        seconds: f64,
        /// Its standard output and error.
        printed: String,
    },
    /// A session that it recorded does not keep what is promised, or cannot be judged.
    #[error("{name}: {broken}\nit printed:\n{printed}")]
    Broken {
        /// The command.
        name: String,
        /// What is broken.
        broken: String,
        /// Its standard error.
        printed: String,
    },
    /// It ended with another document than one of JSON.
    #[error("no JSON document ({source}) in:\n{printed}")]
    Document {
        /// Why.
        source: serde_json::Error,
        /// Its standard output and error.
        printed: String,
    },
}

/// The program `mmt`, as it was built with this test.
pub(crate) const PROGRAM: &str = env!("CARGO_BIN_EXE_mmt-under-test");
/// A slave listens by then, however busy the host is.
const LISTENS: Duration = Duration::from_secs(120);

/// A running process whose output is collected; killed when dropped. What it recorded of its sessions is judged then.
#[derive(Debug)]
pub(crate) struct Running {
    name: String,
    child: Child,
    lines: Receiver<Line>,
    out: Vec<String>,
    err: Vec<String>,
    /// What it, and whatever it starts, records of its sessions.
    records: Option<Records>,
}

#[derive(Debug)]
enum Line {
    Out(String),
    Err(String),
}

/// A process that has ended.
#[derive(Debug)]
pub(crate) struct Ended {
    /// How.
    pub(crate) status: ExitStatus,
    /// The lines of its standard output.
    pub(crate) out: Vec<String>,
    /// Its standard error.
    pub(crate) err: String,
    /// When that was seen.
    pub(crate) at: Instant,
}

impl Ended {
    /// The one JSON document on standard output, after `skip` lines of other things.
    ///
    /// # Errors
    /// There is none, or something besides it.
    pub(crate) fn document(&self, skip: usize) -> Result<Value, ProcessError> {
        let lines: Vec<_> = self.out.iter().skip(skip).map(String::as_str).collect();
        serde_json::from_str(&lines.join("\n")).map_err(|source| ProcessError::Document {
            source,
            printed: format!("{}\n{}", self.out.join("\n"), self.err),
        })
    }
}

impl Running {
    /// Starts a command.
    ///
    /// # Errors
    /// The system does not start it.
    pub(crate) fn start(command: Command) -> Result<Self, ProcessError> {
        Self::start_reading(command, "")
    }

    /// Starts a command whose standard input is this.
    ///
    /// # Errors
    /// The system does not start it.
    pub(crate) fn start_reading(mut command: Command, input: &str) -> Result<Self, ProcessError> {
        let name = format!("{command:?}");
        let records = Records::of(&mut command);
        let records = records.map_err(|source| system(format!("a folder for {name}"), source))?;
        let mut child = command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(|source| system(format!("starting {name}"), source))?;
        // one that reads nothing may have ended before
        let _ = child
            .stdin
            .take()
            .map(|mut stdin| stdin.write_all(input.as_bytes()));
        let (send, lines) = channel();
        let (out, err) = (child.stdout.take(), child.stderr.take());
        let send_err = send.clone();
        thread::spawn(move || read(out, |line| send.send(Line::Out(line)).is_ok()));
        thread::spawn(move || read(err, |line| send_err.send(Line::Err(line)).is_ok()));
        Ok(Self {
            name,
            child,
            lines,
            out: Vec::new(),
            err: Vec::new(),
            records: Some(records),
        })
    }

    /// Starts `mmt` with arguments.
    ///
    /// # Errors
    /// It cannot be built or started.
    pub(crate) fn mmt(arguments: &[&str]) -> Result<Self, ProcessError> {
        let mut command = Command::new(PROGRAM);
        command.args(arguments);
        Self::start(command)
    }

    /// Starts a slave on a port of the system's choice, with a report in JSON; returns it and its pairing string.
    ///
    /// # Errors
    /// As [`Running::mmt`], and it does not listen in time.
    pub(crate) fn slave(options: &[&str]) -> Result<(Self, String), ProcessError> {
        let listen = ["slave", "--listen", "127.0.0.1:0", "--json"];
        let mut slave = Self::mmt(&[&listen[..], options].concat())?;
        let pairing = slave.pairing()?;
        Ok((slave, pairing))
    }

    /// Waits for the pairing string of a slave, and returns it.
    ///
    /// # Errors
    /// It does not listen in time.
    pub(crate) fn pairing(&mut self) -> Result<String, ProcessError> {
        self.wait_for_line(LISTENS, |line| line.starts_with("mmt://"))
    }

    /// Waits for a line on standard output or error that `wanted` accepts, and returns it.
    ///
    /// # Errors
    /// It does not come in time, or the process ends before.
    pub(crate) fn wait_for_line(
        &mut self,
        within: Duration,
        wanted: impl Fn(&str) -> bool,
    ) -> Result<String, ProcessError> {
        let printed = self.out.iter().chain(&self.err);
        if let Some(line) = printed.into_iter().find(|line| wanted(line)) {
            return Ok(line.clone());
        }
        self.wait_within(within, wanted)
    }

    fn wait_within(
        &mut self,
        within: Duration,
        wanted: impl Fn(&str) -> bool,
    ) -> Result<String, ProcessError> {
        let end = Instant::now() + within;
        loop {
            let left = end.saturating_duration_since(Instant::now());
            let line = self
                .take_line(left)
                .map_err(|_| self.late("did not print", within))?;
            if wanted(&line) {
                return Ok(line);
            }
        }
    }

    /// Waits for a line like [`Self::wait_for_line`] does, but for one that is not printed yet.
    ///
    /// # Errors
    /// It does not come in time, or the process ends before.
    pub(crate) fn wait_for_next_line(
        &mut self,
        within: Duration,
        wanted: impl Fn(&str) -> bool,
    ) -> Result<String, ProcessError> {
        while self.take_line(Duration::ZERO).is_ok() {}
        self.wait_within(within, wanted)
    }

    /// Waits for the first line on standard output, and returns it.
    ///
    /// # Errors
    /// It does not come in time, or the process ends before.
    pub(crate) fn first_line(&mut self, within: Duration) -> Result<String, ProcessError> {
        let end = Instant::now() + within;
        while self.out.is_empty() {
            let left = end.saturating_duration_since(Instant::now());
            self.take_line(left)
                .map_err(|_| self.late("did not print", within))?;
        }
        Ok(self.out.first().cloned().unwrap_or_default())
    }

    fn take_line(&mut self, within: Duration) -> Result<String, RecvTimeoutError> {
        match self.lines.recv_timeout(within)? {
            Line::Out(line) => {
                self.out.push(line.clone());
                Ok(line)
            }
            Line::Err(line) => {
                self.err.push(line.clone());
                Ok(line)
            }
        }
    }

    /// Presses Ctrl-C.
    ///
    /// # Errors
    /// The process cannot be signalled.
    pub(crate) fn interrupt(&self) -> Result<(), ProcessError> {
        self.signal(Signal::INT)
    }

    /// Waits until it takes Ctrl-C as a wish.
    pub(crate) fn wait_for_handler(&self, within: Duration) {
        let status = format!("/proc/{}/status", self.child.id());
        let takes_interrupts = || {
            let status = std::fs::read_to_string(&status).unwrap_or_default();
            let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
            let mask = caught.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
            mask.is_some_and(|mask| mask & 2 == 2)
        };
        let end = Instant::now() + within;
        while !takes_interrupts() {
            assert!(Instant::now() < end, "{} takes no Ctrl-C", self.name);
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// Sends it a signal.
    ///
    /// # Errors
    /// The process cannot be signalled.
    pub(crate) fn signal(&self, signal: Signal) -> Result<(), ProcessError> {
        let pid = i32::try_from(self.child.id()).ok().and_then(Pid::from_raw);
        let sent = pid.map(|pid| kill_process(pid, signal));
        sent.unwrap_or(Ok(()))
            .map_err(|error| system(format!("signalling {}", self.name), error.into()))
    }

    /// Waits for its end.
    ///
    /// # Errors
    /// It does not end in time; it is killed then.
    pub(crate) fn end(mut self, within: Duration) -> Result<Ended, ProcessError> {
        let end = Instant::now() + within;
        let status = loop {
            let asked = self.child.try_wait();
            match asked.map_err(|source| system(format!("waiting for {}", self.name), source))? {
                Some(status) => break status,
                None if Instant::now() >= end => {
                    while self.take_line(Duration::ZERO).is_ok() {}
                    return Err(self.late("did not end", within));
                }
                None => thread::sleep(ASK),
            }
        };
        let at = Instant::now();
        // both readers end with the process, unless a child of it lives on
        while self.take_line(Duration::from_secs(1)).is_ok() {}
        self.judge()?;
        Ok(Ended {
            status,
            out: std::mem::take(&mut self.out),
            err: self.err.join("\n"),
            at,
        })
    }

    /// Judges the sessions that were recorded, once.
    ///
    /// # Errors
    /// One does not keep what is promised.
    fn judge(&mut self) -> Result<(), ProcessError> {
        let judged = self.records.take().map(Records::judge);
        judged
            .unwrap_or(Ok(()))
            .map_err(|broken| ProcessError::Broken {
                name: self.name.clone(),
                broken,
                printed: self.err.join("\n"),
            })
    }

    fn late(&self, what: &str, within: Duration) -> ProcessError {
        ProcessError::Late {
            what: format!("{} {what} what it should", self.name),
            seconds: within.as_secs_f64(),
            printed: [&self.out[..], &self.err[..]].concat().join("\n"),
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // one that has ended cannot be killed, and that is well
        let _ = self.child.kill();
        let _ = self.child.wait();
        // a test that fails already says why
        if !thread::panicking() {
            let judged = self.judge();
            assert!(judged.is_ok(), "{judged:?}");
        }
    }
}

fn system(what: String, source: std::io::Error) -> ProcessError {
    ProcessError::System { what, source }
}

/// Hands over line by line until the end or until nobody listens.
fn read(from: Option<impl Read>, send: impl Fn(String) -> bool) {
    let lines = from.map(|from| BufReader::new(from).lines());
    let mut lines = lines.into_iter().flatten().map_while(Result::ok);
    let _ = lines.all(send);
}

/// The number at a path of keys such as `/link/rtt_ms/p50`; none if it is null or not there.
#[must_use]
pub(crate) fn number(document: &Value, path: &str) -> Option<f64> {
    document.pointer(path).and_then(Value::as_f64)
}

/// Prints a loud warning when a test cannot run here, and fails it where everything must run: where the
/// environment variable `CI` is set.
///
/// # Panics
/// With `CI`.
pub(crate) fn did_not_run(test: &str, why: &str) {
    let ci = std::env::var_os("CI").is_some();
    assert!(!ci, "{test} did not run, and CI must run it: {why}");
    warn_loudly(&format!("NOT RUN: {test}: {why}"));
}

/// Prints what must not be overlooked although the test passes.
pub(crate) fn warn_loudly(what: &str) {
    // not eprintln: the harness keeps that to itself when a test passes
    let _ = writeln!(std::io::stderr(), "\n**** {what} ****\n");
}
