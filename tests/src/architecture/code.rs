//! Rust source seen by the rules: comments and literals blanked, test modules cut out, names and lines found.
//!
//! A rule must not trip over a word in a comment or a string. This is no parser: it knows tokens and brackets
//! only, and every blanked character leaves a space, so line numbers stay those of the file.

/// Source text with the content of comments and literals replaced by spaces, line by line as in the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Code(String);

/// The number of bytes of a char or string literal or a comment that `rest` starts with, if it does.
fn opaque_len(rest: &str, after_name: bool) -> Option<usize> {
    if rest.starts_with("//") {
        return Some(rest.find('\n').unwrap_or(rest.len()));
    }
    if rest.starts_with("/*") {
        return Some(block_comment_len(rest));
    }
    if rest.starts_with('\'') {
        return char_len(rest);
    }
    if rest.starts_with('"') {
        return Some(escaped_len(rest, '"'));
    }
    // a prefix starts a literal only if it does not end a name: `bar"x"` has none
    let hashed = ["br", "cr", "r"]
        .iter()
        .find_map(|prefix| rest.strip_prefix(prefix));
    let raw = hashed.filter(|_| !after_name).and_then(raw_len);
    raw.map(|len| len + rest.len() - hashed.map_or(0, str::len))
}

/// The length of the block comment at the start of `rest`, nested ones included.
fn block_comment_len(rest: &str) -> usize {
    let mut depth = 0_usize;
    let mut skip = false;
    for (at, pair) in rest.as_bytes().windows(2).enumerate() {
        match pair {
            _ if skip => skip = false,
            b"/*" => (depth, skip) = (depth + 1, true),
            b"*/" if depth == 1 => return at + 2,
            b"*/" => (depth, skip) = (depth.saturating_sub(1), true),
            _ => {}
        }
    }
    rest.len()
}

/// The length of the char literal at the start of `rest`; none for a lifetime.
fn char_len(rest: &str) -> Option<usize> {
    let mut chars = rest.char_indices().skip(1);
    let (_, first) = chars.next()?;
    let (end, second) = chars.next()?;
    match first {
        '\\' => Some(escaped_len(rest, '\'')),
        _ if second == '\'' => Some(end + 1),
        _ => None,
    }
}

/// The length of a literal that ends with `quote`, where a backslash hides the next character.
fn escaped_len(rest: &str, quote: char) -> usize {
    let mut hidden = false;
    for (at, c) in rest.char_indices().skip(1) {
        match c {
            _ if hidden => hidden = false,
            '\\' => hidden = true,
            _ if c == quote => return at + c.len_utf8(),
            _ => {}
        }
    }
    rest.len()
}

/// The length of `#…"…"#…` after the prefix of a raw string; none if it is a raw name.
fn raw_len(tail: &str) -> Option<usize> {
    let body = tail.trim_start_matches('#');
    let hashes = tail.len() - body.len();
    let content = body.strip_prefix('"')?;
    let end = format!("\"{}", "#".repeat(hashes));
    Some(
        content
            .find(&end)
            .map_or(tail.len(), |at| hashes + 1 + at + end.len()),
    )
}

