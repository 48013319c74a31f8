//! Where a slave keeps its identity: one file, created whole or not at all, readable by its owner alone,
//! and never used once others could read it.

use std::ffi::OsString;
use std::fs::{DirBuilder, File};
use std::io::{self, Read, Write};
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use super::identity::{GenerateError, Identity, ParseError};

/// Name of the file in its directory.
pub const FILE_NAME: &str = "identity.pem";
/// No identity is longer; a longer file is refused without reading it.
const BYTES_MAX: u64 = 16 * 1024;

/// Why there is no identity.
#[derive(Debug, thiserror::Error)]
pub enum IdentityError {
    /// Nowhere to keep it.
    #[error(
        "no directory to keep the identity in: neither XDG_STATE_HOME nor HOME is an absolute path; \
         give one with --identity DIR"
    )]
    NoDirectory,
    /// The file system refused.
    #[error("cannot {action} {path}: {source}; check it, or give another with --identity DIR")]
    File {
        /// What was tried.
        action: &'static str,
        /// On what.
        path: PathBuf,
        /// What came of it.
        source: io::Error,
    },
    /// Others can read the secret, or put another in its place.
    #[error(
        "{path} has permissions {mode:04o}, so others may know the secret: if you trust it still, \
         `chmod 600 {path}`; if not, delete it and pair again with the new one"
    )]
    Exposed {
        /// The file.
        path: PathBuf,
        /// Its permission bits.
        mode: u32,
    },
    /// Longer than any identity.
    #[error("{path} is no identity: it has {bytes} bytes, more than {BYTES_MAX}; move it away")]
    TooLong {
        /// The file.
        path: PathBuf,
        /// Its length.
        bytes: u64,
    },
    /// Not a file that this program wrote.
    #[error("{path} is no identity: {source}; delete it and pair again with the new one")]
    Malformed {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: ParseError,
    },
    /// No identity could be made.
    #[error(transparent)]
    Generate(#[from] GenerateError),
}

/// The directory used when none is given: `$XDG_STATE_HOME/mmt`, or else `~/.local/state/mmt`.
///
/// # Errors
/// Neither `XDG_STATE_HOME` nor `HOME` is an absolute path.
pub fn default_directory() -> Result<PathBuf, IdentityError> {
    state_directory(std::env::var_os("XDG_STATE_HOME"), std::env::var_os("HOME"))
        .ok_or(IdentityError::NoDirectory)
}

/// The identity kept in `directory`, created (with the directory, mode 0700) if there is none.
///
/// # Errors
/// The file cannot be read or written, others can read it, or it is no identity; the message names what to
/// do.
pub fn load_or_create(directory: &Path) -> Result<Identity, IdentityError> {
    let path = directory.join(FILE_NAME);
    if let Some(found) = load(&path)? {
        return Ok(found);
    }
    let (_, text) = Identity::generate()?;
    create(directory, &path, &text)?;
    // Read back what is there: another process may have been first, and then its identity counts.
    load(&path)?.ok_or_else(|| file_error("read", &path, io::ErrorKind::NotFound.into()))
}

/// XDG base directory specification: a relative path counts as none.
fn state_directory(state: Option<OsString>, home: Option<OsString>) -> Option<PathBuf> {
    let absolute = |path: Option<OsString>| path.map(PathBuf::from).filter(|p| p.is_absolute());
    let state = absolute(state).or_else(|| Some(absolute(home)?.join(".local/state")))?;
    Some(state.join("mmt"))
}

/// `None` if there is no file.
fn load(path: &Path) -> Result<Option<Identity>, IdentityError> {
    let file = match File::open(path) {
        Ok(file) => file,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(file_error("open", path, error)),
    };
    // Of the open file, not of the path: nobody can swap it in between.
    let metadata = file
        .metadata()
        .map_err(|error| file_error("inspect", path, error))?;
    let (mode, bytes) = (metadata.mode() & 0o7777, metadata.len());
    let owned = path.to_owned();
    if !metadata.is_file() {
        let error = io::Error::new(io::ErrorKind::InvalidInput, "it is not a regular file");
        return Err(file_error("use", path, error));
    }
    if mode & 0o177 != 0 {
        return Err(IdentityError::Exposed { path: owned, mode });
    }
    if bytes > BYTES_MAX {
        return Err(IdentityError::TooLong { path: owned, bytes });
    }
    let mut text = String::new();
    file.take(BYTES_MAX)
        .read_to_string(&mut text)
        .map_err(|error| file_error("read", path, error))?;
    let identity = Identity::parse(&text).map_err(|source| IdentityError::Malformed {
        path: owned,
        source,
    });
    identity.map(Some)
}

/// Writes `text` beside `path` and renames it to there: whole or not at all, and never over another's.
fn create(directory: &Path, path: &Path, text: &str) -> Result<(), IdentityError> {
    DirBuilder::new()
        .recursive(true)
        .mode(0o700)
        .create(directory)
        .map_err(|error| file_error("create", directory, error))?;
    match write(directory, path, text) {
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => Ok(()),
        other => other.map_err(|error| file_error("create", path, error)),
    }
}

fn write(directory: &Path, path: &Path, text: &str) -> io::Result<()> {
    // its mode is 0600
    let mut file = NamedTempFile::new_in(directory)?;
    file.write_all(text.as_bytes())?;
    file.as_file().sync_all()?;
    file.persist_noclobber(path)?;
    Ok(())
}

fn file_error(action: &'static str, path: &Path, source: io::Error) -> IdentityError {
    let path = path.to_owned();
    IdentityError::File {
        action,
        path,
        source,
    }
}

#[cfg(test)]
mod tests {
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
        assert_eq!(first.token(), second.token());
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
        assert_eq!(load(&path).unwrap().unwrap().pin(), winner.pin());
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
}
