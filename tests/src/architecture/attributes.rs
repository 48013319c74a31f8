//! Which lints may be lifted where, and that every lifting gives its reason.
//!
//! A core has no way to opt out of the bans on clocks, sockets, threads, files and randomness; production code
//! has none to unwrap or panic; `unsafe` lives in named files only.

use super::code::Code;
use super::{File, Violation};

/// The files that may hold `unsafe`: calls of the operating system without a safe wrapper.
pub const UNSAFE_FILES: [&str; 1] = ["shared/src/io/realtime.rs"];

/// Lints that keep a core pure: liftable in shells and tests.
const PURITY_LINTS: [&str; 3] = [
    "disallowed_methods",
    "disallowed_types",
    "disallowed_macros",
];

/// Lints that keep production code from panicking: liftable in tests and benches.
const PANIC_LINTS: [&str; 5] = [
    "expect_used",
    "indexing_slicing",
    "panic",
    "unwrap_used",
    "missing_docs",
];

/// Whether the file may hold `unsafe`: the named ones, and the counting allocator of a test or bench.
fn may_be_unsafe(file: &File) -> bool {
    let name = file.path.rsplit('/').next().unwrap_or_default();
    UNSAFE_FILES.contains(&file.path.as_str()) || (file.is_test() && name.contains("alloc"))
}

/// The lints out of `lints` that an attribute names.
fn named<'a>(attribute: &str, lints: &[&'a str]) -> Vec<&'a str> {
    let words: Vec<_> = attribute
        .split(|c: char| !c.is_alphanumeric() && c != '_')
        .collect();
    lints
        .iter()
        .copied()
        .filter(|lint| words.contains(lint))
        .collect()
}

/// Lints lifted where they must hold, and lifted anywhere without a reason.
pub fn lifted_lints(file: &File) -> Vec<Violation> {
    if !file.is_rust() {
        return Vec::new();
    }
    let code = Code::of(&file.text);
    let production = code.without_tests();
    let mut found = Vec::new();
    for (line, attribute) in liftings(&code) {
        if !attribute.contains("reason") {
            found.push(Violation::at(
                file,
                line,
                "a lint is lifted without `reason = \"…\"`",
            ));
        }
        if !may_be_unsafe(file) && !named(attribute, &["unsafe_code"]).is_empty() {
            found.push(Violation::at(
                file,
                line,
                "only the named OS files may lift `unsafe_code`",
            ));
        }
    }
    for (line, attribute) in liftings(&production) {
        for lint in named(attribute, &PURITY_LINTS)
            .iter()
            .filter(|_| !file.is_shell())
        {
            found.push(Violation::at(
                file,
                line,
                format!("a core may not lift `{lint}`: move it to `io`"),
            ));
        }
        for lint in named(attribute, &PANIC_LINTS)
            .iter()
            .filter(|_| !file.is_test())
        {
            found.push(Violation::at(
                file,
                line,
                format!("only tests may lift `{lint}`"),
            ));
        }
    }
    found
}

/// The attributes that lift lints.
fn liftings(code: &Code) -> impl Iterator<Item = (usize, &str)> {
    let lifts = |attribute: &str| attribute.contains("allow(") || attribute.contains("expect(");
    code.attributes()
        .into_iter()
        .filter(move |(_, attribute)| lifts(attribute))
}

/// `unsafe` outside the named files, and within them without saying above why it is sound: in a `SAFETY:`
/// comment or in the reason of the lifted lint.
pub fn stray_unsafe(file: &File) -> Vec<Violation> {
    if !file.is_rust() {
        return Vec::new();
    }
    let lines: Vec<_> = file.text.lines().collect();
    let explained = |line: usize| {
        let above = lines.iter().take(line).rev().take(8);
        above
            .into_iter()
            .any(|text| text.contains("SAFETY:") || text.contains("reason ="))
    };
    let judge = |line: usize| {
        if !may_be_unsafe(file) {
            Some(Violation::at(
                file,
                line,
                "`unsafe` outside the named OS files",
            ))
        } else if !explained(line) {
            Some(Violation::at(
                file,
                line,
                "`unsafe` without saying above it why it is sound",
            ))
        } else {
            None
        }
    };
    Code::of(&file.text)
        .lines_naming("unsafe")
        .into_iter()
        .filter_map(judge)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIFT: &str = "#![allow(clippy::disallowed_methods, reason = \"a shell\")]";

    #[test]
    fn a_core_that_lifts_a_ban_is_caught_and_a_shell_is_not() {
        let found = lifted_lints(&File::new("shared/src/time.rs", LIFT));
        assert!(
            matches!(&found[..], [one] if one.to_string().contains("time.rs:1: a core may not lift"))
        );
        for shell in [
            "shared/src/io/clock.rs",
            "cli/src/main.rs",
            "lab/tests/a.rs",
            "lab/benches/b.rs",
        ] {
            assert_eq!(lifted_lints(&File::new(shell, LIFT)), []);
        }
        let in_tests = format!("fn a() {{}}\n#[cfg(test)]\nmod tests {{ {LIFT} }}");
        assert_eq!(
            lifted_lints(&File::new("shared/src/time.rs", &in_tests)),
            []
        );
    }

    #[test]
    fn a_lifting_on_several_lines_or_behind_cfg_attr_is_caught() {
        for text in [
            "#[allow(\n    clippy::disallowed_types,\n    reason = \"x\"\n)]\nfn f() {}",
            "#[cfg_attr(unix, expect(clippy::disallowed_types, reason = \"x\"))]\nfn f() {}",
        ] {
            assert_eq!(
                lifted_lints(&File::new("netem/src/link.rs", text)).len(),
                1,
                "{text}"
            );
        }
    }

    #[test]
    fn a_lifting_without_a_reason_is_caught_everywhere() {
        let bare = "#[allow(clippy::too_many_arguments)]\nfn f() {}";
        assert_eq!(lifted_lints(&File::new("cli/src/main.rs", bare)).len(), 1);
        assert_eq!(lifted_lints(&File::new("cli/tests/a.rs", bare)).len(), 1);
    }

    #[test]
    fn production_code_that_lifts_the_ban_on_panics_is_caught() {
        let text = "#[allow(clippy::unwrap_used, reason = \"cannot fail\")]\nfn f() {}";
        assert_eq!(lifted_lints(&File::new("cli/src/main.rs", text)).len(), 1);
        assert_eq!(lifted_lints(&File::new("cli/tests/a.rs", text)), []);
    }

    #[test]
    fn unsafe_outside_the_named_files_or_unexplained_is_caught() {
        let text = "// SAFETY: it is sound\nunsafe { f() }";
        assert_eq!(
            stray_unsafe(&File::new("client/src/io/loop.rs", text)).len(),
            1
        );
        assert_eq!(stray_unsafe(&File::new(UNSAFE_FILES[0], text)), []);
        assert_eq!(
            stray_unsafe(&File::new(UNSAFE_FILES[0], "unsafe { f() }")).len(),
            1
        );
        assert_eq!(
            stray_unsafe(&File::new("client/tests/counting_allocator.rs", text)),
            []
        );
        assert_eq!(
            stray_unsafe(&File::new("client/src/a.rs", "// unsafe\n")),
            []
        );
        let lift = "#![allow(unsafe_code, reason = \"fast\")]";
        assert_eq!(
            lifted_lints(&File::new("client/src/io/loop.rs", lift)).len(),
            1
        );
    }
}
