//! The rules of the house that no lint can state, held over the files of the repository.
//!
//! Lints, `clippy.toml`, `deny.toml` and `.ci/core` state the others; `.ci/planted` plants a violation of each of those. What
//! breaks a rule that stands here is planted in `tests/tests/harness/planted.txt`.

use crate::harness::rules::{hold, hold_files, hold_lines, pattern, repository};

mod circles;

/// The test command that the documents name and the checks end with.
const TEST_COMMAND: &str = "cargo test --workspace";
/// The crates with a pure core.
const CORES: [&str; 5] = ["shared", "netem", "server", "client", "lab"];
/// The files that may lift the ban on `unsafe`: calls of the operating system without a safe wrapper, and the counting
/// allocator of a test.
const UNSAFE_FILES: [&str; 3] = [
    "shared/src/io/realtime.rs",
    "cli/src/commands/netem/shell/tun.rs",
    "tests/tests/counting_allocator.rs",
];
/// The files that hold forbidden words as words.
const RULES: &str = "tests/tests/architecture";

#[test]
fn every_source_file_opens_with_what_it_is() {
    hold_files("every_source_file_opens_with_what_it_is", |path, text| {
        path.ends_with(".rs") && !text.starts_with("//! ")
    });
}

#[test]
fn nothing_is_left_unfinished_or_ignored() {
    // in parts, so that this file does not hold them
    let words = pattern(concat!("TO", "DO|FIX", "ME|XX", r"X|#\[ign", "ore"));
    hold_lines("nothing_is_left_unfinished_or_ignored", |path, line| {
        path.ends_with(".rs") && words.is_match(line)
    });
}

#[test]
fn no_file_names_a_directory_of_one_machine() {
    let names = pattern(r"(^|[^\w.\-})~*])/(work|root|home|Users)/");
    hold_lines("no_file_names_a_directory_of_one_machine", |_, line| {
        names.is_match(line)
    });
}

#[test]
fn the_checks_end_with_the_test_command_that_the_documents_name() {
    let name = "the_checks_end_with_the_test_command_that_the_documents_name";
    hold_files(name, |path, text| {
        let code = |line: &&str| !line.is_empty() && !line.starts_with('#');
        let last = text.lines().rfind(code).unwrap_or_default();
        path == ".ci/run" && !last.ends_with(TEST_COMMAND)
            || ["README.md", "CONTRIBUTING.md"].contains(&path) && !text.contains(TEST_COMMAND)
    });
}

#[test]
fn only_the_environment_names_the_physics_engine() {
    let names = pattern(r"^([^/]|/[^/])*(rapier2d_f64|parry2d|glam::|glamx)");
    let home = pattern(r"^server/src/environment[/.]");
    hold_lines(
        "only_the_environment_names_the_physics_engine",
        |path, line| {
            let elsewhere = !home.is_match(path) && !path.starts_with(RULES);
            path.ends_with(".rs") && elsewhere && names.is_match(line)
        },
    );
}

#[test]
fn unsafe_code_stays_in_the_named_files() {
    hold_lines("unsafe_code_stays_in_the_named_files", |path, line| {
        let may = UNSAFE_FILES.contains(&path) || path.starts_with(RULES);
        path.ends_with(".rs") && !may && line.contains("allow(unsafe_code")
    });
}

/// What no code of a core may do, and what it may not depend on, `.ci/core` refuses, for each core that `.ci/run` names.
#[test]
fn every_core_is_checked_by_itself_with_its_bans_forbidden() {
    let files = repository();
    let holds = |path: &str, words: &str| assert!(files[path].contains(words), "{path}: {words}");
    CORES
        .iter()
        .for_each(|name| holds(".ci/run", &format!("mmt-{name}")));
    holds(".ci/run", ".ci/core \"$core\"");
    let bans = "unsafe_code disallowed_methods unwrap_used -F tree tokio rapier2d-f64";
    bans.split(' ').for_each(|ban| holds(".ci/core", ban));
}

#[test]
fn the_licence_texts_are_whole() {
    let files = repository();
    assert!(files["LICENSE-MIT"].contains("Permission is hereby granted, free of charge"));
    assert!(files["LICENSE-APACHE"].contains("END OF TERMS AND CONDITIONS"));
}

#[test]
fn every_crate_takes_lints_and_versions_from_the_workspace() {
    let own = pattern(r#"(?m)^\S+ = ("[\^=]?\d|.*(version|git) =)"#);
    hold_files(
        "every_crate_takes_lints_and_versions_from_the_workspace",
        |path, text| {
            let inherits = text.contains("[lints]\nworkspace = true\n");
            // a package that is the root of a workspace of its own has its versions there
            let tables = text.split("\n[").map(|table| table.trim_start_matches('['));
            let mut of_package = tables.filter(|table| !table.starts_with("workspace"));
            let broken = !inherits || of_package.any(|table| own.is_match(table));
            path.ends_with("/clippy.toml") || path.ends_with("/Cargo.toml") && broken
        },
    );
}

/// Of the equations of the paper, 1 to 15, those that no comment line of a core starts with, above the tests of its file.
#[test]
fn every_equation_of_the_paper_is_cited_where_it_is_computed() {
    let core = pattern(&format!(r"^({})/.*\.rs$", CORES.join("|")));
    let (apart, number) = (
        pattern(r"[/.](io|tests|benches)[/.]"),
        pattern(r"\((\d+)\)"),
    );
    hold(
        "every_equation_of_the_paper_is_cited_where_it_is_computed",
        |files| {
            let pure = |path: &str| core.is_match(path) && !apart.is_match(path);
            let cores = files.iter().filter(|(path, _)| pure(path));
            let code = cores.filter_map(|(_, text)| text.split("#[cfg(test)]").next());
            let citing = code.flat_map(str::lines).map(str::trim);
            let citing: String = citing.filter(|line| line.starts_with("// (")).collect();
            let cited: Vec<&str> = number
                .find_iter(&citing)
                .map(|found| found.as_str())
                .collect();
            let all = (1..=15).map(|n| format!("({n})"));
            all.filter(|n| !cited.contains(&n.as_str())).collect()
        },
    );
}
