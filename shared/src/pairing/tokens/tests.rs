//! What a list of tokens reads, writes and finds.

use super::*;

const ONE: Token = Token::new([1; 32]);
const OTHER: Token = Token::new([0xab; 32]);

fn name(text: &str) -> TokenName {
    text.parse().unwrap()
}

fn at(unix_s: u64) -> Created {
    Created::at(unix_s)
}

#[test]
fn tokens_read_back_as_they_were_written() {
    let mut tokens = Tokens::first(ONE, at(0));
    let role = Some(Role::Observer);
    assert_eq!(
        tokens.put(&name("a.B_9-"), role, at(9), OTHER),
        Ok(false),
        "a new one"
    );
    let text = format!("A preamble.\n{}-----BEGIN", tokens.reveal());
    assert_eq!(Tokens::read(&text), Ok(tokens));
    assert_eq!(Tokens::read("no line of one"), Ok(Tokens::default()));
}

#[test]
fn a_line_of_before_tokens_had_names_is_the_operators() {
    let tokens = Tokens::read(&format!("token: {}\n", ONE.reveal())).unwrap();
    let only = tokens.of_operator().unwrap();
    assert_eq!(
        (only.name.as_str(), only.role),
        ("operator", Role::Operator)
    );
    assert!(only.created.is_none() && only.token == ONE);
    // and keeps that it has no moment once it is written anew
    assert_eq!(Tokens::read(&tokens.reveal()), Ok(tokens));
}

#[test]
fn a_line_that_is_no_token_is_named_and_none_of_its_words_is_repeated() {
    let digits = OTHER.reveal().to_string();
    let words = format!("abab observer 2026-11-23T09:16:00Z {digits}");
    for (line, part) in [
        (String::new(), "NAME ROLE"),
        (format!("a {digits}"), "NAME ROLE"),
        (words.replace("abab ", "ab/ab "), "name in line 2"),
        (words.replace("observer", "ababab"), "role in line 2"),
        (words.replace("T09", " 09"), "NAME ROLE"),
        (words.replace("T09", "t09"), "moment in line 2"),
        (words.replace("abababab", "abababax"), "hexadecimal"),
        (digits[1..].to_owned(), "63 characters"),
        (format!("{words}\ntoken: {words}"), "line 3"),
    ] {
        let error = Tokens::read(&format!("first\ntoken: {line}")).unwrap_err();
        let text = error.to_string();
        assert!(text.contains(part), "{part}: {text}");
        assert!(!text.contains("abab"), "{text}");
    }
    let line = |n: usize| format!("token: n{n} operator - {digits}\n");
    let full: String = (0..TOKENS_MAX).map(line).collect();
    let mut full = Tokens::read(&full).unwrap();
    let more = full.put(&name("more"), None, at(0), ONE);
    assert_eq!(more, Err(TokensError::Full));
    assert_eq!(full.put(&name("n63"), None, at(0), ONE), Ok(true));
}

#[test]
fn a_token_that_takes_anothers_place_keeps_its_name_and_its_role_and_the_old_one_is_nobodys() {
    let mut tokens = Tokens::first(ONE, at(0));
    let alice = name("alice");
    tokens
        .put(&alice, Some(Role::Observer), at(1), OTHER)
        .unwrap();
    let newest = Token::new([3; 32]);
    assert_eq!(tokens.put(&alice, None, at(2), newest), Ok(true));
    assert!(tokens.find(&OTHER).is_none());
    let found = tokens.find(&newest).unwrap();
    assert_eq!((&found.name, found.role), (&alice, Role::Observer));
    assert_eq!(found.created, Some(at(2)));
    assert_eq!(tokens.find(&ONE).unwrap().name, TokenName::first());
    assert_eq!(tokens.remove(&alice).unwrap().token, newest);
    assert!(tokens.remove(&alice).is_none() && tokens.find(&newest).is_none());
}

#[test]
fn the_slaves_own_string_has_an_operators_token_or_there_is_none() {
    let line = |name: &str, role: &str| format!("token: {name} {role} - {}\n", ONE.reveal());
    for (lines, own) in [
        (
            vec![("alice", "operator"), ("operator", "operator")],
            "operator",
        ),
        (vec![("alice", "operator"), ("bob", "operator")], "alice"),
        (vec![("operator", "observer"), ("bob", "operator")], "bob"),
        (vec![("eve", "observer")], "none"),
    ] {
        let text: String = lines.iter().map(|(name, role)| line(name, role)).collect();
        let tokens = Tokens::read(&text).unwrap();
        let found = tokens.of_operator().map_or("none", |of| of.name.as_str());
        assert_eq!(found, own, "{text}");
    }
}

#[test]
fn a_moment_is_that_of_the_calendar() {
    for (unix_s, text) in [
        (0, "1970-01-01T00:00:00Z"),
        (951_782_400, "2000-02-29T00:00:00Z"),
        (1_709_251_199, "2024-02-29T23:59:59Z"),
        (1_709_251_200, "2024-03-01T00:00:00Z"),
        (1_735_689_599, "2024-12-31T23:59:59Z"),
        (4_107_542_400, "2100-03-01T00:00:00Z"),
    ] {
        assert_eq!(at(unix_s).to_string(), text);
        assert_eq!(Created::read(text), Some(at(unix_s)));
    }
}

#[test]
fn a_name_can_be_no_token() {
    for wrong in ["", "a b", "a/b", "é", &"a".repeat(33), "a\n"] {
        assert_eq!(wrong.parse::<TokenName>(), Err(TokenNameError), "{wrong}");
    }
    assert!("a".repeat(32).parse::<TokenName>().is_ok());
}
