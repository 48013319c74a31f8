//! That each equation of the paper can be found where it is computed, by its number.

use super::{File, Violation};

/// The paper numbers its equations from 1 to this.
const EQUATIONS: u8 = 15;

/// The equations that no comment line above production code cites.
pub fn uncited(files: &[File]) -> Vec<Violation> {
    let sources = files.iter().filter(|file| file.is_core());
    let cited: Vec<_> = sources.flat_map(|file| citing_lines(&file.text)).collect();
    let missing =
        (1..=EQUATIONS).filter(|n| !cited.iter().any(|line| line.contains(&format!("({n})"))));
    let what =
        "not cited: write its number on a comment line of its own above the code that computes it";
    missing
        .map(|n| Violation::new(format!("equation ({n})"), what))
        .collect()
}

/// The plain comment lines above the test module that start with an equation's number.
fn citing_lines(text: &str) -> impl Iterator<Item = &str> {
    let production = text
        .lines()
        .map(str::trim)
        .take_while(|line| *line != "#[cfg(test)]");
    production
        .filter_map(|line| line.strip_prefix("// "))
        .filter(|comment| comment.starts_with('('))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two files that cite all equations but `left_out`.
    fn files(left_out: u8) -> Vec<File> {
        let lines = |range: std::ops::RangeInclusive<u8>| {
            let cited = range
                .filter(|n| *n != left_out)
                .map(|n| format!("    // ({n}), and why\n    f();\n"));
            cited.collect::<String>()
        };
        vec![
            File::new("shared/src/a.rs", &lines(1..=7)),
            File::new("server/src/b.rs", &lines(8..=EQUATIONS)),
        ]
    }

    #[test]
    fn an_equation_left_out_is_caught() {
        assert_eq!(uncited(&files(0)), []);
        let found = uncited(&files(7));
        assert!(matches!(&found[..], [one] if one.place == "equation (7)"));
    }

    #[test]
    fn a_mention_in_a_doc_or_a_test_is_no_citation() {
        for text in [
            "//! Holds (7).",
            "/// (7)",
            "#[cfg(test)]\nmod tests {\n    // (7)\n}",
            "// as in (7)",
        ] {
            let mut files = files(7);
            files.push(File::new("client/src/c.rs", text));
            assert_eq!(uncited(&files).len(), 1, "{text}");
        }
    }
}
