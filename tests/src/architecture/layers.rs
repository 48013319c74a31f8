//! Which crate may see which: shared <- netem <- {server, client} <- lab <- cli, and tests sees all.

use super::code::Code;
use super::{File, Violation};

/// Each crate's directory with the directories of the crates it may see.
const LAYERS: [(&str, &[&str]); 7] = [
    ("shared", &[]),
    ("netem", &["shared"]),
    ("server", &["shared", "netem"]),
    ("client", &["shared", "netem"]),
    ("lab", &["shared", "netem", "server", "client"]),
    ("cli", &["shared", "netem", "server", "client", "lab"]),
    (
        "tests",
        &["shared", "netem", "server", "client", "lab", "cli"],
    ),
];

/// A crate named in the source or manifest of one that may not see it, and a crate that has no layer.
pub fn stray_arrows(file: &File) -> Vec<Violation> {
    let Some((directory, inner)) = file.path.split_once('/') else {
        return Vec::new();
    };
    let layer = LAYERS.iter().find(|(name, _)| *name == directory);
    match layer {
        None if inner == "Cargo.toml" => {
            vec![Violation::new(
                &file.path,
                "this crate has no layer: say in `layers` what it may see",
            )]
        }
        Some((_, seen)) if file.is_rust() => {
            stray_names(file, directory, seen, &Code::of(&file.text), "mmt_")
        }
        Some((_, seen)) if inner == "Cargo.toml" => {
            // a manifest's keys read like code: its comments start with `#`, not `//`
            let lines = file
                .text
                .lines()
                .map(|line| line.split('#').next().unwrap_or_default());
            let text = lines.collect::<Vec<_>>().join("\n").replace("mmt-", "mmt_");
            stray_names(file, directory, seen, &Code::of(&text), "mmt_")
        }
        _ => Vec::new(),
    }
}

/// The names of unseen crates in one file of the crate `directory`.
fn stray_names(
    file: &File,
    directory: &str,
    seen: &[&str],
    code: &Code,
    prefix: &str,
) -> Vec<Violation> {
    let hidden = LAYERS
        .iter()
        .map(|(name, _)| *name)
        .filter(|name| *name != directory && !seen.contains(name));
    let lines = |name: &str| code.lines_naming(&format!("{prefix}{name}"));
    let found = hidden.flat_map(|name| lines(name).into_iter().map(move |line| (line, name)));
    found
        .map(|(line, name)| Violation::at(file, line, format!("{directory} may not see {name}")))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn server_and_client_naming_each_other_are_caught() {
        let cases = [
            ("server/src/slave.rs", "use mmt_client::Master;"),
            ("client/tests/a.rs", "use mmt_server::Slave;"),
            (
                "client/Cargo.toml",
                "[dev-dependencies]\nmmt-server.workspace = true\n",
            ),
            (
                "shared/Cargo.toml",
                "[features]\nio = [\"a\"]\n[dependencies]\nmmt-netem = { workspace = true }\n",
            ),
            ("lab/src/lib.rs", "use mmt_cli::run;"),
        ];
        for (path, text) in cases {
            assert_eq!(stray_arrows(&File::new(path, text)).len(), 1, "{path}");
        }
    }

    #[test]
    fn arrows_that_point_down_and_comments_are_left_alone() {
        let cases = [
            (
                "server/src/slave.rs",
                "use mmt_netem::Link; // like mmt_client",
            ),
            (
                "client/Cargo.toml",
                "# unlike mmt-server\nname = \"mmt-client\"\nmmt-netem.workspace = true\n",
            ),
            ("tests/tests/a.rs", "use {mmt_server, mmt_client, mmt_cli};"),
            ("Cargo.toml", "mmt-server = { path = \"server\" }"),
        ];
        for (path, text) in cases {
            assert_eq!(stray_arrows(&File::new(path, text)), [], "{path}");
        }
    }

    #[test]
    fn a_crate_without_a_layer_is_caught() {
        assert_eq!(
            stray_arrows(&File::new("gateway/Cargo.toml", "[package]")).len(),
            1
        );
    }
}
