//! The rules of the house that no lint can state, held over the files and the dependency trees of the repository.
//!
//! Lints, `clippy.toml` and `deny.toml` state the others; `.ci/planted` plants a violation of each of those. Here each
//! test first sees its rule catch planted violations and leave clean text alone, and then runs it over the repository.
#![allow(
    clippy::disallowed_methods,
    clippy::unwrap_used,
    reason = "a test reads the repository, asks git and cargo, and fails by panicking"
)]

use std::cell::Cell;
use std::path::{Path, PathBuf};
use std::process::Command;

mod circles;
mod documents;
mod trees;

/// The test command that the documents name and the checks end with.
const TEST_COMMAND: &str = "cargo test --workspace";
/// The paper numbers its equations from 1 to this.
const EQUATIONS: u8 = 15;
/// The crates with a pure core.
const CORES: [&str; 5] = ["shared", "netem", "server", "client", "lab"];
/// The files that may lift the ban on `unsafe`: calls of the operating system without a safe wrapper, and the counting
/// allocator of a test.
const UNSAFE_FILES: [&str; 3] = [
    "shared/src/io/realtime.rs",
    "cli/src/commands/netem/shell/tun.rs",
    "tests/tests/counting_allocator.rs",
];
/// The one place that names the physics engine.
const ENGINE_HOME: &str = "server/src/environment";
/// The files that hold forbidden words as words.
const RULES: &str = "tests/tests/architecture";

/// One file of the repository: its path from the root, and its text.
struct File {
    path: String,
    text: String,
}

impl File {
    fn new(path: &str, text: &str) -> Self {
        let (path, text) = (path.to_owned(), text.to_owned());
        Self { path, text }
    }

    fn is_rust(&self) -> bool {
        self.path.ends_with(".rs")
    }

    /// The numbers of the lines of a kind of file that break a rule; the first line is 1.
    fn lines_that(&self, kind: bool, breaks: impl Fn(&str) -> bool) -> Vec<usize> {
        let numbered = self.text.lines().zip(1..);
        let broken = numbered.filter(|(line, _)| kind && breaks(line));
        broken.map(|(_, number)| number).collect()
    }

    /// The first line, if the whole file breaks a rule.
    fn whole(&self, breaks: bool) -> Vec<usize> {
        breaks.then_some(1).into_iter().collect()
    }
}

/// The root of the repository.
fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().unwrap().to_owned()
}

/// What a command prints, started in the root of the repository.
fn output_of(program: &str, arguments: &[&str]) -> String {
    let mut command = Command::new(program);
    let output = command.args(arguments).current_dir(root()).output();
    let output = output.unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{program} {arguments:?}: {errors}");
    String::from_utf8(output.stdout).unwrap()
}

/// The paths that are under version control, or would be.
fn listing() -> String {
    let options = ["ls-files", "--cached", "--others", "--exclude-standard"];
    output_of("git", &options)
}

/// The text files of the repository.
fn repository() -> Vec<File> {
    let read = |path: &str| {
        let text = std::fs::read_to_string(root().join(path)).ok()?;
        Some(File::new(path, &text))
    };
    let files: Vec<File> = listing().lines().filter_map(read).collect();
    assert!(files.len() > 200, "the repository is not here");
    files
}

/// Sees the rule catch every planted file and leave every clean one alone, then holds the repository to it.
fn hold<'a>(
    rule: impl Fn(&File) -> Vec<usize>,
    planted: impl IntoIterator<Item = (&'a str, &'a str)>,
    clean: impl IntoIterator<Item = (&'a str, &'a str)>,
) {
    for (path, text) in planted {
        let caught = rule(&File::new(path, text));
        assert!(!caught.is_empty(), "not caught in {path}: {text}");
    }
    for (path, text) in clean {
        let caught = rule(&File::new(path, text));
        assert!(caught.is_empty(), "caught in {path}: {text}");
    }
    let place = |file: &File, line| format!("{}:{line}", file.path);
    let places = |file: &File| -> Vec<String> {
        let lines = rule(file).into_iter();
        lines.map(|line| place(file, line)).collect()
    };
    let broken: Vec<String> = repository().iter().flat_map(places).collect();
    assert!(broken.is_empty(), "{broken:#?}");
}

#[test]
fn every_source_file_opens_with_what_it_is() {
    hold(
        |file| file.whole(file.is_rust() && !file.text.starts_with("//! ")),
        [("a/src/b.rs", "use std::fmt;\n//! late")],
        [("a/src/b.rs", "//! What it is."), ("a/b.md", "# Title")],
    );
}

