//! That the documents name only what exists: files in links and code spans, and tests.

use std::collections::BTreeSet;

use regex::Regex;

use crate::harness::rules::{hold_lines, listing, pattern, repository};

/// What the first group of a pattern catches in a line.
fn caught<'a>(pattern: &Regex, line: &'a str) -> impl Iterator<Item = &'a str> {
    let found = pattern.captures_iter(line);
    found.filter_map(|found| Some(found.get(1)?.as_str()))
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
    let exists = |path: &String| {
        let inside = format!("{}/", path.trim_end_matches('/'));
        let mut files = listing.iter();
        files.any(|file| file == path || file.starts_with(&inside))
    };
    let link = pattern(r"\]\(([^):# ]+)[)# ]");
    let roots = "shared|netem|server|client|lab|cli|tests|docs|contrib|\\.ci";
    let span = pattern(&format!("`((?:{roots})/[A-Za-z0-9/._-]*)`"));
    hold_lines("documents_name_only_files_that_exist", |path, line| {
        let linked = caught(&link, line).filter_map(|target| resolve(path, target));
        let mut named = linked.chain(caught(&span, line).map(str::to_owned));
        path.ends_with(".md") && !named.all(|path| exists(&path))
    });
}

#[test]
fn documents_name_only_tests_that_exist() {
    let sources = repository()
        .into_iter()
        .filter(|(path, _)| path.ends_with(".rs"));
    let code: String = sources.map(|(_, text)| text).collect();
    let definition = pattern(r"fn ([a-z0-9_]+)\(");
    let tests: BTreeSet<&str> = caught(&definition, &code).collect();
    // words that no key has as many of
    let name = pattern(r"`((?:[a-z0-9]*_){6,}[a-z0-9]*)`");
    hold_lines("documents_name_only_tests_that_exist", |path, line| {
        let document = path.starts_with("docs/") && path.ends_with(".md");
        document && !caught(&name, line).all(|name| tests.contains(name))
    });
}

#[test]
fn no_cell_is_empty_where_hazards_promises_and_figures_stand() {
    let empty = pattern(r"^\|(.*\|)?\s*\|(.*\|)?$");
    let name = "no_cell_is_empty_where_hazards_promises_and_figures_stand";
    hold_lines(name, |path, line| {
        path == "docs/reliability.md" && empty.is_match(line)
    });
}
