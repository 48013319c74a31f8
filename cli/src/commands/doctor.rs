//! `mmt doctor`: is this host fit for a 1 kHz loop, and does a slave answer.

mod finding;
mod host;
mod peer;

use serde::Serialize;

use super::master::pairing;
use crate::args::DoctorArguments;
use crate::failure::{Exit, Failure};
use crate::output::{note, print, print_json};
use finding::{Finding, Verdict};

/// All that was looked at.
#[derive(Debug, Serialize)]
struct Diagnosis {
    fit: bool,
    findings: Vec<Finding>,
}

/// Runs `mmt doctor`.
///
/// # Errors
/// Something is unfit, or the pairing string is wrong.
pub(crate) fn run(arguments: &DoctorArguments) -> Result<(), Failure> {
    let slave = arguments.pairing.as_ref().map(pairing).transpose()?;
    note(format_args!(
        "measuring a 1 kHz loop for {:.0} s",
        host::LOOP.as_secs_f64()
    ));
    let mut findings = host::findings();
    if let Some(slave) = &slave {
        findings.extend(peer::findings(slave)?);
    }
    let fit = findings.iter().all(|one| one.verdict < Verdict::Unfit);
    let unfit = findings.iter().filter(|one| one.verdict == Verdict::Unfit);
    let subjects: Vec<&str> = unfit.map(|one| one.subject).collect();
    if arguments.json {
        print_json(&Diagnosis { fit, findings })?;
    } else {
        findings.iter().try_for_each(print)?;
    }
    if fit {
        return Ok(());
    }
    let what = format!("unfit: {}", subjects.join(", "));
    Err(Failure::new(Exit::Failed, what).remedy("what stands behind each finding"))
}
