//! What the manifests and the linter's configuration must say.
//!
//! The rules read lines, not TOML: a dependency is written on one line, so that a table of another shape is a
//! violation too.

use super::{File, Violation};

/// Keys of a package that every crate takes from the workspace.
const SHARED_KEYS: [&str; 5] = ["version", "edition", "rust-version", "license", "publish"];

/// Lints that the workspace denies.
const DENIED_LINTS: [&str; 9] = [
    "missing_docs",
    "unsafe_code",
    "disallowed_methods",
    "disallowed_types",
    "expect_used",
    "indexing_slicing",
    "panic",
    "unwrap_used",
    "todo",
];

/// Calls and types that the linter must ban; `clippy.toml` bans more.
const BANNED: [&str; 22] = [
    "std::time::Instant::now",
    "std::time::Instant::elapsed",
    "std::time::SystemTime::now",
    "std::thread::spawn",
    "std::thread::scope",
    "std::thread::sleep",
    "std::thread::Builder::spawn",
    "std::fs::read",
    "std::fs::write",
    "std::fs::read_to_string",
    "std::fs::File::open",
    "std::fs::File::create",
    "std::fs::OpenOptions::open",
    "std::net::UdpSocket::bind",
    "std::net::TcpStream::connect",
    "std::net::TcpListener::bind",
    "std::env::var",
    "std::process::Command::new",
    "f64::sin",
    "f64::mul_add",
    "std::collections::HashMap",
    "std::collections::HashSet",
];

/// The lines of a TOML text with number, the section they stand in, and comments cut off.
fn lines(text: &str) -> impl Iterator<Item = (usize, &str, &str)> {
    let mut section = "";
    let numbered = text
        .lines()
        .enumerate()
        .map(|(at, line)| (at + 1, line.split('#').next().unwrap_or_default().trim()));
    numbered
        .filter(|(_, line)| !line.is_empty())
        .map(move |(at, line)| {
            if line.starts_with('[') && line.ends_with(']') {
                section = line;
            }
            (at, section, line)
        })
}

/// Whether a section holds dependencies.
fn lists_dependencies(section: &str) -> bool {
    section.contains("dependencies")
}

/// A crate that does not take lints, package keys and versions from the workspace.
pub fn not_inherited(file: &File) -> Vec<Violation> {
    let Some((_, "Cargo.toml")) = file.path.split_once('/') else {
        return Vec::new();
    };
    let has =
        |section: &str, line: &str| lines(&file.text).any(|(_, s, l)| s == section && l == line);
    let mut found = Vec::new();
    if !has("[lints]", "workspace = true") {
        found.push(Violation::new(
            &file.path,
            "say `[lints]` and `workspace = true`",
        ));
    }
    for key in SHARED_KEYS
        .iter()
        .filter(|key| !has("[package]", &format!("{key}.workspace = true")))
    {
        found.push(Violation::new(
            &file.path,
            format!("say `{key}.workspace = true`"),
        ));
    }
    let own = |(_, section, line): &(usize, &str, &str)| {
        lists_dependencies(section) && line != section && !inherits(line)
            || line == section && lists_dependencies(line) && !line.ends_with("dependencies]")
    };
    let say = |(at, _, line)| {
        Violation::at(
            file,
            at,
            format!(
                "`{line}`: write `NAME.workspace = true`, or `NAME = {{ workspace = true, … }}`"
            ),
        )
    };
    found.extend(lines(&file.text).filter(own).map(say));
    found
}

/// Whether a dependency's line takes its version from the workspace, or is a path without one.
fn inherits(line: &str) -> bool {
    let Some((name, value)) = line.split_once('=') else {
        return false;
    };
    let value = value.replace(' ', "");
    let bare = name.trim().ends_with(".workspace") && value == "true";
    bare || value.starts_with('{')
        && value.ends_with('}')
        && !value.contains("version=")
        && (value.contains("workspace=true") || value.contains("path="))
}

/// A lint that the workspace should deny and does not.
pub fn missing_lints(workspace: &File) -> Vec<Violation> {
    let denies = |lint: &str| {
        let levels = [format!("{lint} = \"deny\""), format!("{lint} = \"forbid\"")];
        lines(&workspace.text).any(|(_, section, line)| {
            section.starts_with("[workspace.lints.") && levels.iter().any(|level| line == level)
        })
    };
    let missing = DENIED_LINTS.iter().filter(|lint| !denies(lint));
    missing
        .map(|lint| Violation::new(&workspace.path, format!("deny the lint `{lint}`")))
        .collect()
}

