//! That the documents name only what exists: files in links and code spans, headings, and tests.

use std::collections::{BTreeMap, BTreeSet};

use regex::Regex;

use crate::harness::rules::{hold, hold_lines, listing, pattern, repository};

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

/// The lines of a document outside of its code blocks, with their numbers.
fn prose(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut in_code = false;
    (1..).zip(text.lines()).filter(move |(_, line)| {
        let is_fence = line.trim_start().starts_with("```");
        in_code ^= is_fence;
        !in_code && !is_fence
    })
}

/// What GitHub names the headings of a document: small letters, digits, `_` and `-`, a space as `-`; one that was there before
/// gets a number.
fn anchors(text: &str) -> BTreeSet<String> {
    let (heading, link) = (
        pattern(r"^#{1,6} +(.*)$"),
        pattern(r"\[([^\]]*)\]\([^)]*\)"),
    );
    let (mut met, mut anchors) = (BTreeMap::new(), BTreeSet::new());
    for (_, line) in prose(text) {
        for words in caught(&heading, line) {
            let words = link.replace_all(words.trim(), "$1").to_lowercase();
            let kept = words.replace(' ', "-");
            let kept = kept
                .chars()
                .filter(|c| c.is_alphanumeric() || "-_".contains(*c));
            let kept: String = kept.collect();
            let before: &mut usize = met.entry(kept.clone()).or_default();
            anchors.insert(match before {
                0 => kept,
                _ => format!("{kept}-{before}"),
            });
            *before += 1;
        }
    }
    anchors
}

#[test]
fn documents_link_only_to_headings_that_exist() {
    let link = pattern(r"\]\(([^):# ]*#[^) ]+)[) ]");
    hold("documents_link_only_to_headings_that_exist", |files| {
        let documents = files.iter().filter(|(path, _)| path.ends_with(".md"));
        let of = |(path, text): (&String, &String)| (path.clone(), anchors(text));
        let anchors: BTreeMap<String, BTreeSet<String>> = documents.clone().map(of).collect();
        let is_there = |document: &str, target: &str| {
            let (file, anchor) = target.split_once('#')?;
            let file = match file {
                "" => Some(document.to_owned()),
                file => resolve(document, file),
            };
            // another rule holds that the file is there
            Some(anchors.get(&file?)?.contains(anchor))
        };
        let broken = |(path, text): (&String, &String)| -> Vec<String> {
            let links = prose(text)
                .flat_map(|(number, line)| caught(&link, line).map(move |target| (number, target)));
            let broken = links.filter(|(_, target)| is_there(path, target) == Some(false));
            broken
                .map(|(number, target)| format!("{path}:{number}: {target}"))
                .collect()
        };
        documents.flat_map(broken).collect()
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
