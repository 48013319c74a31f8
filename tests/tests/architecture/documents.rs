//! That the documents name only files that exist: links, and paths in code spans.

use super::{File, hold, listing};

/// What a path in a code span starts with when it means a file of this repository.
const ROOTS: &str = "shared/ netem/ server/ client/ lab/ cli/ tests/ docs/ .ci/";

/// The targets of the links of a line that lead to files, as paths from the root of the repository.
fn links(document: &str, line: &str) -> Vec<String> {
    let tails = line.split("](").skip(1);
    let targets = tails.filter_map(|tail| tail.split([')', '#', ' ']).next());
    let inside = targets.filter(|target| !target.is_empty() && !target.contains(':'));
    inside
        .filter_map(|target| resolve(document, target))
        .collect()
}

/// The paths in the code spans of a line.
fn spans(line: &str) -> Vec<String> {
    let in_path = |c: char| c.is_ascii_alphanumeric() || "/._-".contains(c);
    let rooted = |span: &&str| ROOTS.split(' ').any(|root| span.starts_with(root));
    let spans = line.split('`').skip(1).step_by(2).filter(rooted);
    spans
        .filter(|span| span.chars().all(in_path))
        .map(str::to_owned)
        .collect()
}

/// A link's target as a path from the root; none if it leaves the repository.
fn resolve(document: &str, target: &str) -> Option<String> {
    let mut parts: Vec<&str> = document.split('/').collect();
    parts.pop();
    for part in target.split('/').filter(|part| !["", "."].contains(part)) {
        if part == ".." {
            parts.pop()?;
        } else {
            parts.push(part);
        }
    }
    Some(parts.join("/"))
}

#[test]
fn documents_name_only_files_that_exist() {
    let listing = listing();
    let exists = |path: &str| {
        let inside = format!("{}/", path.trim_end_matches('/'));
        let mut files = listing.lines();
        files.any(|file| file == path || file.starts_with(&inside))
    };
    let dead = |file: &File, line: &str| {
        let mut named = links(&file.path, line).into_iter().chain(spans(line));
        named.any(|path| !exists(&path))
    };
    hold(
        |file| file.lines_that(file.path.ends_with(".md"), |line| dead(file, line)),
        [
            ("README.md", "see [model](docs/models.md)"),
            ("docs/a.md", "see [model](docs/model.md)"),
            ("docs/a.md", "![](none.svg)"),
            ("docs/a.md", "`shared/src/none.rs`"),
        ],
        [
            (
                "README.md",
                "[a](docs/model.md#top), [b](https://a.org/x), [c](#here)",
            ),
            (
                "docs/a.md",
                "[a](model.md) [b](../shared/src/lib.rs) [c](../../shared/data)",
            ),
            ("docs/a.md", "`shared/src`, `mmt replay FILE`, `tests/*.rs`"),
            ("a.rs", "[a](b.md)"),
        ],
    );
}