#[test]
fn nothing_is_left_unfinished_or_ignored() {
    // in two halves, so that this file does not hold them
    let words = [["TO", "DO"], ["FIX", "ME"], ["XX", "X"], ["#[ign", "ore"]];
    let words = words.map(|halves| halves.concat());
    let holds = |line: &str| words.iter().any(|word| line.contains(word));
    let planted = words.each_ref().map(|word| ("a/src/b.rs", word.as_str()));
    let clean = [("a/src/b.rs", "// ignore what is done to do")];
    hold(
        |file| file.lines_that(file.is_rust(), holds),
        planted,
        clean,
    );
}

#[test]
fn no_file_names_a_directory_of_one_machine() {
    // in two halves, so that this file does not name them
    let paths = [
        ["/wo", "rk/"],
        ["/ro", "ot/"],
        ["/ho", "me/"],
        ["/Us", "ers/"],
    ];
    let paths = paths.map(|halves| halves.concat());
    let inside = |c: char| c.is_alphanumeric() || "._-})~*".contains(c);
    let names = |line: &str, path: &str| {
        let heads = line.match_indices(path).map(|(at, _)| line.get(..at));
        let mut before = heads.map(|head| head?.chars().next_back());
        before.any(|before| !before.is_some_and(inside))
    };
    let any = |line: &str| paths.iter().any(|path| names(line, path));
    let planted = paths.clone().map(|path| format!("first\nsee {path}x/y"));
    let clean = paths
        .clone()
        .map(|path| format!("https://a.org{path}x ./a{path}b"));
    hold(
        |file| file.lines_that(true, any),
        planted.each_ref().map(|text| ("docs/a.md", text.as_str())),
        clean.each_ref().map(|text| ("docs/a.md", text.as_str())),
    );
}

#[test]
fn the_checks_end_with_the_test_command_that_the_documents_name() {
    let rule = |file: &File| {
        let code = |line: &&str| !line.is_empty() && !line.starts_with('#');
        let last = file.text.lines().rfind(code).unwrap_or_default();
        file.whole(match file.path.as_str() {
            ".ci/run" => !last.ends_with(TEST_COMMAND),
            "README.md" | "CONTRIBUTING.md" => !file.text.contains(TEST_COMMAND),
            _ => false,
        })
    };
    let planted = [
        (".ci/run", "cargo test --workspace\necho done\n"),
        (".ci/run", "cargo test --workspace || true\n"),
        ("README.md", "run the tests"),
    ];
    let clean = (".ci/run", "cargo fmt\nexec cargo test --workspace\n# end\n");
    hold(rule, planted, [clean, ("docs/a.md", "")]);
}

#[test]
fn only_the_environment_names_the_physics_engine() {
    let engine = ["rapier2d_f64", "parry2d", "glam::", "glamx"];
    let names = |line: &str| {
        let code = line.split("//").next().unwrap_or_default();
        engine.iter().any(|name| code.contains(name))
    };
    let at_home = |path: &str| {
        let rest = path.strip_prefix(ENGINE_HOME);
        rest.is_some_and(|rest| rest.starts_with(['/', '.']))
    };
    let judged =
        |file: &File| file.is_rust() && !at_home(&file.path) && !file.path.starts_with(RULES);
    let text = "use rapier2d_f64::prelude::*;\nuse glam::DVec2;";
    let elsewhere = [
        "server/src/slave.rs",
        "server/src/environment_b.rs",
        "server/tests/a.rs",
    ];
    hold(
        |file| file.lines_that(judged(file), names),
        elsewhere.map(|path| (path, text)),
        [
            ("server/src/environment/body.rs", text),
            ("server/src/slave.rs", "// glam::"),
        ],
    );
}

#[test]
fn unsafe_code_stays_in_the_named_files() {
    let may =
        |file: &File| UNSAFE_FILES.contains(&file.path.as_str()) || file.path.starts_with(RULES);
    let lifts = |line: &str| line.contains("allow(unsafe_code");
    let lift = "fn f() {\n    #[allow(unsafe_code, reason = \"fast\")]\n    unsafe { g() }\n}";
    hold(
        |file| file.lines_that(file.is_rust() && !may(file), lifts),
        [("client/src/io/loop.rs", lift)],
        [(UNSAFE_FILES[0], lift)],
    );
}

