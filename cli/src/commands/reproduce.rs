//! `mmt reproduce`: the experiments of `mmt_lab::experiments` on threads, with their files in a folder.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::mpsc::Sender;

use mmt_lab::experiment::findings::{ExperimentError, Section};
use mmt_lab::io::{FRESH_SEED, Folder, Runner};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::args::ReproduceArguments;
use crate::failure::Failure;
use crate::output::{make_folder, note, print, print_json, unwritten};
use crate::progress::Bar;
use crate::stop::Stop;

/// The file that lists what was run.
const MANIFEST: &str = "manifest.json";

/// What was run, with what, and what came of it, after each experiment. Nothing in it depends on the machine or the hour.
#[derive(Clone, Debug, Serialize)]
struct Manifest {
    program: &'static str,
    version: &'static str,
    experiments: Vec<Section>,
    /// Every file with its SHA-256.
    files: BTreeMap<String, String>,
}

/// `manifest.json`: a manifest, and before it what an earlier run of this version has left in the folder.
#[derive(Debug, Serialize, Deserialize)]
struct Kept {
    program: String,
    version: String,
    experiments: Vec<Value>,
    files: BTreeMap<String, String>,
}

impl Kept {
    /// What is in the folder; nothing where it has no manifest of this version.
    fn in_folder(folder: &Path) -> Self {
        let text = std::fs::read_to_string(folder.join(MANIFEST)).unwrap_or_default();
        let kept: Option<Self> = serde_json::from_str(&text).ok();
        let version = env!("CARGO_PKG_VERSION");
        kept.filter(|kept| kept.version == version)
            .unwrap_or_else(|| Self {
                program: "mmt".to_owned(),
                version: version.to_owned(),
                experiments: Vec::new(),
                files: BTreeMap::new(),
            })
    }

    /// The same once this has been run: an experiment that was run before gives way.
    fn after(&self, manifest: &Manifest) -> serde_json::Result<Self> {
        let of_now: Vec<Value> = manifest
            .experiments
            .iter()
            .map(serde_json::to_value)
            .collect::<Result<_, _>>()?;
        let name = |section: &Value| section.get("experiment").cloned();
        let before = self.experiments.iter();
        let stays = |of: &&Value| of_now.iter().all(|now| name(now) != name(of));
        let experiments = before.filter(stays).chain(&of_now).cloned().collect();
        let mut files = self.files.clone();
        files.extend(manifest.files.clone());
        Ok(Self {
            program: self.program.clone(),
            version: self.version.clone(),
            experiments,
            files,
        })
    }
}

/// Runs `mmt reproduce`. Whoever asks for its end keeps the experiments that are done.
///
/// # Errors
/// The folder cannot be written to; stdout cannot be written to; the end was asked for before the last experiment.
pub(crate) fn run(arguments: ReproduceArguments) -> Result<(), Failure> {
    make_folder(&arguments.out)?;
    let folder = Folder::open(&arguments.out).map_err(|error| unwritten(&arguments.out, error))?;
    let stop = Stop::on_signals()?;
    let (json, out) = (arguments.json, arguments.out.display().to_string());
    let wanted = arguments.chosen.experiments.len();
    let mut last: Option<Manifest> = None;
    let bar = Bar::new();
    let shown = bar.clone();
    let left = stop.until_asked(
        move |done| every_experiment(&arguments, folder, &bar, &done),
        |manifest| {
            if !json && let Some(section) = manifest.experiments.last() {
                let tables = &section.findings.tables;
                shown.step_aside(|| tables.iter().try_for_each(print))?;
            }
            last = Some(manifest);
            Ok(())
        },
    )?;
    shown.clear();
    if json && let Some(manifest) = &last {
        print_json(manifest)?;
    }
    if left {
        let done = last.map_or(0, |manifest| manifest.experiments.len());
        return Err(
            Failure::interrupted(done, wanted, "experiments").remedy(format!(
                "what is done is kept in {out}; give the names of the others"
            )),
        );
    }
    note(format_args!("files are in {out}"));
    Ok(())
}

/// Runs the experiments in their order. After each the manifest is kept and sent.
fn every_experiment(
    arguments: &ReproduceArguments,
    folder: Folder,
    bar: &Bar,
    done: &Sender<Manifest>,
) -> Result<(), Failure> {
    let progress = |what: &str, done, whole| bar.show(what, done, whole);
    let before = Kept::in_folder(folder.path());
    let runner = Runner::new(folder, arguments.jobs, &progress).from_seed(FRESH_SEED);
    let mut manifest = Manifest {
        program: "mmt",
        version: env!("CARGO_PKG_VERSION"),
        experiments: Vec::new(),
        files: BTreeMap::new(),
    };
    let explained = |error| explain(error, &arguments.out);
    for experiment in &arguments.chosen.experiments {
        let section = experiment.reproduce(&runner, &arguments.request(experiment));
        bar.clear();
        manifest.experiments.push(section.map_err(explained)?);
        manifest.files = runner.folder().kept();
        manifest.files.remove(MANIFEST);
        let failed = |error| Failure::failed(format!("cannot write {MANIFEST}: {error}"));
        let kept = before.after(&manifest).map_err(failed)?;
        let text = serde_json::to_string_pretty(&kept).map_err(failed)?;
        let kept = runner.keep(MANIFEST, format!("{text}\n").as_bytes());
        kept.map_err(explained)?;
        if done.send(manifest.clone()).is_err() {
            break;
        }
    }
    Ok(())
}

fn explain(error: ExperimentError, out: &Path) -> Failure {
    match error {
        ExperimentError::Physics(_) => {
            Failure::usage(error).remedy("change --mass, --side, --mu or --damping")
        }
        ExperimentError::Keep { .. } => unwritten(out, error),
        _ => Failure::failed(format!("the experiment failed: {error}")),
    }
}