/// Whether a character can be part of a name.
fn in_name(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// The line (the first is 1) of the byte `at`.
fn line_of(text: &str, at: usize) -> usize {
    1 + text.bytes().take(at).filter(|byte| *byte == b'\n').count()
}

/// The length up to and including the bracket that closes the first `open` in `text`.
fn bracketed_len(text: &str, open: char, close: char) -> Option<usize> {
    let mut depth = 0_usize;
    for (at, c) in text.char_indices() {
        if c == open {
            depth += 1;
        } else if c == close {
            depth = depth.saturating_sub(1);
            if depth == 0 {
                return Some(at + c.len_utf8());
            }
        }
    }
    None
}

impl Code {
    /// The code in a file's text.
    pub fn of(text: &str) -> Self {
        let mut code = String::with_capacity(text.len());
        let mut rest = text;
        while let Some(c) = rest.chars().next() {
            let after_name = code.chars().next_back().is_some_and(in_name);
            let opaque = opaque_len(rest, after_name);
            let (head, tail) = rest
                .split_at_checked(opaque.unwrap_or(c.len_utf8()))
                .unwrap_or((rest, ""));
            if opaque.is_some() {
                code.extend(head.chars().map(|c| if c == '\n' { '\n' } else { ' ' }));
            } else {
                code.push_str(head);
            }
            rest = tail;
        }
        Self(code)
    }

    /// The code without the items marked `#[cfg(test)]`.
    pub fn without_tests(&self) -> Self {
        let mut kept = String::with_capacity(self.0.len());
        let mut rest = self.0.as_str();
        while let Some((before, item)) = rest
            .find("#[cfg(test)]")
            .and_then(|at| rest.split_at_checked(at))
        {
            kept.push_str(before);
            let body = item.find(['{', ';']).map(|at| item.split_at(at));
            let len = match body {
                Some((head, tail)) if tail.starts_with('{') => {
                    head.len() + bracketed_len(tail, '{', '}').unwrap_or(tail.len())
                }
                Some((head, _)) => head.len() + 1,
                None => item.len(),
            };
            let (cut, tail) = item.split_at_checked(len).unwrap_or((item, ""));
            kept.extend(cut.chars().filter(|c| *c == '\n'));
            rest = tail;
        }
        kept.push_str(rest);
        Self(kept)
    }

    /// The lines on which `name` stands. A name that ends in a letter must end there: `env::` is found in
    /// `std::env::var`, `tokio` is not found in `tokio_util`; a `*` at its end stands for any letters.
    pub fn lines_naming(&self, name: &str) -> Vec<usize> {
        let (stem, open) = name
            .strip_suffix('*')
            .map_or((name, false), |stem| (stem, true));
        let bounded = stem.chars().next_back().is_some_and(in_name) && !open;
        let stands = |at: usize| {
            let before = self.0.get(..at).and_then(|head| head.chars().next_back());
            let after = self
                .0
                .get(at + stem.len()..)
                .and_then(|tail| tail.chars().next());
            !(before.is_some_and(in_name) || bounded && after.is_some_and(in_name))
        };
        let found = self
            .0
            .match_indices(stem)
            .map(|(at, _)| at)
            .filter(|at| stands(*at));
        found.map(|at| line_of(&self.0, at)).collect()
    }

    /// The attributes, each with its line and its text from `#` to `]`.
    pub fn attributes(&self) -> Vec<(usize, &str)> {
        let attribute = |at: usize| {
            let tail = self.0.get(at..)?;
            let list = tail.trim_start_matches(['#', '!']);
            let len = list
                .starts_with('[')
                .then(|| bracketed_len(list, '[', ']'))??;
            Some((
                line_of(&self.0, at),
                tail.get(..tail.len() - list.len() + len)?,
            ))
        };
        self.0
            .match_indices('#')
            .filter_map(|(at, _)| attribute(at))
            .collect()
    }

    /// The code as text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is left of a text, with runs of spaces made one.
    fn left(text: &str) -> String {
        Code::of(text)
            .as_str()
            .split_whitespace()
            .collect::<Vec<_>>()
            .join(" ")
    }

    #[test]
    fn comments_and_literals_are_blanked_and_lines_stay() {
        let text = "let a = 1; // one\n/* two\n /* three */ */ let b = \"four \\\" five\";\n";
        assert_eq!(left(text), "let a = 1; let b = ;");
        assert_eq!(
            Code::of(text).as_str().lines().count(),
            text.lines().count()
        );
    }

    #[test]
    fn every_kind_of_literal_ends_where_it_ends() {
        assert_eq!(
            left(r##"f(r#"a " b"#); f(r"c\"); f(br"e"); f('f'); f('\''); f('"')"##),
            "f( ); f( ); f( ); f( ); f( ); f( )"
        );
        assert_eq!(
            left("fn f<'a>(x: &'a str, r#type: u8) {}"),
            "fn f<'a>(x: &'a str, r#type: u8) {}"
        );
        assert_eq!(left("let open = \"no end"), "let open =");
    }

    #[test]
    fn code_after_a_comment_or_string_is_still_seen() {
        let code = Code::of("/* quiet */ Instant::now(); let s = \"x\"; env::var(s)");
        assert_eq!(code.lines_naming("Instant"), [1]);
        assert_eq!(code.lines_naming("env::"), [1]);
    }

    #[test]
    fn names_match_whole_names_only() {
        let code = Code::of("ring::digest();\nspring::x();\nlet ring_of = tokio_like;\nAtomicU64");
        assert_eq!(code.lines_naming("ring::"), [1]);
        assert!(code.lines_naming("tokio").is_empty());
        assert_eq!(code.lines_naming("Atomic*"), [4]);
    }

    #[test]
    fn test_modules_are_cut_out_and_what_follows_stays() {
        let text = "fn a() {}\n#[cfg(test)]\nmod tests { fn b() { c() } }\nfn d() {}\n#[cfg(test)]\nmod e;\nfn f() {}";
        let code = Code::of(text).without_tests();
        assert!(code.lines_naming("c").is_empty());
        assert!(code.lines_naming("e").is_empty());
        assert_eq!(code.lines_naming("d"), [4]);
        assert_eq!(code.lines_naming("f"), [7]);
    }

    #[test]
    fn attributes_are_found_with_their_lines_over_several_lines() {
        let text =
            "#![allow(x)]\n\n#[expect(\n    y,\n    reason = \"because [of] this\"\n)]\nfn f() {}";
        let code = Code::of(text);
        let lines: Vec<_> = code.attributes().iter().map(|(line, _)| *line).collect();
        assert_eq!(lines, [1, 3]);
        assert!(
            code.attributes()
                .iter()
                .any(|(_, text)| text.contains("reason"))
        );
    }
}
