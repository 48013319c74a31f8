//! What is created, found again and refused.

use std::fs;
use std::os::unix::fs::PermissionsExt;

use super::*;

fn message(directory: &Path) -> String {
    load_or_create(directory).unwrap_err().to_string()
}

fn set_mode(path: &Path, mode: u32) {
    fs::set_permissions(path, fs::Permissions::from_mode(mode)).unwrap();
}

#[test]
fn an_identity_is_created_once_and_found_again() {
    let home = tempfile::tempdir().unwrap();
    let directory = home.path().join("a/b/mmt");
    let first = load_or_create(&directory).unwrap();
    let second = load_or_create(&directory).unwrap();
    assert_eq!(first.pin(), second.pin());
    assert_eq!(first.tokens(), second.tokens());
}

#[test]
fn only_the_owner_can_read_it_and_nothing_else_is_left_behind() {
    let home = tempfile::tempdir().unwrap();
    let directory = home.path().join("mmt");
    load_or_create(&directory).unwrap();
    let mode = |path: &Path| fs::metadata(path).unwrap().mode() & 0o777;
    assert_eq!(mode(&directory), 0o700);
    assert_eq!(mode(&directory.join(FILE_NAME)), 0o600);
    assert_eq!(fs::read_dir(&directory).unwrap().count(), 1);
}

#[test]
fn processes_that_create_it_at_once_agree() {
    let home = tempfile::tempdir().unwrap();
    let path = home.path().join(FILE_NAME);
    let (winner, text) = Identity::generate().unwrap();
    create(home.path(), &path, &text).unwrap();
    let (_, late) = Identity::generate().unwrap();
    create(home.path(), &path, &late).unwrap();
    let found = load(&path).unwrap().unwrap().identity;
    assert_eq!(found.pin(), winner.pin());
}

#[test]
fn an_identity_that_others_can_read_is_refused_with_the_remedy() {
    let home = tempfile::tempdir().unwrap();
    load_or_create(home.path()).unwrap();
    for mode in [0o644, 0o640, 0o604, 0o602, 0o700] {
        set_mode(&home.path().join(FILE_NAME), mode);
        let text = message(home.path());
        assert!(text.contains(&format!("{mode:04o}")), "{text}");
        assert!(text.contains("chmod 600"), "{text}");
    }
    set_mode(&home.path().join(FILE_NAME), 0o400);
    assert!(load_or_create(home.path()).is_ok());
}

#[test]
fn what_is_no_identity_is_refused_by_path_and_left_alone() {
    let home = tempfile::tempdir().unwrap();
    let path = home.path().join(FILE_NAME);
    for content in ["", "token: 12", &"x".repeat(20_000), "\u{0}"] {
        fs::write(&path, content).unwrap();
        set_mode(&path, 0o600);
        assert!(message(home.path()).contains(FILE_NAME));
        assert_eq!(fs::read_to_string(&path).unwrap(), content);
    }
}

#[test]
fn a_directory_that_cannot_be_made_is_named_with_the_remedy() {
    let home = tempfile::tempdir().unwrap();
    let file = home.path().join("file");
    fs::write(&file, "").unwrap();
    let text = message(&file.join("mmt"));
    assert!(
        text.contains("file/mmt") && text.contains("--identity"),
        "{text}"
    );
}

#[test]
fn the_default_directory_follows_the_xdg_specification() {
    let directory = |state: Option<&str>, home: Option<&str>| {
        state_directory(state.map(OsString::from), home.map(OsString::from))
    };
    assert_eq!(directory(Some("/s"), Some("/h")), Some("/s/mmt".into()));
    assert_eq!(
        directory(Some("s"), Some("/h")),
        Some("/h/.local/state/mmt".into())
    );
    assert_eq!(
        directory(None, Some("/h")),
        Some("/h/.local/state/mmt".into())
    );
    assert_eq!(directory(Some(""), None), None);
    assert_eq!(directory(None, Some("h")), None);
}
