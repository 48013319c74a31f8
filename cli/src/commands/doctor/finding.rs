//! One thing that was looked at, and how it is judged.

use std::fmt;

use mmt_shared::clean::clean;
use serde::Serialize;

/// How a finding is judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Verdict {
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
pub(super) struct Finding {
    /// What.
    pub(super) subject: &'static str,
    pub(super) verdict: Verdict,
    /// What was found.
    pub(super) found: String,
    /// What to do; none where nothing is to be done.
    pub(super) remedy: Option<String>,
}

impl Finding {
    pub(super) fn fit(subject: &'static str, found: impl fmt::Display) -> Self {
        Self {
            subject,
            verdict: Verdict::Fit,
            // what a peer wrote may stand in it
            found: clean(&found.to_string()),
            remedy: None,
        }
    }

    pub(super) fn of(
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

    #[test]
    fn the_words_of_a_peer_steer_no_terminal_and_forge_no_finding() {
        let hostile = "closed by peer: bye\x1b[2J\r\nfit      slave             answers\u{202e}";
        let of_peer = [
            Finding::fit("slave", hostile),
            Finding::of("slave", Verdict::Unfit, hostile, "look again"),
        ];
        for finding in of_peer {
            let unfit = |c: char| (c.is_control() && c != '\n') || c == '\u{202e}';
            let shown = finding.to_string();
            let lines = 1 + usize::from(finding.remedy.is_some());
            assert!(!shown.contains(unfit), "{shown:?}");
            assert_eq!(shown.lines().count(), lines, "{shown:?}");
            assert!(shown.contains("bye?[2J??fit"), "{shown:?}");
        }
    }
}