/// A call or type that the linter should ban and does not.
pub fn missing_bans(clippy: &File) -> Vec<Violation> {
    let bans = |path: &str| {
        lines(&clippy.text).any(|(_, _, line)| line.contains(&format!("path = \"{path}\"")))
    };
    let missing = BANNED.iter().filter(|path| !bans(path));
    missing
        .map(|path| Violation::new(&clippy.path, format!("ban `{path}`")))
        .collect()
}

/// A linter configuration inside a crate, which would replace the one of the workspace.
pub fn shadowing_configuration(file: &File) -> Vec<Violation> {
    let name = file.path.rsplit('/').next().unwrap_or_default();
    let shadows = file.path != "clippy.toml" && matches!(name, "clippy.toml" | ".clippy.toml");
    let what = "only the workspace's clippy.toml may configure the linter";
    if shadows {
        vec![Violation::new(&file.path, what)]
    } else {
        Vec::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = "[package]\nname = \"mmt-x\"\nversion.workspace = true\nedition.workspace = true\n\
                        rust-version.workspace = true\nlicense.workspace = true\npublish.workspace = true\n\
                        [lints]\nworkspace = true\n[dependencies]\n# pure\nlibm.workspace = true\n\
                        serde = { workspace = true, optional = true }\nmmt-cli = { path = \"../cli\" }\n";

    /// What the rule finds in a manifest.
    fn found(text: &str) -> usize {
        not_inherited(&File::new("x/Cargo.toml", text)).len()
    }

    #[test]
    fn a_manifest_that_inherits_everything_passes() {
        assert_eq!(not_inherited(&File::new("x/Cargo.toml", GOOD)), []);
    }

    #[test]
    fn a_version_of_its_own_is_caught_in_every_shape() {
        for planted in [
            "rand = \"0.10\"",
            "rand = { version = \"0.10\", features = [\"std\"] }",
            "rand = { workspace = true, version = \"0.10\" }",
            "rand = { git = \"https://example.org/rand\" }",
        ] {
            assert_eq!(found(&format!("{GOOD}{planted}\n")), 1, "{planted}");
        }
        assert_eq!(
            found(&format!(
                "{GOOD}[target.'cfg(unix)'.dependencies]\nlibc = \"0.2\"\n"
            )),
            1
        );
        assert_ne!(
            found(&format!("{GOOD}[dependencies.libc]\nversion = \"0.2\"\n")),
            0
        );
    }

    #[test]
    fn a_crate_without_the_lints_or_the_edition_of_the_workspace_is_caught() {
        assert_eq!(found(&GOOD.replace("[lints]\nworkspace = true\n", "")), 1);
        assert_eq!(found(&GOOD.replace("[lints]", "# [lints]")), 1);
        assert_eq!(
            found(&GOOD.replace("edition.workspace = true", "edition = \"2021\"")),
            1
        );
    }

    #[test]
    fn a_lint_or_ban_taken_out_is_caught() {
        let all = DENIED_LINTS
            .map(|lint| format!("{lint} = \"deny\""))
            .join("\n");
        let workspace = |text: &str| {
            missing_lints(&File::new(
                "Cargo.toml",
                &format!("[workspace.lints.rust]\n{text}"),
            ))
            .len()
        };
        assert_eq!(workspace(&all), 0);
        assert_eq!(
            workspace(&all.replace("unsafe_code = \"deny\"", "unsafe_code = \"warn\"")),
            1
        );
        let all = BANNED
            .map(|path| format!("  {{ path = \"{path}\", reason = \"x\" }},"))
            .join("\n");
        let clippy = |text: &str| missing_bans(&File::new("clippy.toml", text)).len();
        assert_eq!(clippy(&all), 0);
        assert_eq!(
            clippy(&all.replace(
                "  { path = \"std::time::Instant::now\"",
                "  # { path = \"std::time::Instant::now\""
            )),
            1
        );
    }

    #[test]
    fn a_second_linter_configuration_is_caught() {
        assert_eq!(shadowing_configuration(&File::new("clippy.toml", "")), []);
        assert_eq!(
            shadowing_configuration(&File::new("server/clippy.toml", "")).len(),
            1
        );
        assert_eq!(
            shadowing_configuration(&File::new(".clippy.toml", "")).len(),
            1
        );
    }
}
