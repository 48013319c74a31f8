//! That the documents name only what exists: files in links and code spans, and tests.

use super::{File, hold, listing, repository};

/// What a path in a code span starts with when it means a file of this repository.
const ROOTS: &str = "shared/ netem/ server/ client/ lab/ cli/ tests/ docs/ contrib/ .ci/";

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

/// The names of tests in the code spans of a line: words that no key has as many of.
fn tests_named(line: &str) -> impl Iterator<Item = &str> {
    let in_name = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
    let spans = line.split('`').skip(1).step_by(2);
    spans.filter(move |span| span.chars().all(in_name) && span.matches('_').count() >= 6)
}

#[test]
fn documents_name_only_tests_that_exist() {
    let sources: Vec<File> = repository().into_iter().filter(File::is_rust).collect();
    let exists = |name: &str| {
        let definition = format!("fn {name}(");
        sources.iter().any(|file| file.text.contains(&definition))
    };
    let document = |file: &File| file.path.starts_with("docs/") && file.path.ends_with(".md");
    let planted = format!(
        "| `{}` |",
        ["a_test", "that_nobody", "has_written_yet"].join("_")
    );
    hold(
        |file| {
            file.lines_that(document(file), |line| {
                tests_named(line).any(|name| !exists(name))
            })
        },
        [("docs/a.md", planted.as_str())],
        [
            (
                "docs/a.md",
                "`documents_name_only_tests_that_exist`, `samples_per_command`",
            ),
            ("README.md", planted.as_str()),
        ],
    );
}

#[test]
fn no_cell_is_empty_where_hazards_promises_and_figures_stand() {
    let is_empty = |line: &str| {
        let row = line.strip_prefix('|').and_then(|row| row.strip_suffix('|'));
        row.is_some_and(|row| row.split('|').any(|cell| cell.trim().is_empty()))
    };
    hold(
        |file| file.lines_that(file.path == "docs/reliability.md", is_empty),
        [(
            "docs/reliability.md",
            "| a hazard | a promise | a test | | a command |",
        )],
        [
            (
                "docs/reliability.md",
                "| a hazard | a promise | `a_test` | – | a command |",
            ),
            ("docs/reliability.md", "text || text"),
            ("docs/a.md", "| a | |"),
        ],
    );
}
