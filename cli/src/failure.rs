//! Why a command ended without success: what, where, what to do, and the exit code.

use std::fmt;

/// The exit codes; `docs/commands.md` lists them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Exit {
    /// The run failed.
    Failed = 1,
    /// Arguments, a configuration, a pairing string or a file are wrong.
    Usage = 2,
    /// The slave refused the master, or is not the slave of the pairing string.
    Refused = 3,
    /// Nobody answered.
    NoAnswer = 4,
    /// The address to listen on cannot be had.
    Address = 5,
    /// A 1 kHz loop has hung, and its watchdog has ended the process.
    Hung = 6,
}

impl Exit {
    /// The code that the process ends with.
    pub(crate) fn code(self) -> u8 {
        self as u8
    }
}

/// The code after a second Ctrl-C: 128 + SIGINT.
pub(crate) const INTERRUPTED_TWICE: i32 = 130;

/// A failure as a person reads it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Failure {
    exit: Exit,
    what: String,
    remedy: Option<String>,
}

impl Failure {
    /// A failure of this kind; `what` names what is wrong and where.
    pub(crate) fn new(exit: Exit, what: impl fmt::Display) -> Self {
        Self {
            exit,
            what: what.to_string(),
            remedy: None,
        }
    }

    /// Wrong input.
    pub(crate) fn usage(what: impl fmt::Display) -> Self {
        Self::new(Exit::Usage, what)
    }

    /// A run that failed.
    pub(crate) fn failed(what: impl fmt::Display) -> Self {
        Self::new(Exit::Failed, what)
    }

    /// A run that a person ended: `done` of `whole` files, experiments, … are done.
    pub(crate) fn interrupted(done: usize, whole: usize, of_what: &str) -> Self {
        Self::failed(format!("interrupted: {done} of {whole} {of_what} are done"))
    }

    /// Adds what to do about it.
    pub(crate) fn remedy(mut self, remedy: impl fmt::Display) -> Self {
        self.remedy = Some(remedy.to_string());
        self
    }

    /// What is wrong and where, without what to do.
    pub(crate) fn what(&self) -> &str {
        &self.what
    }

    /// How the process ends.
    pub(crate) fn exit(&self) -> Exit {
        self.exit
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "error: {}", self.what)?;
        match &self.remedy {
            Some(remedy) => write!(f, "\n  what to do: {remedy}"),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failure_names_what_is_wrong_and_what_to_do() {
        let failure = Failure::usage("no file x").remedy("check the path");
        assert_eq!(
            failure.to_string(),
            "error: no file x\n  what to do: check the path"
        );
        assert_eq!(failure.exit().code(), 2);
    }
}
