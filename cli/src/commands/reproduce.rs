//! `mmt reproduce`: the experiments of `mmt_lab::reproduce` on threads, with their files in a folder.

mod desk;
mod manifest;

use std::time::Duration;

use mmt_lab::physics::Body;
use mmt_lab::reproduce::traces::Trace;
use mmt_lab::reproduce::{
    Extent, Findings, ReproduceError, ablation, claims, congestion, delay, fig5, netem, physics,
    repeats, scenarios, schemes, traces, tupdate,
};
use mmt_lab::transport;

use crate::args::{BodyArguments, Experiment, ReproduceArguments};
use crate::failure::Failure;
use crate::output::{note, print, print_json};

use desk::Desk;
use manifest::Manifest;

/// Length of a run: four or five pushes.
const DURATION: Duration = Duration::from_secs(30);
/// Length of a run of the delay experiment, whose pushes come later, and of the congestion experiment, which
/// needs time to come back.
const LONG_DURATION: Duration = Duration::from_secs(40);
/// Length of a run of the transport experiment: 864 runs, a second of which may be an outage.
const TRANSPORT_DURATION: Duration = Duration::from_secs(20);
/// Seeds of fig. 5: the paper's ten repetitions.
const SEEDS: u64 = 10;
/// Seeds of the sweep over T_update: 252 places.
const TUPDATE_SEEDS: u64 = 5;
/// Seeds of the delay experiment.
const DELAY_SEEDS: u64 = 5;
/// Seeds of the experiment on repeats: one update in a thousand must be seen.
const REPEAT_SEEDS: u64 = 20;
/// Seeds of the claims: with fewer, differences between the schemes are noise.
const CLAIM_SEEDS: u64 = 40;

/// Runs `mmt reproduce`.
///
/// # Errors
/// The folder cannot be written to; stdout cannot be written to.
pub(crate) fn run(arguments: &ReproduceArguments) -> Result<(), Failure> {
    let desk = Desk::open(&arguments.out, arguments.jobs)?;
    let mut found = Vec::new();
    for experiment in experiments(&arguments.experiment) {
        let findings = reproduce(&desk, &experiment, arguments)?;
        if !arguments.json {
            for table in &findings.tables {
                print(table)?;
            }
        }
        found.push(findings);
    }
    let manifest = Manifest::new(&found, desk.files());
    desk.keep_manifest(&manifest)?;
    if arguments.json {
        print_json(&manifest)?;
    }
    note(format_args!("files are in {}", desk.folder().display()));
    Ok(())
}

/// What one word of the command line asks for.
fn experiments(experiment: &Experiment) -> Vec<Experiment> {
    let body = BodyArguments::from(Body::default());
    match experiment {
        Experiment::All => vec![
            Experiment::Physics(body),
            Experiment::Fig5 { samples: false },
            Experiment::Fig6,
            Experiment::Fig7,
            Experiment::Claims,
            Experiment::Ablation,
            Experiment::Schemes,
            Experiment::Scenarios,
            Experiment::Tupdate,
            Experiment::Repeats,
            Experiment::Congestion,
            Experiment::Netem,
            Experiment::Transport,
            Experiment::Delay { full: false },
        ],
        one => vec![one.clone()],
    }
}

fn reproduce(
    desk: &Desk,
    experiment: &Experiment,
    arguments: &ReproduceArguments,
) -> Result<Findings, Failure> {
    let extent = |seeds: u64| Extent {
        seeds: arguments.seeds.unwrap_or(seeds),
        duration: arguments.duration.unwrap_or(DURATION),
    };
    let findings = match experiment {
        // taken apart in `experiments`
        Experiment::All => return Err(Failure::failed("all is not one experiment")),
        Experiment::Physics(body) => physics::reproduce(desk, extent(1), &Body::from(*body)),
        Experiment::Fig5 { samples } => fig5::reproduce(desk, extent(SEEDS), *samples),
        Experiment::Fig6 => traces::reproduce(desk, extent(1), Trace::Fig6),
        Experiment::Fig7 => traces::reproduce(desk, extent(1), Trace::Fig7),
        Experiment::Ablation => ablation::reproduce(desk, extent(SEEDS)),
        Experiment::Schemes => schemes::reproduce(desk, extent(SEEDS)),
        Experiment::Scenarios => scenarios::reproduce(desk, extent(SEEDS)),
        Experiment::Tupdate => tupdate::reproduce(desk, extent(TUPDATE_SEEDS)),
        Experiment::Repeats => repeats::reproduce(desk, extent(REPEAT_SEEDS)),
        Experiment::Congestion => {
            let extent = Extent {
                duration: arguments.duration.unwrap_or(LONG_DURATION),
                ..extent(SEEDS)
            };
            congestion::reproduce(desk, extent)
        }
        Experiment::Netem => netem::reproduce(desk, extent(SEEDS)),
        Experiment::Transport => {
            let extent = Extent {
                duration: arguments.duration.unwrap_or(TRANSPORT_DURATION),
                ..extent(1)
            };
            transport::reproduce(desk, extent)
        }
        Experiment::Delay { full } => {
            let extent = Extent {
                duration: arguments.duration.unwrap_or(LONG_DURATION),
                ..extent(DELAY_SEEDS)
            };
            delay::reproduce(desk, extent, *full)
        }
        Experiment::Claims => claims::reproduce(desk, extent(CLAIM_SEEDS)),
    };
    findings.map_err(|error| match error {
        ReproduceError::Physics(_) => {
            Failure::usage(error).remedy("change --mass, --side, --mu or --damping")
        }
        ReproduceError::Keep { .. } => {
            Failure::failed(error).remedy("check the folder given with --out: is the disk full?")
        }
        _ => Failure::failed(format!("the experiment failed: {error}")),
    })
}
