//! That the documents name only files that exist: links, and paths in code spans.

use super::{File, Violation};

/// What a path in a code span starts with when it means a file of this repository.
const ROOTS: [&str; 8] = [
    "shared/", "netem/", "server/", "client/", "lab/", "cli/", "tests/", "docs/",
];

/// Links and paths of a document that lead to no file or directory of the repository.
pub fn dead_references(document: &File, files: &[File]) -> Vec<Violation> {
    if !document.path.ends_with(".md") {
        return Vec::new();
    }
    let exists = |path: &str| {
        let inside = format!("{}/", path.trim_end_matches('/'));
        files
            .iter()
            .any(|file| file.path == path || file.path.starts_with(&inside))
    };
    let lines = document
        .text
        .lines()
        .enumerate()
        .map(|(at, line)| (at + 1, line));
    let named = lines.flat_map(|(at, line)| {
        let links = links(line).filter_map(|target| resolve(&document.path, target));
        links.chain(spans(line)).map(move |path| (at, path))
    });
    let dead = named.filter(|(_, path)| !exists(path));
    dead.map(|(at, path)| Violation::at(document, at, format!("`{path}` does not exist")))
        .collect()
}

/// The targets of the links of a line that lead to files.
fn links(line: &str) -> impl Iterator<Item = &str> {
    let targets = line
        .split("](")
        .skip(1)
        .filter_map(|tail| tail.split([')', '#', ' ']).next());
    targets.filter(|target| !target.is_empty() && !target.contains(':'))
}

/// The paths in the code spans of a line.
fn spans(line: &str) -> impl Iterator<Item = String> {
    let spans = line
        .split('`')
        .skip(1)
        .step_by(2)
        .filter(|span| ROOTS.iter().any(|root| span.starts_with(root)));
    let plain = |span: &&str| {
        span.chars()
            .all(|c| c.is_ascii_alphanumeric() || "/._-".contains(c))
    };
    spans.filter(plain).map(str::to_owned)
}

/// A link's target as a path from the root; none if it leaves the repository.
fn resolve(document: &str, target: &str) -> Option<String> {
    let mut parts: Vec<&str> = document.split('/').collect();
    parts.pop();
    for part in target.split('/') {
        match part {
            "" | "." => {}
            ".." => {
                parts.pop()?;
            }
            name => parts.push(name),
        }
    }
    Some(parts.join("/"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the rule finds in a document beside two files.
    fn found(path: &str, text: &str) -> usize {
        let files = [
            File::new("docs/wire.md", ""),
            File::new("shared/src/time.rs", ""),
        ];
        dead_references(&File::new(path, text), &files).len()
    }

    #[test]
    fn a_dead_link_or_path_is_caught() {
        assert_eq!(found("README.md", "see [wire](docs/wires.md)"), 1);
        assert_eq!(
            found("docs/a.md", "see [wire](docs/wire.md) and ![](b.svg)"),
            2
        );
        assert_eq!(found("docs/a.md", "`shared/src/clock.rs`"), 1);
    }

    #[test]
    fn living_links_addresses_and_commands_are_left_alone() {
        assert_eq!(
            found(
                "README.md",
                "[a](docs/wire.md#top), [b](https://example.org/x), [c](#here)"
            ),
            0
        );
        assert_eq!(
            found(
                "docs/a.md",
                "[a](wire.md) [b](../shared/src/time.rs) [c](../../shared/data)"
            ),
            0
        );
        assert_eq!(
            found(
                "docs/a.md",
                "`shared/src/time.rs`, `shared/src`, `mmt replay FILE`, `tests/*.rs`"
            ),
            0
        );
        assert_eq!(found("a.rs", "[a](b.md)"), 0);
    }
}
