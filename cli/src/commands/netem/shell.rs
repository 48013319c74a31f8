//! `mmt netem shell`: runs a command in a network namespace of its own, with all its IP traffic through the emulated links.

use std::io;
use std::net::Ipv4Addr;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::process::{Child, Command, ExitStatus};
use std::time::{Duration, Instant};

use mmt_netem::effect::BYTES;
use mmt_netem::io::relay::RelaySnapshot;
use mmt_netem::io::tunnel::Tunnel;
use mmt_netem::record::Heading;
use rustix::process::{Pid, Signal as Kill, kill_process, kill_process_group};
use serde::Serialize;
use tokio::runtime::{Builder, Runtime};
use tokio::signal::unix::{Signal, SignalKind, signal};

use super::files::Files;
use crate::args::NetemShellArguments;
use crate::failure::Failure;
use crate::log::Messages;
use crate::output::note;
use crate::stderr::settle;

mod ends;
mod names;
mod tun;

use super::start::{CHECK_EVERY, DEGRADED, announce, start_error};
use ends::Ends;

/// Packets per second for which the effect of the networks is printed.
const RATE_HZ: f64 = 100.0;

/// How long messages may take to reach stderr at the end.
const SETTLE: Duration = Duration::from_millis(100);

/// The document of a shell.
#[derive(Debug, Serialize)]
struct ShellReport {
    version: &'static str,
    command: &'static str,
    seed: u64,
    duration_s: f64,
    /// What the command ended with; beyond 128 the signal that ended it.
    exit_code: i32,
    /// Whether this host was too slow for the run to be about these networks.
    degraded: bool,
    /// Of IP packets with their headers.
    counters: RelaySnapshot,
    configuration: ShellConfiguration,
}

#[derive(Debug, Serialize)]
struct ShellConfiguration {
    near: Ipv4Addr,
    far: Ipv4Addr,
    up: String,
    down: String,
}

/// Runs `mmt netem shell`. Ends the process with the command's exit code unless that is 0.
///
/// # Errors
/// The host forbids namespaces or has not what they need, a file cannot be written, the command cannot be run.
pub(super) fn run(arguments: &NetemShellArguments, messages: &Messages) -> Result<(), Failure> {
    let (up, down) = (arguments.up.clone(), arguments.down.clone());
    let ends = Ends::make(arguments.beside.is_some())?;
    let mut signals = Signals::take().map_err(Failure::failed)?;
    let heading = Heading {
        seed: arguments.seed,
        up: up.to_string(),
        down: down.to_string(),
    };
    let files = Files::begin(&arguments.files, &heading)?;
    let extras = files.extras();
    let [near, far] = ends.interfaces().map_err(Failure::failed)?;
    let names = ["up  ", "down"].map(str::to_owned);
    let effects = announce([&up, &down], RATE_HZ, BYTES, names, messages);
    let tunnel = Tunnel::start(near, far, up, down, arguments.seed, extras).map_err(start_error)?;
    let began = Instant::now();
    let status = run_in(&ends, arguments, &mut signals)?;
    let duration_s = began.elapsed().as_secs_f64();
    let counters = tunnel.stop().map_err(Failure::failed)?;
    let _ = effects.join();
    let kept = files.finish();
    let degraded = counters.lateness.degraded();
    if degraded {
        note(DEGRADED);
    }
    let signal = status.signal().unwrap_or(0);
    let exit_code = status.code().unwrap_or(128 + signal);
    let report = ShellReport {
        version: env!("CARGO_PKG_VERSION"),
        command: "netem shell",
        seed: arguments.seed,
        duration_s,
        exit_code,
        degraded,
        counters,
        configuration: ShellConfiguration {
            near: ends.near_ip,
            far: ends.far_ip,
            up: heading.up,
            down: heading.down,
        },
    };
    drop(ends);
    if let Some(path) = &arguments.report {
        let text = serde_json::to_string_pretty(&report).map_err(Failure::failed)?;
        std::fs::write(path, text).map_err(|error| {
            Failure::failed(format!(
                "cannot write the report {}: {error}",
                path.display()
            ))
        })?;
    }
    if exit_code != 0 {
        // the exit code is the command's
        kept.unwrap_or_else(note);
        settle(SETTLE);
        std::process::exit(exit_code);
    }
    kept
}

/// Runs the command at the near end, and what was given for the far end beside it, to its end.
fn run_in(
    ends: &Ends,
    arguments: &NetemShellArguments,
    signals: &mut Signals,
) -> Result<ExitStatus, Failure> {
    let cannot = |what: &str, error: io::Error| {
        Failure::usage(format!("cannot run {what}: {error}")).remedy("check the command")
    };
    let mut beside = None;
    if let Some(words) = &arguments.beside {
        let mut command = Command::new("sh");
        // a group of its own, so that all of it ends
        command.arg("-c").arg(words).process_group(0);
        command.env("MMT_NEAR", ends.near_ip.to_string());
        command.env("MMT_FAR", ends.far_ip.to_string());
        let child = ends
            .at_the_far_end(command)
            .map_err(|error| cannot(words, error))?;
        beside = Some(Beside(child));
    }
    let mut command = if arguments.beside.is_some() {
        names::plain(&arguments.command)
    } else {
        names::command_with_names(&arguments.command)
    };
    command.env("MMT_NEAR", ends.near_ip.to_string());
    command.env("MMT_FAR", ends.far_ip.to_string());
    let name = command.get_program().to_string_lossy().into_owned();
    let child = ends
        .at_the_near_end(command)
        .map_err(|error| cannot(&name, error))?;
    let mut child = Ended(child);
    loop {
        if let Some(status) = child.0.try_wait().map_err(Failure::failed)? {
            drop(beside);
            return Ok(status);
        }
        if signals.wait(CHECK_EVERY)
            && let Some(pid) = pid(&child.0)
        {
            // it may have ended meanwhile
            let _ = kill_process(pid, Kill::TERM);
        }
    }
}

/// The signals to this process while a command runs: Ctrl-C is the command's, SIGTERM and SIGHUP are passed on.
struct Signals {
    runtime: Runtime,
    _interrupt: Signal,
    terminate: Signal,
    hang_up: Signal,
}

impl Signals {
    fn take() -> io::Result<Self> {
        let runtime = Builder::new_current_thread().enable_all().build()?;
        let inside = runtime.enter();
        let interrupt = signal(SignalKind::interrupt())?;
        let terminate = signal(SignalKind::terminate())?;
        let hang_up = signal(SignalKind::hangup())?;
        drop(inside);
        Ok(Self {
            runtime,
            _interrupt: interrupt,
            terminate,
            hang_up,
        })
    }

    /// Waits this long, or less if somebody wants the end; whether somebody does.
    fn wait(&mut self, patience: Duration) -> bool {
        let (terminate, hang_up) = (&mut self.terminate, &mut self.hang_up);
        self.runtime.block_on(async {
            tokio::select! {
                _ = terminate.recv() => true,
                _ = hang_up.recv() => true,
                () = tokio::time::sleep(patience) => false,
            }
        })
    }
}

/// The command, which does not outlive this run.
struct Ended(Child);

impl Drop for Ended {
    fn drop(&mut self) {
        // one that has ended already takes neither
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// What runs beside it, with all that it started.
struct Beside(Child);

impl Drop for Beside {
    fn drop(&mut self) {
        if let Some(pid) = pid(&self.0) {
            let _ = kill_process_group(pid, Kill::KILL);
        }
        let _ = self.0.wait();
    }
}

fn pid(child: &Child) -> Option<Pid> {
    i32::try_from(child.id()).ok().and_then(Pid::from_raw)
}
