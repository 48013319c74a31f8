//! What the source of a pure core may not name.
//!
//! clippy bans the calls (`clippy.toml`); these names catch what it cannot see from there: types, macros, whole
//! crates, mutable statics.

use super::code::Code;
use super::{File, Violation};

/// Names and why a core has no use for them.
const IMPURE: [(&[&str], &str); 7] = [
    (
        &["Instant", "SystemTime"],
        "a core takes the time as an argument",
    ),
    (
        &[
            "thread::",
            "thread_local",
            "Mutex",
            "RwLock",
            "Condvar",
            "Atomic*",
            "OnceLock",
            "LazyLock",
            "static mut",
        ],
        "a core has no threads and no shared state",
    ),
    (
        &[
            "fs::",
            "env::",
            "process::",
            "stdin",
            "stdout",
            "stderr",
            "print!",
            "println!",
            "eprint!",
            "eprintln!",
            "dbg!",
        ],
        "a core opens no file, reads no environment, prints nothing",
    ),
    (
        &["UdpSocket", "TcpStream", "TcpListener"],
        "a core opens no socket",
    ),
    (
        &[
            "tokio",
            "mio",
            "quinn*",
            "rustls*",
            "ring::",
            "socket2",
            "rustix",
            "libc",
            "tracing",
            "hdrhistogram",
            "rtrb",
            "triple_buffer",
        ],
        "a crate for shells: keep it under `io`",
    ),
    (
        &["HashMap", "HashSet", "RandomState", "DefaultHasher"],
        "iteration order is random: use BTreeMap or BTreeSet",
    ),
    (
        &[
            "rand",
            "getrandom",
            "thread_rng",
            "OsRng",
            "from_entropy",
            "from_os_rng",
            "mul_add",
        ],
        "randomness is seeded (`rng::Substream`), and bits agree across machines",
    ),
];

/// The names of the physics engine and its maths, which one directory keeps to itself.
const ENGINE: [&str; 3] = ["rapier*", "parry*", "glam*"];

/// The one place that names the physics engine.
const ENGINE_HOME: &str = "server/src/environment";

/// What the source of a core names although a core has no use for it.
pub fn impure_names(file: &File) -> Vec<Violation> {
    if !file.is_core() {
        return Vec::new();
    }
    let code = Code::of(&file.text).without_tests();
    let lines = |name: &str| code.lines_naming(name);
    let named = IMPURE
        .iter()
        .flat_map(|(names, why)| names.iter().map(move |name| (name, why)));
    let found =
        named.flat_map(|(name, why)| lines(name).into_iter().map(move |line| (line, name, why)));
    found
        .map(|(line, name, why)| Violation::at(file, line, format!("`{name}`: {why}")))
        .collect()
}

/// The physics engine named outside its home.
pub fn stray_engine(file: &File) -> Vec<Violation> {
    let at_home = file
        .path
        .strip_prefix(ENGINE_HOME)
        .is_some_and(|rest| rest.starts_with(['/', '.']));
    if at_home || !file.is_rust() {
        return Vec::new();
    }
    let code = Code::of(&file.text);
    let lines = ENGINE.iter().flat_map(|name| {
        code.lines_naming(name)
            .into_iter()
            .map(move |line| (line, name))
    });
    let what = |name| format!("`{name}` may be named in {ENGINE_HOME} only");
    lines
        .map(|(line, name)| Violation::at(file, line, what(name)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_a_thread_a_file_or_a_socket_in_a_core_is_caught() {
        for planted in [
            "let t = std::time::Instant::now();",
            "use std::{fs, thread::spawn};\nfn f() {}",
            "use std::{collections::HashMap};",
            "let s = fs::read_to_string(path);",
            "std::env::var(name);",
            "println!();",
            "static mut COUNT: u32 = 0;",
            "static COUNT: AtomicU64 = AtomicU64::new(0);",
            "use tokio::time;",
            "let u = rand::random::<f64>();",
            "a.mul_add(b, c)",
        ] {
            assert_ne!(
                impure_names(&File::new("shared/src/model.rs", planted)),
                [],
                "{planted}"
            );
            assert_eq!(
                impure_names(&File::new("shared/src/io/model.rs", planted)),
                [],
                "{planted}"
            );
        }
    }

    #[test]
    fn a_pure_core_that_talks_about_clocks_is_left_alone() {
        let text = "//! never calls Instant::now or tokio\n/// `HashMap`\nfn f(now: Time) -> Time { now + \"Mutex\" }\n\
                    #[cfg(test)]\nmod tests { fn g() { println!() } }";
        assert_eq!(impure_names(&File::new("shared/src/model.rs", text)), []);
    }

    #[test]
    fn the_engine_named_outside_its_home_is_caught() {
        let text = "use rapier2d_f64::prelude::*;\nuse glam::DVec2;";
        assert_eq!(
            stray_engine(&File::new("server/src/slave.rs", text)).len(),
            2
        );
        assert_eq!(
            stray_engine(&File::new("server/src/environment_of_mine.rs", text)).len(),
            2
        );
        assert_eq!(stray_engine(&File::new("server/tests/a.rs", text)).len(), 2);
        assert_eq!(
            stray_engine(&File::new("server/src/environment/body.rs", text)),
            []
        );
        assert_eq!(
            stray_engine(&File::new("server/src/slave.rs", "// glam")),
            []
        );
    }
}
