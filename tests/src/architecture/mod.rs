//! The invariants of the house as functions of text: source, manifest, dependency tree.
//!
//! Every rule takes text and returns what it found wrong, so its own tests can hand it a planted violation and
//! see it caught; `tests/architecture.rs` runs the same rules over the repository. The rules read no file and
//! run no command, except `repository`, which collects the text.

pub mod attributes;
pub mod code;
pub mod documents;
pub mod equations;
pub mod files;
pub mod layers;
pub mod manifest;
pub mod purity;
pub mod repository;
pub mod tree;

use std::fmt;

/// One file of the repository.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct File {
    /// Path from the root of the repository, with `/` between its parts.
    pub path: String,
    /// The whole content.
    pub text: String,
}

impl File {
    /// A file from its path and content.
    pub fn new(path: &str, text: &str) -> Self {
        Self {
            path: path.to_owned(),
            text: text.to_owned(),
        }
    }

    /// Whether the file is Rust source.
    pub fn is_rust(&self) -> bool {
        self.path.ends_with(".rs")
    }

    /// Whether the file is test or bench code only: it may panic and unwrap.
    pub fn is_test(&self) -> bool {
        let mut parts = self.path.split('/').skip(1);
        parts.any(|part| {
            matches!(part, "tests" | "benches" | "tests.rs") || part.ends_with("_tests.rs")
        })
    }

    /// Whether the file belongs to a shell: it may read clocks and open sockets, threads and files.
    pub fn is_shell(&self) -> bool {
        let mut parts = self.path.split('/');
        self.is_test()
            || matches!(parts.next(), Some("cli" | "tests"))
            || parts.any(|part| matches!(part, "io" | "io.rs"))
    }

    /// Whether the file belongs to the pure core of a crate.
    pub fn is_core(&self) -> bool {
        self.is_rust() && !self.is_shell()
    }
}

/// One place where the repository breaks a rule.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Violation {
    /// File and line, or the crate.
    pub place: String,
    /// What is wrong and what to do.
    pub what: String,
}

impl Violation {
    /// A violation at a place.
    pub fn new(place: impl Into<String>, what: impl Into<String>) -> Self {
        Self {
            place: place.into(),
            what: what.into(),
        }
    }

    /// A violation on a line (the first is 1) of a file.
    pub fn at(file: &File, line: usize, what: impl Into<String>) -> Self {
        Self::new(format!("{}:{line}", file.path), what)
    }
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.place, self.what)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cores_shells_and_tests_are_told_apart_by_path() {
        let role = |path| {
            let file = File::new(path, "");
            (file.is_core(), file.is_shell(), file.is_test())
        };
        assert_eq!(role("shared/src/time.rs"), (true, false, false));
        assert_eq!(role("lab/src/world.rs"), (true, false, false));
        assert_eq!(role("shared/src/io/clock.rs"), (false, true, false));
        assert_eq!(role("lab/src/io.rs"), (false, true, false));
        assert_eq!(role("cli/src/main.rs"), (false, true, false));
        assert_eq!(role("tests/src/lib.rs"), (false, true, false));
        assert_eq!(role("tests/tests/architecture.rs"), (false, true, true));
        assert_eq!(role("netem/src/link/tests.rs"), (false, true, true));
        assert_eq!(role("shared/src/io/connect_tests.rs"), (false, true, true));
        assert_eq!(role("server/benches/world.rs"), (false, true, true));
        assert_eq!(role("shared/src/audio/mod.rs"), (true, false, false));
    }
}
