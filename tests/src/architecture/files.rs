//! What every file of the repository must or must not hold.

use super::code::Code;
use super::{File, Violation};

/// The test command that the documents name and the checks end with.
pub const TEST_COMMAND: &str = "cargo test --workspace";

/// Code that says that it is not done.
const UNFINISHED: [&str; 3] = ["todo!", "unimplemented!", "dbg!"];

/// Words of a comment that says the same; in two halves so that this file does not say them.
const UNFINISHED_WORDS: [(&str, &str); 3] = [("TO", "DO"), ("FIX", "ME"), ("XX", "X")];

/// Directories of one machine; in two halves so that this file does not name them.
const MACHINE_PATHS: [(&str, &str); 4] = [
    ("/wo", "rk/"),
    ("/ro", "ot/"),
    ("/ho", "me/"),
    ("/Us", "ers/"),
];

/// A file that does not open with what it is.
pub fn without_opening(file: &File) -> Vec<Violation> {
    let opens = file.text.starts_with("//! ");
    let what = "open with `//!`: what the file is, and what it must never do";
    if file.is_rust() && !opens {
        vec![Violation::at(file, 1, what)]
    } else {
        Vec::new()
    }
}

/// Code that is not done and tests that do not run.
pub fn unfinished(file: &File) -> Vec<Violation> {
    if !file.is_rust() {
        return Vec::new();
    }
    let code = Code::of(&file.text);
    let macros = UNFINISHED.iter().flat_map(|name| {
        code.lines_naming(name)
            .into_iter()
            .map(move |line| (line, *name))
    });
    let ignored = code
        .attributes()
        .into_iter()
        .filter(|(_, text)| text.contains("ignore"));
    let lines = file
        .text
        .lines()
        .enumerate()
        .map(|(at, line)| (at + 1, line));
    let words = lines
        .filter(|(_, line)| says_unfinished(line))
        .map(|(line, _)| (line, "a comment that says so"));
    let places = macros
        .chain(ignored.map(|(line, _)| (line, "#[ignore]")))
        .chain(words);
    places
        .map(|(line, name)| {
            Violation::at(
                file,
                line,
                format!("unfinished ({name}): finish it or leave it out"),
            )
        })
        .collect()
}

/// Whether a line holds a word for work left over.
fn says_unfinished(line: &str) -> bool {
    let mut words = line.split(|c: char| !c.is_alphanumeric());
    words.any(|word| {
        UNFINISHED_WORDS
            .iter()
            .any(|(head, tail)| word.strip_prefix(head) == Some(tail))
    })
}

/// An absolute path into the directories of one machine.
pub fn machine_paths(file: &File) -> Vec<Violation> {
    let lines = file
        .text
        .lines()
        .enumerate()
        .map(|(at, line)| (at + 1, line));
    let named = |line: &str| {
        MACHINE_PATHS
            .iter()
            .any(|(head, tail)| names_path(line, &[*head, *tail].concat()))
    };
    let what = "names a directory of one machine";
    lines
        .filter(|(_, line)| named(line))
        .map(|(line, _)| Violation::at(file, line, what))
        .collect()
}

/// Whether a line holds a path from the root of the file system, not one inside another path or address.
fn names_path(line: &str, path: &str) -> bool {
    line.match_indices(path).any(|(at, _)| {
        let before = line.get(..at).and_then(|head| head.chars().next_back());
        !before.is_some_and(|c| {
            c.is_alphanumeric() || matches!(c, '.' | '_' | '-' | '}' | ')' | '~' | '*')
        })
    })
}

/// A document that tells how to test and does not name the command.
pub fn test_command_missing(document: &File) -> Vec<Violation> {
    let tells = matches!(document.path.as_str(), "README.md" | "CONTRIBUTING.md");
    let names = document.text.contains(TEST_COMMAND);
    let what = format!("name the test command `{TEST_COMMAND}`");
    if tells && !names {
        vec![Violation::new(&document.path, what)]
    } else {
        Vec::new()
    }
}

/// Checks that do not end with the test command, so that its last lines are theirs.
pub fn test_command_not_last(script: &File) -> Vec<Violation> {
    let last = script
        .text
        .lines()
        .map(str::trim)
        .rfind(|line| !line.is_empty() && !line.starts_with('#'));
    let ends = last.is_some_and(|line| line.ends_with(TEST_COMMAND));
    let what = format!("the last line must be `{TEST_COMMAND}`");
    if ends {
        Vec::new()
    } else {
        vec![Violation::new(&script.path, what)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_does_not_say_what_it_is_is_caught() {
        assert_eq!(
            without_opening(&File::new("a/src/b.rs", "use std::fmt;\n//! late")).len(),
            1
        );
        assert_eq!(
            without_opening(&File::new("a/src/b.rs", "//! What it is.\n")),
            []
        );
        assert_eq!(without_opening(&File::new("a/b.md", "# Title")), []);
    }

    #[test]
    fn work_left_over_is_caught_and_words_about_it_are_not() {
        let word = ["// TO", "DO: later"].concat();
        for planted in [
            "fn f() { todo!() }",
            "unimplemented!(\"x\")",
            "#[test]\n#[ignore = \"slow\"]\nfn f() {}",
            &word,
        ] {
            assert_eq!(
                unfinished(&File::new("a/src/b.rs", planted)).len(),
                1,
                "{planted}"
            );
        }
        assert_eq!(
            unfinished(&File::new(
                "a/src/b.rs",
                "// never write todo!()\nlet s = \"#[ignore]\";"
            )),
            []
        );
    }

    #[test]
    fn a_path_of_one_machine_is_caught_in_any_file() {
        for (head, tail) in MACHINE_PATHS {
            let planted = format!("first\nsee {head}{tail}x/y");
            let found = machine_paths(&File::new("docs/a.md", &planted));
            assert!(
                matches!(&found[..], [one] if one.place == "docs/a.md:2"),
                "{planted}"
            );
            let inner = format!("https://example.org{head}{tail}x and ./a{head}{tail}b");
            assert_eq!(
                machine_paths(&File::new("docs/a.md", &inner)),
                [],
                "{inner}"
            );
        }
    }

    #[test]
    fn checks_that_do_not_end_with_the_test_command_are_caught() {
        let script = |text: &str| test_command_not_last(&File::new(".ci/run", text)).len();
        assert_eq!(script("cargo fmt\nexec cargo test --workspace\n# end\n"), 0);
        assert_eq!(script("cargo test --workspace\necho done\n"), 1);
        assert_eq!(script("cargo test --workspace || true\n"), 1);
        assert_eq!(
            test_command_missing(&File::new("README.md", "run the tests")).len(),
            1
        );
        assert_eq!(
            test_command_missing(&File::new("README.md", "`cargo test --workspace`")),
            []
        );
        assert_eq!(test_command_missing(&File::new("docs/a.md", "")), []);
    }
}
