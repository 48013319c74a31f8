//! The run that `cost.py` makes from Python, in Rust: prints its CPU time in seconds and its digest. Takes the length in seconds.
#![allow(
    clippy::print_stdout,
    clippy::disallowed_methods,
    reason = "it is a command"
)]

use std::process::ExitCode;
use std::time::Duration;

use mmt_lab::trial::{Trial, TrialError};
use mmt_lab::world::WorldConfig;
use mmt_shared::io::clock::thread_cpu_time;

fn main() -> ExitCode {
    let length = std::env::args()
        .nth(1)
        .and_then(|seconds| seconds.parse().ok());
    let Some(seconds) = length else {
        return ExitCode::FAILURE;
    };
    match run(Duration::from_secs(seconds)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(_) => ExitCode::FAILURE,
    }
}

fn run(duration: Duration) -> Result<(), TrialError> {
    let link = "delay 50ms 5ms loss 1%".parse().unwrap_or_default();
    let began = thread_cpu_time();
    let measured = Trial::new(WorldConfig::over(link), duration).run()?;
    let spent = thread_cpu_time().saturating_sub(began);
    println!("{} {}", spent.as_secs_f64(), measured.digest);
    Ok(())
}
