//! `mmt identity`: what it prints and refuses, and that nothing but a new pairing string shows a secret.

use std::os::unix::fs::PermissionsExt;
use std::process::Output;

use serde_json::Value;
use tempfile::TempDir;

use super::{document, start};

fn identity(home: &TempDir, arguments: &[&str]) -> Output {
    let all = [&["identity"], arguments].concat();
    super::mmt(home, &all).output().unwrap()
}

/// What it prints on stdout; it has succeeded.
fn done(home: &TempDir, arguments: &[&str]) -> String {
    let output = identity(home, arguments);
    let text = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{text}");
    String::from_utf8(output.stdout).unwrap()
}

/// What it says on stderr; it has refused.
fn refused(home: &TempDir, arguments: &[&str]) -> String {
    let output = identity(home, arguments);
    assert_eq!(output.status.code(), Some(2));
    assert!(output.stdout.is_empty());
    String::from_utf8(output.stderr).unwrap()
}

/// A home in which a slave has been started once, and the pairing string that it printed.
fn home() -> (TempDir, String) {
    let home = tempfile::tempdir().unwrap();
    let listen = ["slave", "--listen", "127.0.0.1:0"];
    let (_slave, pairing) = start(super::mmt(&home, &listen));
    (home, pairing)
}

fn token(pairing: &str) -> &str {
    pairing.trim_end().rsplit_once("token=").unwrap().1
}

#[test]
fn tokens_are_listed_made_replaced_and_revoked() {
    let (home, first) = home();
    let (slave, _) = first.rsplit_once("token=").unwrap();
    let anew = done(&home, &["rotate"]);
    // the same slave at the same place
    assert!(anew.starts_with(slave), "{anew}");
    assert_ne!(token(&anew), token(&first));
    let role = ["rotate", "--name", "alice", "--role", "observer"];
    let elsewhere = [&role[..], &["--address", "robot:4433"]].concat();
    let alice = done(&home, &elsewhere);
    assert!(alice.starts_with("mmt://robot:4433?pin="), "{alice}");
    let listed = done(&home, &["list"]);
    let rows: Vec<Vec<&str>> = listed
        .lines()
        .skip(4)
        .map(|line| line.split_whitespace().take(2).collect())
        .collect();
    assert_eq!(rows, [["operator", "operator"], ["alice", "observer"]]);
    let list = identity(&home, &["list", "--json"]);
    let list = document(&list);
    assert!(slave.contains(list["pin"].as_str().unwrap()));
    let made = list["tokens"][1]["created"].as_str().unwrap();
    assert!(made.starts_with("20") && made.ends_with('Z'), "{made}");
    for secret in [&first, &anew, &alice].map(|of| token(of)) {
        assert!(!listed.contains(secret) && !list.to_string().contains(secret));
    }
    let again = identity(&home, &["rotate", "--name", "alice", "--json"]);
    let again = document(&again);
    assert_eq!(
        (&again["role"], &again["replaced"]),
        (&"observer".into(), &true.into())
    );
    let pairing = again["pairing"].as_str().unwrap();
    assert!(pairing.starts_with(slave) && token(pairing) != token(&alice));
    let gone = document(&identity(&home, &["revoke", "alice", "--json"]));
    assert_eq!(gone["tokens"].as_array().map(Vec::len), Some(1), "{gone}");
    assert!(done(&home, &["revoke", "operator"]).is_empty());
    let nobody = identity(&home, &["list"]);
    let warned = String::from_utf8(nobody.stderr).unwrap();
    assert!(warned.contains("mmt identity rotate"), "{warned}");
}

#[test]
fn what_keeps_an_identity_is_for_its_owner_alone() {
    let (home, _) = home();
    done(&home, &["rotate"]);
    let kept = home.path().join("mmt");
    let mode = |path| std::fs::metadata(path).unwrap().permissions().mode() & 0o777;
    assert_eq!(mode(kept.clone()), 0o700);
    let files: Vec<_> = std::fs::read_dir(kept)
        .unwrap()
        .map(Result::unwrap)
        .collect();
    assert_eq!(files.len(), 2, "identity and address: {files:?}");
    for file in files {
        assert_eq!(mode(file.path()), 0o600, "{file:?}");
    }
}

#[test]
fn wrong_input_is_refused_with_what_to_do_and_changes_nothing() {
    let nowhere = tempfile::tempdir().unwrap();
    for arguments in [&["list"][..], &["rotate"], &["revoke", "a"]] {
        let text = refused(&nowhere, arguments);
        assert!(
            text.contains("mmt slave") && text.contains("--identity"),
            "{text}"
        );
    }
    let (home, _) = home();
    let before = document(&identity(&home, &["list", "--json"]));
    for (arguments, parts) in [
        (&["revoke", "bob"][..], ["bob", "its tokens are: operator"]),
        (&["rotate", "--name", "a b"], ["--name", "1 to 32 letters"]),
        (&["rotate", "--role", "king"], ["--role", "observer"]),
        (
            &["rotate", "--address", "robot"],
            ["--address", "HOST:PORT"],
        ),
    ] {
        let text = refused(&home, arguments);
        assert!(parts.iter().all(|part| text.contains(part)), "{text}");
    }
    // where the slave is nobody knows: an identity of before it was kept
    std::fs::remove_file(home.path().join("mmt/address")).unwrap();
    let text = refused(&home, &["rotate"]);
    assert!(text.contains("--address HOST:PORT"), "{text}");
    assert_eq!(document(&identity(&home, &["list", "--json"])), before);
}

#[test]
fn a_slave_without_a_token_of_an_operator_states_what_makes_one() {
    let (home, _) = home();
    done(&home, &["revoke", "operator"]);
    let listen = ["slave", "--listen", "127.0.0.1:0"];
    let output = super::mmt(&home, &listen).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(text.contains("mmt identity rotate"), "{text}");
    let anew = done(&home, &["rotate", "--json"]);
    let anew: Value = serde_json::from_str(&anew).unwrap();
    assert_eq!(anew["replaced"], false);
    let (_slave, pairing) = start(super::mmt(&home, &listen));
    assert_eq!(token(&pairing), token(anew["pairing"].as_str().unwrap()));
}
