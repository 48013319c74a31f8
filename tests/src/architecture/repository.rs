//! Collects the text of the repository and asks cargo for its dependency trees.
//!
//! The one module here that reads files and runs a command.
#![allow(
    clippy::disallowed_methods,
    reason = "collects the files that the rules judge"
)]

use std::path::{Path, PathBuf};
use std::process::Command;

use thiserror::Error;

use super::File;

/// Directories that hold no source: what was built, and the history.
const SKIPPED: [&str; 3] = ["target", ".git", "node_modules"];

/// Why the repository could not be collected.
#[derive(Debug, Error)]
pub enum CollectError {
    /// A file or directory could not be read.
    #[error("{path} could not be read: {source}")]
    Unreadable {
        /// The file or directory.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// cargo could not be started or failed.
    #[error("`cargo {arguments}` failed: {said}")]
    Cargo {
        /// The arguments it was given.
        arguments: String,
        /// What the system or cargo said.
        said: String,
    },
}

/// The root of the repository: the directory above this crate.
pub fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().unwrap_or(here).to_path_buf()
}

/// Every file of the repository, in the order of their paths; one that is not UTF-8 comes without its text.
///
/// # Errors
/// A directory or file that cannot be read.
pub fn files() -> Result<Vec<File>, CollectError> {
    let root = root();
    let mut found = Vec::new();
    let mut waiting = vec![root.clone()];
    while let Some(directory) = waiting.pop() {
        for path in entries(&directory)? {
            let name = path
                .file_name()
                .and_then(|name| name.to_str())
                .unwrap_or_default();
            if path.is_symlink() || SKIPPED.contains(&name) {
                continue;
            }
            if path.is_dir() {
                waiting.push(path);
            } else {
                let text = text_of(&path)?;
                let inner = path.strip_prefix(&root).unwrap_or(&path);
                found.push(File {
                    path: inner.to_string_lossy().replace('\\', "/"),
                    text,
                });
            }
        }
    }
    found.sort_by(|a, b| a.path.cmp(&b.path));
    Ok(found)
}

/// The paths in a directory.
fn entries(directory: &Path) -> Result<Vec<PathBuf>, CollectError> {
    let unreadable = |source| CollectError::Unreadable {
        path: directory.to_path_buf(),
        source,
    };
    let listing = std::fs::read_dir(directory).map_err(unreadable)?;
    listing
        .map(|entry| entry.map(|entry| entry.path()).map_err(unreadable))
        .collect()
}

/// The text of a file; empty if it is none.
fn text_of(path: &Path) -> Result<String, CollectError> {
    let bytes = std::fs::read(path).map_err(|source| CollectError::Unreadable {
        path: path.to_path_buf(),
        source,
    })?;
    Ok(String::from_utf8(bytes).unwrap_or_default())
}

/// What `cargo tree` says of one crate of the workspace, built for this machine.
///
/// # Errors
/// cargo cannot be started, or fails: for one, if a dependency was never downloaded.
pub fn tree(package: &str, options: &[&str]) -> Result<String, CollectError> {
    let arguments = [
        &[
            "tree",
            "--offline",
            "--locked",
            "--prefix",
            "none",
            "-p",
            package,
        ],
        options,
    ]
    .concat();
    let failed = |said: String| CollectError::Cargo {
        arguments: arguments.join(" "),
        said,
    };
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo)
        .args(&arguments)
        .current_dir(root())
        .output()
        .map_err(|error| failed(error.to_string()))?;
    if !output.status.success() {
        return Err(failed(String::from_utf8_lossy(&output.stderr).into_owned()));
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}
