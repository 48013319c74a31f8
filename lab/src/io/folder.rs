//! A folder that keeps files whole: each is written beside its place and then moved there.

use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Write as _};
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use sha2::{Digest, Sha256};

use crate::digest::hex;

/// A folder and what was kept in it.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    kept: Mutex<BTreeMap<String, String>>,
}

impl Folder {
    /// The folder at `path`, made if it is not there.
    ///
    /// # Errors
    /// When it cannot be made.
    pub fn open(path: &Path) -> io::Result<Self> {
        fs::create_dir_all(path)?;
        Ok(Self {
            path: path.to_owned(),
            kept: Mutex::default(),
        })
    }

    /// Where it is.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Keeps a file. What was there under that name stays until the new one is complete.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn keep(&self, name: &str, bytes: &[u8]) -> io::Result<()> {
        let path = self.path.join(name);
        if let Some(parent) = path.parent() {
            fs::create_dir_all(parent)?;
        }
        write_whole(&path, bytes)?;
        let digest = hex(&Sha256::digest(bytes));
        if let Ok(mut kept) = self.kept.lock() {
            kept.insert(name.to_owned(), digest);
        }
        Ok(())
    }

    /// Every file kept so far, with the SHA-256 of what is in it.
    #[must_use]
    pub fn kept(&self) -> BTreeMap<String, String> {
        self.kept
            .lock()
            .map(|kept| kept.clone())
            .unwrap_or_default()
    }
}

/// Writes beside the place and moves there: who reads finds the old file or the new one, never a part.
pub(super) fn write_whole(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let folder = path.parent().unwrap_or(Path::new(""));
    // as any file: who may read it is the system's choice
    let readable = fs::Permissions::from_mode(0o666);
    let mut beside = tempfile::Builder::new()
        .prefix(".mmt-")
        .suffix(".part")
        .permissions(readable)
        .tempfile_in(folder)?;
    beside.write_all(bytes)?;
    beside.persist(path)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_kept_whole_under_its_name_and_its_digest_is_known() {
        let place = tempfile::tempdir().unwrap();
        let folder = Folder::open(&place.path().join("new/figures")).unwrap();
        folder.keep("samples/a.csv", b"abc").unwrap();
        folder.keep("samples/a.csv", b"abcd").unwrap();
        assert_eq!(
            fs::read(folder.path().join("samples/a.csv")).unwrap(),
            b"abcd"
        );
        assert_eq!(
            fs::read_dir(folder.path().join("samples")).unwrap().count(),
            1
        );
        let kept = folder.kept();
        assert!(
            kept["samples/a.csv"].starts_with("88d4266fd4e6338d"),
            "{kept:?}"
        );
    }

    #[test]
    fn a_folder_that_cannot_be_is_an_error() {
        let place = tempfile::tempdir().unwrap();
        let file = place.path().join("file");
        fs::write(&file, b"").unwrap();
        assert!(Folder::open(&file.join("under")).is_err());
    }
}
