//! What may stand in the dependency tree of a crate built without `io`.
//!
//! Input is the text of `cargo tree -p CRATE --no-default-features -e normal`: features unify across a
//! workspace, so each crate is asked by itself.

use super::Violation;

/// Crates that read clocks, open sockets, threads or terminals, log, or draw randomness from the system.
const SHELL_CRATES: [&str; 30] = [
    "async-std",
    "chrono",
    "clap",
    "crossterm",
    "fastrand",
    "futures-util",
    "getrandom",
    "hdrhistogram",
    "indicatif",
    "mio",
    "nix",
    "parking_lot",
    "quinn",
    "quinn-proto",
    "quinn-udp",
    "rand",
    "ratatui",
    "rcgen",
    "ring",
    "rtrb",
    "rustix",
    "rustls",
    "signal-hook",
    "smol",
    "socket2",
    "time",
    "tokio",
    "tracing",
    "tracing-subscriber",
    "triple_buffer",
];

/// A pure crate and what its tree may not hold beyond `SHELL_CRATES`.
pub const CORES: [(&str, &[&str]); 5] = [
    (
        "mmt-shared",
        &[
            "libc",
            "rapier*",
            "parry*",
            "glam*",
            "mmt-netem",
            "mmt-server",
            "mmt-client",
            "mmt-lab",
        ],
    ),
    (
        "mmt-netem",
        &[
            "libc",
            "rapier*",
            "parry*",
            "glam*",
            "mmt-server",
            "mmt-client",
            "mmt-lab",
        ],
    ),
    ("mmt-server", &["libc", "mmt-client", "mmt-lab"]),
    (
        "mmt-client",
        &[
            "libc",
            "rapier*",
            "parry*",
            "glam*",
            "mmt-server",
            "mmt-lab",
        ],
    ),
    // its hash asks the processor for its features, through libc on some machines
    ("mmt-lab", &["mmt-cli"]),
];

/// Whether a crate's name fits a pattern, which may end in `*`.
fn fits(name: &str, pattern: &str) -> bool {
    pattern
        .strip_suffix('*')
        .map_or(name == pattern, |stem| name.starts_with(stem))
}

/// The names of the crates in a tree, in its order.
fn names(tree: &str) -> impl Iterator<Item = &str> {
    tree.lines().filter_map(|line| {
        line.trim_start_matches(|c: char| !c.is_alphanumeric())
            .split_whitespace()
            .next()
    })
}

/// The crates in the tree of `core` that a pure core may not hold.
pub fn forbidden_crates(core: &str, also: &[&str], tree: &str) -> Vec<Violation> {
    let patterns: Vec<_> = SHELL_CRATES.iter().chain(also).copied().collect();
    crates_fitting(core, &patterns, tree)
}

/// The other side in the tree of `side`, whatever its features.
pub fn peers(side: &str, other: &str, tree: &str) -> Vec<Violation> {
    crates_fitting(side, &[other], tree)
}

/// The crates in a tree that fit a pattern; a tree that does not even hold its own crate is no tree.
fn crates_fitting(root: &str, patterns: &[&str], tree: &str) -> Vec<Violation> {
    if !names(tree).any(|name| name == root) {
        return vec![Violation::new(
            root,
            "its dependency tree could not be read",
        )];
    }
    let fitting = names(tree).filter(|name| patterns.iter().any(|pattern| fits(name, pattern)));
    let what = |name| format!("`{name}` may not stand in this dependency tree");
    fitting
        .map(|name| Violation::new(root, what(name)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TREE: &str = "mmt-client v0.1.0 (/x/client)\n├── libm v0.2.16\n├── mmt-shared v0.1.0 (/x/shared)\n│   └── \
                        nalgebra v0.35.0\n│       └── simba v0.10.2\n└── thiserror v2.0.21\n";

    /// What the rule finds in a tree with one more line.
    fn found_with(line: &str) -> usize {
        let (_, also) = CORES
            .iter()
            .find(|(name, _)| *name == "mmt-client")
            .unwrap();
        forbidden_crates("mmt-client", also, &format!("{TREE}{line}\n")).len()
    }

    #[test]
    fn a_pure_tree_passes() {
        assert_eq!(found_with(""), 0);
    }

    #[test]
    fn a_planted_runtime_engine_or_peer_is_caught() {
        for planted in [
            "tokio v1.54.1",
            "libc v0.2",
            "getrandom v0.4.3",
            "rapier2d-f64 v0.36.1",
            "glamx v0.3.1",
            "mmt-server v0.1.0",
        ] {
            assert_eq!(found_with(&format!("│   └── {planted}")), 1, "{planted}");
        }
        assert_eq!(found_with("tokio-like v1.0.0"), 0);
    }

    #[test]
    fn an_empty_tree_is_no_pure_tree() {
        assert_eq!(forbidden_crates("mmt-client", &[], "").len(), 1);
        assert_eq!(peers("mmt-client", "mmt-server", "").len(), 1);
        assert_eq!(
            forbidden_crates("mmt-client", &[], "error: no such package").len(),
            1
        );
    }
}
