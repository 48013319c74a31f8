//! The invariants of the house, checked over the repository: what a core may name and depend on, which crate may
//! see which, where `unsafe` and the physics engine live.
//!
//! The rules and their planted violations are in `mmt_tests::architecture`.

use std::error::Error;

use mmt_tests::architecture::{
    File, Violation, attributes, documents, equations, files, layers, manifest, purity, repository,
    tree,
};

type Checked = Result<(), Box<dyn Error>>;

/// Fails with every violation on a line of its own.
fn none(found: &[Violation]) {
    let lines: Vec<_> = found.iter().map(ToString::to_string).collect();
    assert!(
        lines.is_empty(),
        "{} violations:\n{}",
        lines.len(),
        lines.join("\n")
    );
}

/// Runs one rule over every file of the repository.
fn every_file(rule: impl Fn(&File) -> Vec<Violation>) -> Checked {
    let files = repository::files()?;
    let rust = files.iter().filter(|file| file.is_rust()).count();
    assert!(
        rust >= 20,
        "only {rust} Rust files found: the walk misses the repository"
    );
    none(&files.iter().flat_map(rule).collect::<Vec<_>>());
    Ok(())
}

/// Runs one rule over one file, which must exist.
fn one_file(path: &str, rule: impl Fn(&File) -> Vec<Violation>) -> Checked {
    let files = repository::files()?;
    let file = files.iter().find(|file| file.path == path);
    none(&rule(file.ok_or_else(|| format!("{path} is missing"))?));
    Ok(())
}

#[test]
fn no_core_names_a_clock_a_thread_a_file_a_socket_or_global_randomness() -> Checked {
    every_file(purity::impure_names)
}

#[test]
fn only_shells_lift_the_bans_and_every_lifted_lint_gives_its_reason() -> Checked {
    every_file(attributes::lifted_lints)
}

#[test]
fn unsafe_stands_only_in_the_named_files_and_is_explained() -> Checked {
    every_file(attributes::stray_unsafe)
}

#[test]
fn only_the_environment_names_the_physics_engine() -> Checked {
    every_file(purity::stray_engine)
}

#[test]
fn crates_see_only_the_layers_below_them() -> Checked {
    every_file(layers::stray_arrows)
}

#[test]
fn every_crate_takes_lints_keys_and_versions_from_the_workspace() -> Checked {
    every_file(manifest::not_inherited)
}

#[test]
fn the_workspace_denies_the_lints_and_bans_the_calls() -> Checked {
    one_file("Cargo.toml", manifest::missing_lints)?;
    one_file("clippy.toml", manifest::missing_bans)?;
    every_file(manifest::shadowing_configuration)
}

#[test]
fn every_source_file_opens_with_what_it_is() -> Checked {
    every_file(files::without_opening)
}

#[test]
fn nothing_is_left_unfinished_or_ignored() -> Checked {
    every_file(files::unfinished)
}

#[test]
fn no_file_names_a_directory_of_one_machine() -> Checked {
    every_file(files::machine_paths)
}

#[test]
fn the_checks_end_with_the_test_command_that_the_documents_name() -> Checked {
    one_file(".ci/run", files::test_command_not_last)?;
    one_file("CONTRIBUTING.md", files::test_command_missing)?;
    every_file(files::test_command_missing)
}

#[test]
fn documents_name_only_files_that_exist() -> Checked {
    let files = repository::files()?;
    let dead = |file| documents::dead_references(file, &files);
    none(&files.iter().flat_map(dead).collect::<Vec<_>>());
    Ok(())
}

#[test]
fn every_equation_of_the_paper_is_cited_where_it_is_computed() -> Checked {
    none(&equations::uncited(&repository::files()?));
    Ok(())
}

#[test]
fn the_licence_texts_are_whole() -> Checked {
    let files = repository::files()?;
    let holds = |path, words: &str| {
        files
            .iter()
            .any(|file| file.path == path && file.text.contains(words))
    };
    assert!(holds(
        "LICENSE-MIT",
        "Permission is hereby granted, free of charge"
    ));
    assert!(holds("LICENSE-APACHE", "END OF TERMS AND CONDITIONS"));
    Ok(())
}

#[test]
fn the_tree_of_a_core_holds_no_runtime_no_socket_and_no_system_randomness() -> Checked {
    let options = ["--no-default-features", "-e", "normal"];
    for (core, also) in tree::CORES {
        none(&tree::forbidden_crates(
            core,
            also,
            &repository::tree(core, &options)?,
        ));
    }
    Ok(())
}

#[test]
fn server_and_client_stay_apart_with_their_shells_too() -> Checked {
    for (side, other) in [("mmt-server", "mmt-client"), ("mmt-client", "mmt-server")] {
        none(&tree::peers(
            side,
            other,
            &repository::tree(side, &["--all-features"])?,
        ));
    }
    Ok(())
}