/// What no code of a core may do is forbidden by `.ci/core`, for each core that `.ci/run` names.
#[test]
fn every_core_is_checked_by_itself_with_its_bans_forbidden() {
    let read = |name: &str| std::fs::read_to_string(root().join(name)).unwrap();
    let (run, core) = (read(".ci/run"), read(".ci/core"));
    for name in CORES {
        assert!(run.contains(&format!("mmt-{name}")), "{name}");
    }
    assert!(run.contains(".ci/core \"$core\""));
    for ban in ["unsafe_code", "disallowed_methods", "unwrap_used", "-F"] {
        assert!(core.contains(ban), "{ban}");
    }
}

#[test]
fn every_crate_takes_lints_and_versions_from_the_workspace() {
    let own_version = |line: &str| {
        let (_, value) = line.split_once(" = ").unwrap_or_default();
        let bare = value.trim_start_matches(['"', '^', '=']);
        let bare = value.starts_with('"') && bare.starts_with(|c: char| c.is_ascii_digit());
        bare || value.contains("version =") || value.contains("git =")
    };
    let rule = |file: &File| {
        let member = file.path.ends_with("/Cargo.toml");
        // a package that is the root of a workspace of its own has its versions there
        let of_workspace = Cell::new(false);
        let mut broken = file.lines_that(member, |line| {
            if line.starts_with('[') {
                of_workspace.set(line.starts_with("[workspace"));
            }
            !of_workspace.get() && own_version(line)
        });
        let inherits = file.text.contains("[lints]\nworkspace = true\n");
        broken.extend(file.whole(member && !inherits || file.path.ends_with("/clippy.toml")));
        broken
    };
    let with = |line: &str| format!("[lints]\nworkspace = true\n[dependencies]\n{line}\n");
    let planted = [
        "rand = \"0.10\"",
        "rand = { version = \"1\" }",
        "rand = { git = \"x\" }",
    ];
    let planted = planted.map(with);
    let own = format!("[workspace]\n{}", planted[0]);
    let texts = planted.each_ref().map(String::as_str);
    let planted = texts
        .into_iter()
        .chain(["[package]\n", own.as_str()])
        .map(|text| ("x/Cargo.toml", text));
    let clean = with("libm.workspace = true\nmmt-cli = { path = \"../cli\" }");
    let own = format!("[workspace.dependencies]\nrand = \"0.10\"\n{clean}");
    let clean = [
        ("x/Cargo.toml", clean.as_str()),
        ("x/Cargo.toml", own.as_str()),
        ("clippy.toml", ""),
    ];
    hold(rule, planted.chain([("server/clippy.toml", "")]), clean);
}

/// The equations that no comment line of a core starts with, above the tests of its file.
fn uncited(files: &[File]) -> Vec<u8> {
    let core = |file: &&File| {
        let mut parts = file.path.split(['/', '.']);
        let pure = parts.next().is_some_and(|name| CORES.contains(&name)) && file.is_rust();
        pure && !parts.any(|part| ["io", "tests", "benches"].contains(&part))
    };
    let cores = files.iter().filter(core);
    let code = cores.filter_map(|file| file.text.split("#[cfg(test)]").next());
    let lines: Vec<&str> = code.flat_map(str::lines).map(str::trim).collect();
    let cites = |line: &&str, n: u8| line.starts_with("// (") && line.contains(&format!("({n})"));
    let cited = |n: &u8| lines.iter().any(|line| cites(line, *n));
    (1..=EQUATIONS).filter(|n| !cited(n)).collect()
}

#[test]
fn every_equation_of_the_paper_is_cited_where_it_is_computed() {
    let cited = |n: u8| File::new("shared/src/a.rs", &format!("    // ({n}), and why\n"));
    let doc = "//! Holds (7).\n/// (7)\n// as in (7)\n#[cfg(test)]\n    // (7)";
    let others = (1..=EQUATIONS).filter(|n| *n != 7).map(cited);
    let files: Vec<File> = others.chain([File::new("shared/src/b.rs", doc)]).collect();
    assert_eq!(uncited(&files), [7]);
    assert!(uncited(&repository()).is_empty());
}

#[test]
fn the_licence_texts_are_whole() {
    let read = |path| std::fs::read_to_string(root().join(path)).unwrap();
    assert!(read("LICENSE-MIT").contains("Permission is hereby granted, free of charge"));
    assert!(read("LICENSE-APACHE").contains("END OF TERMS AND CONDITIONS"));
}
