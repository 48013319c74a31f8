//! `mmt reproduce`: the experiments of `mmt_lab::experiments` on threads, with their files in a folder.

use std::collections::BTreeMap;

use mmt_lab::experiment::findings::{ExperimentError, Section};
use mmt_lab::io::{Folder, Runner};
use serde::Serialize;

use crate::args::ReproduceArguments;
use crate::failure::Failure;
use crate::output::{note, print, print_json};
use crate::progress::Bar;

/// `manifest.json`: what was run, with what, and what came of it. Nothing in it depends on the machine or the hour.
#[derive(Debug, Serialize)]
struct Manifest {
    program: &'static str,
    version: &'static str,
    experiments: Vec<Section>,
    /// Every file with its SHA-256.
    files: BTreeMap<String, String>,
}

/// Runs `mmt reproduce`.
///
/// # Errors
/// The folder cannot be written to; stdout cannot be written to.
pub(crate) fn run(arguments: &ReproduceArguments) -> Result<(), Failure> {
    let folder = Folder::open(&arguments.out).map_err(|error| {
        let what = format!(
            "cannot make the folder {}: {error}",
            arguments.out.display()
        );
        Failure::usage(what).remedy("give another one with --out")
    })?;
    let bar = Bar::new();
    let progress = |what: &str, done, whole| bar.show(what, done, whole);
    let runner = Runner::new(folder, arguments.jobs, &progress);
    let mut experiments = Vec::new();
    for experiment in &arguments.chosen.experiments {
        let section = experiment.reproduce(&runner, &arguments.request(experiment));
        bar.clear();
        let section = section.map_err(explain)?;
        if !arguments.json {
            for table in &section.findings.tables {
                print(table)?;
            }
        }
        experiments.push(section);
    }
    let manifest = Manifest {
        program: "mmt",
        version: env!("CARGO_PKG_VERSION"),
        experiments,
        files: runner.folder().kept(),
    };
    let failed = |error| Failure::failed(format!("cannot write manifest.json: {error}"));
    let text =
        serde_json::to_string_pretty(&manifest).map_err(|error| failed(error.to_string()))?;
    let kept = runner.keep("manifest.json", format!("{text}\n").as_bytes());
    kept.map_err(explain)?;
    if arguments.json {
        print_json(&manifest)?;
    }
    let folder = runner.folder().path().display();
    note(format_args!("files are in {folder}"));
    Ok(())
}

fn explain(error: ExperimentError) -> Failure {
    match error {
        ExperimentError::Physics(_) => {
            Failure::usage(error).remedy("change --mass, --side, --mu or --damping")
        }
        ExperimentError::Keep { .. } => {
            Failure::failed(error).remedy("check the folder given with --out: is the disk full?")
        }
        _ => Failure::failed(format!("the experiment failed: {error}")),
    }
}
