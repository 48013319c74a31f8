//! Rules over the texts of the repository, each seen to refuse what is planted for it before it is held.
#![allow(
    clippy::unwrap_used,
    reason = "it is the body of tests, which fail by panicking"
)]

use std::collections::BTreeMap;
use std::process::Command;

use regex::Regex;

use super::root;

/// Texts by their paths from the root.
pub(crate) type Files = BTreeMap<String, String>;

const PLANTED: &str = include_str!("planted.txt");
const PLANTED_PATH: &str = "tests/tests/harness/planted.txt";

pub(crate) fn pattern(words: &str) -> Regex {
    Regex::new(words).unwrap()
}

/// The paths that are under version control, or would be.
pub(crate) fn listing() -> Vec<String> {
    let options = ["ls-files", "--cached", "--others", "--exclude-standard"];
    let mut git = Command::new("git");
    let output = git.args(options).current_dir(root()).output().unwrap();
    let listing = String::from_utf8(output.stdout).unwrap();
    let paths: Vec<String> = listing.lines().map(str::to_owned).collect();
    assert!(paths.len() > 200, "the repository is not here");
    paths
}

/// The text files of the repository, but for those that are planted.
pub(crate) fn repository() -> Files {
    let paths = listing().into_iter();
    let own = paths.filter(|path| path != PLANTED_PATH);
    let read = |path: String| Some((std::fs::read_to_string(root().join(&path)).ok()?, path));
    own.filter_map(read)
        .map(|(text, path)| (path, text))
        .collect()
}

/// The sets of files that are planted for a rule, and whether it must refuse them.
fn planted(rule: &str) -> Vec<(bool, Files)> {
    let (_, behind) = PLANTED.split_once(&format!("\n{rule}\n")).unwrap();
    let lines = behind.lines().take_while(|line| !line.is_empty());
    let file = |file: &str| {
        let (path, text) = file.split_once(": ").unwrap();
        (path.to_owned(), text.replace("\\n", "\n"))
    };
    let set = |line: &str| {
        let (sign, files) = line.split_once(' ').unwrap();
        (sign == "-", files.split(" && ").map(file).collect())
    };
    lines.map(set).collect()
}

/// Sees a rule refuse what is planted for it and pass what is clean, then holds the repository to it. A rule gives what is
/// broken.
pub(crate) fn hold(name: &str, rule: impl Fn(&Files) -> Vec<String>) {
    for (refused, files) in planted(name) {
        assert_eq!(!rule(&files).is_empty(), refused, "{name}: {files:?}");
    }
    assert_eq!(rule(&repository()), [""; 0], "{name}");
}

/// The same of a rule that a file breaks by itself.
pub(crate) fn hold_files(name: &str, breaks: impl Fn(&str, &str) -> bool) {
    hold(name, |files| {
        let broken = files.iter().filter(|(path, text)| breaks(path, text));
        broken.map(|(path, _)| path.clone()).collect()
    });
}

/// The same of a rule that a line breaks by itself.
pub(crate) fn hold_lines(name: &str, breaks: impl Fn(&str, &str) -> bool) {
    hold(name, |files| {
        let lines = |(path, text): (&String, &String)| -> Vec<String> {
            let broken = text.lines().zip(1..).filter(|(line, _)| breaks(path, line));
            broken
                .map(|(_, number)| format!("{path}:{number}"))
                .collect()
        };
        files.iter().flat_map(lines).collect()
    });
}
