//! Where a slave keeps its identity: one file, written whole or not at all, readable by its owner alone,
//! and never used once others could read it.

mod change;
pub(super) mod kept;
#[cfg(test)]
mod tests;
mod token_list;

use std::ffi::OsString;
use std::fs::{DirBuilder, File, Metadata};
use std::io::{self, Read, Write};
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use super::identity::{GenerateError, Identity, ParseError};
use crate::pairing::TokensError;

use kept::{Kept, Seen};

pub use change::{Changed, advertise, advertised, revoke, rotate};
pub use token_list::{Granted, TokenList};

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
    /// There is none to be changed.
    #[error(
        "there is no identity in {directory}: `mmt slave` makes one when it first starts; if it is elsewhere, give its \
         directory with --identity DIR"
    )]
    None {
        /// Where it was looked for.
        directory: PathBuf,
    },
    /// A change that its tokens do not take.
    #[error("{path}: {source}")]
    Unchanged {
        /// The file.
        path: PathBuf,
        /// Why.
        source: TokensError,
    },
    /// No token has this name.
    #[error("{path} has no token of the name {name}; its tokens are: {known}")]
    NoSuchToken {
        /// The file.
        path: PathBuf,
        /// The name.
        name: String,
        /// The names that there are.
        known: String,
    },
}

/// An identity as it was found.
struct Found {
    identity: Identity,
    text: String,
    metadata: Metadata,
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
        return Ok(found.identity);
    }
    let (_, text) = Identity::generate()?;
    create(directory, &path, &text)?;
    // Read back what is there: another process may have been first, and then its identity counts.
    let found = load(&path)?;
    let found = found.ok_or_else(|| file_error("read", &path, io::ErrorKind::NotFound.into()))?;
    Ok(found.identity)
}

/// The identity kept in `directory`, and the path of its file.
///
/// # Errors
/// There is none, or [`load_or_create`] would refuse it.
pub fn load_existing(directory: &Path) -> Result<(Identity, PathBuf), IdentityError> {
    let path = directory.join(FILE_NAME);
    let found = load(&path)?.ok_or_else(|| IdentityError::None {
        directory: directory.to_owned(),
    })?;
    Ok((found.identity, path))
}

/// XDG base directory specification: a relative path counts as none.
fn state_directory(state: Option<OsString>, home: Option<OsString>) -> Option<PathBuf> {
    let absolute = |path: Option<OsString>| path.map(PathBuf::from).filter(|p| p.is_absolute());
    let state = absolute(state).or_else(|| Some(absolute(home)?.join(".local/state")))?;
    Some(state.join("mmt"))
}

/// `None` if there is no file.
fn load(path: &Path) -> Result<Option<Found>, IdentityError> {
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
    })?;
    let (path, seen) = (path.to_owned(), Seen::of(&metadata));
    Ok(Some(Found {
        identity: identity.kept_in(Kept { path, seen }),
        text,
        metadata,
    }))
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
