//! That a core built without `io` depends on nothing that reads clocks, opens sockets or draws randomness, and that the
//! two sides stay apart.
//!
//! `deny.toml` names who may depend on whom. Here each crate is asked by itself, because features unify in a workspace.

use super::output_of;

/// Crates that read clocks, open sockets, threads or terminals, log, or draw randomness from the system.
const SHELLS: &str = "async-std chrono clap crossterm fastrand futures-util getrandom hdrhistogram \
    indicatif mio nix parking_lot quinn quinn-proto quinn-udp rand ratatui rcgen ring rtrb rustix \
    rustls signal-hook socket2 time tokio tracing tracing-subscriber triple_buffer";
/// The physics engine and its maths, and the C library.
const ENGINE: &str = "rapier2d-f64 parry2d-f64 glam glamx libc";

/// The crates of a tree that it may not hold; a tree that does not even hold its own crate is none.
fn forbidden<'a>(root: &str, tree: &'a str, also: &str) -> Vec<&'a str> {
    let name = |line: &'a str| line.split(' ').next().unwrap_or_default();
    let names: Vec<&str> = tree.lines().map(name).collect();
    assert!(
        names.contains(&root),
        "no dependency tree of {root}: {tree}"
    );
    let banned = |name: &&str| {
        [SHELLS, also]
            .iter()
            .any(|list| list.split(' ').any(|one| one == *name))
    };
    names.into_iter().filter(banned).collect()
}

fn tree(package: &str, options: &[&str]) -> String {
    let cargo = std::env::var("CARGO").unwrap();
    let base = [
        "tree",
        "--offline",
        "--locked",
        "--prefix",
        "none",
        "-p",
        package,
    ];
    output_of(&cargo, &[&base, options].concat())
}

#[test]
fn the_tree_of_a_core_holds_no_runtime_no_socket_and_no_system_randomness() {
    let pure = "mmt-client v0.1.0\nlibm v0.2.16\ntokio-like v1.0.0\n";
    assert!(forbidden("mmt-client", pure, ENGINE).is_empty());
    for planted in [
        "tokio v1",
        "libc v0.2",
        "getrandom v0.4",
        "rapier2d-f64 v0.36",
        "glamx v0.3",
    ] {
        let tree = format!("{pure}{planted}\n");
        assert_eq!(forbidden("mmt-client", &tree, ENGINE).len(), 1, "{planted}");
    }
    // the hash of the laboratory asks the processor for its features through libc
    for (core, also) in [
        ("mmt-shared", ENGINE),
        ("mmt-netem", ENGINE),
        ("mmt-client", ENGINE),
        ("mmt-server", "libc"),
        ("mmt-lab", ""),
    ] {
        let tree = tree(core, &["--no-default-features", "-e", "normal"]);
        assert_eq!(forbidden(core, &tree, also), [""; 0], "{core}");
    }
}

#[test]
fn server_and_client_stay_apart_with_their_shells_and_tests_too() {
    let planted = "mmt-server v0.1.0\nmmt-client v0.1.0\n";
    assert_eq!(forbidden("mmt-server", planted, "mmt-client").len(), 1);
    for (side, other) in [("mmt-server", "mmt-client"), ("mmt-client", "mmt-server")] {
        let tree = tree(side, &["--all-features"]);
        assert!(!forbidden(side, &tree, other).contains(&other), "{tree}");
    }
}
