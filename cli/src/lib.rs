//! The command `mmt`: arguments become a configuration, the configuration becomes a run.
//!
//! Thin: nothing is computed here that a core or a host could compute. Data goes to stdout, messages go to
//! stderr; an error names what is wrong, where, and what to do, and has an exit code (`docs/commands.md`).

#![allow(
    clippy::disallowed_methods,
    clippy::disallowed_types,
    reason = "the command is the shell: arguments, files, terminal, clocks and threads are its business"
)]

mod args;
mod commands;
mod config;
mod failure;
mod input;
mod log;
mod output;
mod panics;
mod progress;
mod stderr;
mod stop;
mod view;

use std::process::ExitCode;
use std::time::Duration;

use clap::Parser;

use args::{Arguments, Command, hinted};
use failure::Failure;
use log::Messages;
use panics::PANICS;

/// How long the end of the process waits for its last messages to be read.
const LAST_WORDS: Duration = Duration::from_secs(1);

/// Runs the command line of this process.
pub fn run() -> ExitCode {
    note_panics();
    let ended = match Arguments::try_parse() {
        Ok(arguments) => execute(arguments.command),
        Err(_) if lacks_live() => Err(no_live()),
        Err(error) => return answer(&hinted(error, &words())),
    };
    let outcomes = [ended, PANICS.judge()];
    let mut code = ExitCode::SUCCESS;
    // the last one is the first cause: a panic fails what else was under way
    for failure in outcomes.into_iter().filter_map(Result::err) {
        output::note(&failure);
        code = ExitCode::from(failure.exit().code());
    }
    stderr::settle(LAST_WORDS);
    code
}

fn execute(command: Command) -> Result<(), Failure> {
    let messages = Messages::install()?;
    match command {
        Command::Demo(arguments) => commands::demo::run(&arguments, &messages),
        Command::Slave(arguments) => commands::slave::run(arguments, &messages),
        Command::Master(arguments) if arguments.observe => {
            commands::observe::run(&arguments, &messages)
        }
        Command::Master(arguments) => commands::master::run(arguments, &messages),
        Command::Netem(arguments) => commands::netem::run(&arguments, &messages),
        Command::Replay(arguments) => commands::replay::run(&arguments),
        Command::Check(arguments) => commands::check::run(&arguments),
        Command::Report(arguments) => commands::report::run(&arguments),
        Command::Export(arguments) => commands::export::run(&arguments),
        #[cfg(feature = "live")]
        Command::Live(arguments) => commands::live::run(&arguments),
        Command::Reproduce(arguments) => commands::reproduce::run(arguments),
        Command::Swarm(arguments) => commands::swarm::run(&arguments),
        Command::Soak(arguments) => commands::soak::run(&arguments),
        Command::Sweep(arguments) => commands::sweep::run(&arguments),
        Command::Doctor(arguments) => commands::doctor::run(&arguments),
        Command::Device(arguments) => commands::device::run(&arguments),
        Command::Identity(arguments) => commands::identity::run(&arguments),
        Command::Config(arguments) => commands::config::run(&arguments),
        Command::Completions { shell } => commands::manual::completions(shell),
        Command::Man(arguments) => commands::manual::pages(&arguments),
        Command::Bench(arguments) => commands::bench::run(&arguments),
    }
}

/// The words of the command line.
fn words() -> Vec<String> {
    let words = std::env::args_os();
    words
        .map(|word| word.to_string_lossy().into_owned())
        .collect()
}

/// Whether `mmt live` is asked for and this build has none.
fn lacks_live() -> bool {
    let mut words = std::env::args_os();
    !cfg!(feature = "live") && words.nth(1).is_some_and(|word| word == "live")
}

fn no_live() -> Failure {
    Failure::usage("this build of mmt has no `mmt live`").remedy(
        "take mmt from its packages, or build it with cargo install --path cli --features live (docs/records.md)",
    )
}

/// Prints help, the version or what is wrong with the arguments.
fn answer(error: &clap::Error) -> ExitCode {
    // whoever closed the stream does not want to read it
    let _ = error.print();
    if error.use_stderr() {
        ExitCode::from(failure::Exit::Usage.code())
    } else {
        ExitCode::SUCCESS
    }
}

/// A panic is a bug and is reported as one, but on a terminal that can be read, and the run does not end well.
fn note_panics() {
    let print = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        view::restore_terminal();
        print(panic);
        PANICS.note(std::thread::current().name());
    }));
}
