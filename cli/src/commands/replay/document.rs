//! The document of a replay: the report of a run, as far as its keys have a meaning here, and every table.

use mmt_lab::replay::{Law, PipelineReport, ReplayConfig, ReplayReport};
use mmt_shared::model::update::Cause;
use mmt_shared::report::{Number, RunReport, SentUpdates, named};
use serde::Serialize;

/// The law of the run report's own keys; all laws are in the section `replay`.
const LAW: Law = Law::LimitSurface;

/// A file and what its replay found.
#[derive(Debug, Serialize)]
pub(super) struct Replayed {
    /// Its path as it was given.
    pub(super) file: String,
    /// What was found.
    #[serde(flatten)]
    pub(super) report: ReplayReport,
    /// The same pushes through mmt itself, and the last measured force held instead; none if the finger goes where no tool
    /// can.
    pub(super) pipeline: Vec<PipelineReport>,
}

/// `{ ...RunReport, "replay": { … } }`.
#[derive(Debug, Serialize)]
pub(super) struct Document {
    #[serde(flatten)]
    run: RunReport<Configuration>,
    replay: Section,
}

#[derive(Debug, Serialize)]
struct Configuration {
    files: Vec<String>,
    replay: ReplayConfig,
}

#[derive(Debug, Serialize)]
struct Section {
    /// The law of the run report's own keys.
    law: Law,
    files: Vec<Replayed>,
}

impl Document {
    /// The document of these replays, all run by `config`; `left` if a person asked for the end before the last.
    pub(super) fn new(config: &ReplayConfig, replayed: Vec<Replayed>, left: bool) -> Self {
        let configuration = Configuration {
            files: replayed.iter().map(|one| one.file.clone()).collect(),
            replay: *config,
        };
        let mut run = RunReport::new("replay", configuration);
        run.seed = Some(config.seed);
        run.ending = Some(if left { "interrupted" } else { "finished" });
        let sum = |of: fn(&ReplayReport) -> f64| replayed.iter().map(|one| of(&one.report)).sum();
        let (duration_s, contact_s): (f64, f64) = (
            sum(|report| report.duration_s),
            sum(|report| report.contact_s),
        );
        run.duration_s = duration_s.into();
        let pushes: usize = replayed.iter().map(|one| one.report.pushes.len()).sum();
        run.pushes.completed = Some(pushes as u64);
        run.updates.sent = sent_updates(&replayed, duration_s, contact_s);
        // one estimate has a meaning for one object only
        if let [only] = replayed.as_slice() {
            let law = only.report.law(LAW);
            run.model.friction_n.estimate = law.map(|law| law.friction_n).into();
        }
        Self {
            run,
            replay: Section {
                law: LAW,
                files: replayed,
            },
        }
    }
}

fn sent_updates(replayed: &[Replayed], duration_s: f64, contact_s: f64) -> SentUpdates {
    let laws = || replayed.iter().filter_map(|one| one.report.law(LAW));
    let sent: u64 = laws().map(|law| law.updates.sent).sum();
    let by = |cause| match cause {
        Cause::Deadband => laws().map(|law| law.updates.packets.deadband).sum(),
        Cause::Timer => laws().map(|law| law.updates.packets.timer).sum(),
        // the replay's trigger has no other cause
        _ => 0,
    };
    SentUpdates {
        sent: Some(sent),
        rate_hz: Number::rate(sent as f64, duration_s),
        contact_rate_hz: Number::rate(sent as f64, contact_s),
        by_cause: Some(named(Cause::ALL.map(|cause| (cause.name(), by(cause))))),
        ..SentUpdates::default()
    }
}
