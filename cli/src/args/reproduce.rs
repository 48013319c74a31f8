//! The arguments of `mmt reproduce`: a subcommand for each experiment of the list, by its own description.

use std::collections::BTreeMap;
use std::num::NonZero;
use std::path::PathBuf;
use std::time::Duration;

use clap::{Arg, ArgAction, ArgMatches, Args, Command, FromArgMatches, Subcommand};
use mmt_lab::experiment::description::{Argument, DURATION, Experiment, Request};
use mmt_lab::experiment::findings::Extent;
use mmt_lab::experiments::ALL;

use super::values;

/// Arguments of `mmt reproduce`.
#[derive(Debug, Args)]
pub(crate) struct ReproduceArguments {
    /// What to reproduce.
    #[command(subcommand)]
    pub(crate) chosen: Chosen,
    /// Folder for CSV, SVG and manifest.json; made if it is not there
    #[arg(long, global = true, value_name = "DIR", default_value = "figures")]
    pub(crate) out: PathBuf,
    /// N seeds, from 5001 on [default: each experiment's own number]
    #[arg(long, global = true, value_name = "N", value_parser = values::whole::<u64>(1, 10_000), allow_negative_numbers = true)]
    pub(crate) seeds: Option<u64>,
    /// Length of a run.
    #[arg(long, global = true, value_name = "TIME", value_parser = values::duration, allow_hyphen_values = true, help = duration_help())]
    pub(crate) duration: Option<Duration>,
    /// Threads [default: as many as the machine has cores]
    #[arg(long, global = true, value_name = "N", value_parser = values::jobs, allow_negative_numbers = true)]
    pub(crate) jobs: Option<NonZero<usize>>,
    /// Print one JSON document instead of tables
    #[arg(long, global = true)]
    pub(crate) json: bool,
}

impl ReproduceArguments {
    /// How an experiment is to be done.
    pub(crate) fn request(&self, experiment: &Experiment) -> Request {
        Request {
            extent: Extent {
                seeds: self.seeds.unwrap_or(experiment.seeds),
                duration: self.duration.unwrap_or(experiment.duration),
            },
            given: self.chosen.given.clone(),
        }
    }
}

/// The experiments that were asked for, and the numbers given to them; a flag that was given is 1.
#[derive(Debug)]
pub(crate) struct Chosen {
    pub(crate) experiments: Vec<&'static Experiment>,
    given: BTreeMap<&'static str, f64>,
}

impl Subcommand for Chosen {
    fn augment_subcommands(command: Command) -> Command {
        let command = command.subcommands(ALL.iter().copied().map(subcommand));
        command.subcommand(Command::new("all").about("All of these, in one folder"))
    }

    fn augment_subcommands_for_update(command: Command) -> Command {
        Self::augment_subcommands(command)
    }

    fn has_subcommand(name: &str) -> bool {
        name == "all" || ALL.iter().any(|experiment| experiment.name == name)
    }
}

impl FromArgMatches for Chosen {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let Some((name, matches)) = matches.subcommand() else {
            return Err(clap::Error::new(clap::error::ErrorKind::MissingSubcommand));
        };
        let wanted = |experiment: &&Experiment| {
            experiment.name == name || name == "all" && experiment.in_all
        };
        let named = ALL.iter().copied().filter(wanted);
        let named: Vec<&Experiment> = named.collect();
        // `all` takes none of them
        let arguments = named.iter().filter(|experiment| experiment.name == name);
        let arguments = arguments.flat_map(|experiment| experiment.arguments);
        Ok(Self {
            given: arguments.filter_map(|of| given(of, matches)).collect(),
            experiments: named,
        })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

fn subcommand(experiment: &Experiment) -> Command {
    let arguments = experiment.arguments.iter().map(|argument| {
        let arg = Arg::new(argument.name).long(argument.name);
        match argument.number {
            None => arg.help(argument.help).action(ArgAction::SetTrue),
            Some((unit, default)) => arg
                .help(format!("{} [default: {default}]", argument.help))
                .value_name(unit)
                .value_parser(values::number)
                .allow_negative_numbers(true),
        }
    });
    Command::new(experiment.name)
        .about(experiment.about)
        .args(arguments)
}

fn given(argument: &Argument, matches: &ArgMatches) -> Option<(&'static str, f64)> {
    let name = argument.name;
    match argument.number {
        None => matches.get_flag(name).then_some((name, 1.0)),
        Some(_) => Some((name, *matches.get_one(name)?)),
    }
}

/// The lengths of runs that are not most experiments'.
fn duration_help() -> String {
    let others = ALL
        .iter()
        .copied()
        .filter(|experiment| experiment.duration != DURATION);
    let other = |of: &Experiment| format!("{}: {}s", of.name, of.duration.as_secs());
    let others: Vec<String> = others.map(other).collect();
    let most = DURATION.as_secs();
    format!(
        "Length of a run, in virtual time [default: {most}s; {}]",
        others.join(", ")
    )
}
