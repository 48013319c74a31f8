//! `mmt doctor`: is this host fit for a 1 kHz loop, and does a slave answer.

mod host;
mod peer;

use std::fmt;

use serde::Serialize;

use super::master::pairing;
use crate::args::DoctorArguments;
use crate::failure::{Exit, Failure};
use crate::output::{note, print, print_json};

/// How a finding is judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
enum Verdict {
    /// As it should be.
    Fit,
    /// Sessions run; their figures are better with the remedy.
    Advised,
    /// Sessions suffer or do not begin.
    Unfit,
}

impl Verdict {
    fn word(self) -> &'static str {
        match self {
            Self::Fit => "fit",
            Self::Advised => "advised",
            Self::Unfit => "UNFIT",
        }
    }
}

/// One thing that was looked at.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Finding {
    /// What.
    subject: &'static str,
    verdict: Verdict,
    /// What was found.
    found: String,
    /// What to do; none where nothing is to be done.
    remedy: Option<String>,
}

impl Finding {
    fn fit(subject: &'static str, found: impl fmt::Display) -> Self {
        Self {
            subject,
            verdict: Verdict::Fit,
            found: found.to_string(),
            remedy: None,
        }
    }

    fn of(
        subject: &'static str,
        verdict: Verdict,
        found: impl fmt::Display,
        remedy: impl fmt::Display,
    ) -> Self {
        Self {
            verdict,
            remedy: Some(remedy.to_string()),
            ..Self::fit(subject, found)
        }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (word, subject) = (self.verdict.word(), self.subject);
        write!(f, "{word:9}{subject:18}{}", self.found)?;
        match &self.remedy {
            Some(remedy) => write!(f, "\n{:27}what to do: {remedy}", ""),
            None => Ok(()),
        }
    }
}

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_finding_is_a_line_and_its_remedy_the_next() {
        assert_eq!(
            Finding::fit("clock", "tsc").to_string(),
            "fit      clock             tsc"
        );
        let advised = Finding::of("clock", Verdict::Advised, "hpet", "use tsc").to_string();
        let lines: Vec<&str> = advised.lines().collect();
        assert_eq!(lines.len(), 2);
        assert!(
            lines[0].starts_with("advised  clock") && lines[1].ends_with("what to do: use tsc")
        );
    }
}
