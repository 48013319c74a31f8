//! The file with the secret of a session: a master that was killed in it resumes at once, when it is started again.
//!
//! It is locked as long as its master lives, so a second master on this host is another operator. It is readable by its
//! owner alone.

use std::fs::{DirBuilder, File, OpenOptions};
use std::io::{self, Read, Seek, Write};
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt};
use std::path::Path;

use mmt_shared::pairing::{SECRET_BYTES, Token};

/// The secret of a session of this host, for as long as the session lives.
#[derive(Debug)]
pub struct ResumeFile {
    file: File,
    secret: Option<Token>,
}

impl ResumeFile {
    /// Opens the file of a slave, with the directory if there is none; none if another master on this host has it.
    ///
    /// # Errors
    /// The file system refuses.
    pub fn open(path: &Path) -> io::Result<Option<Self>> {
        if let Some(directory) = path.parent() {
            DirBuilder::new()
                .recursive(true)
                .mode(0o700)
                .create(directory)?;
        }
        let mut options = OpenOptions::new();
        let options = options.read(true).write(true).create(true).mode(0o600);
        let mut file = options.truncate(false).open(path)?;
        if file.try_lock().is_err() {
            return Ok(None);
        }
        let mut text = String::new();
        // a file that somebody broke holds no secret
        let _ = (&mut file)
            .take(2 * SECRET_BYTES as u64)
            .read_to_string(&mut text);
        let secret = text.parse().ok();
        Ok(Some(Self { file, secret }))
    }

    /// The secret of a session that did not end as it should.
    pub(super) fn secret(&self) -> Option<Token> {
        self.secret
    }

    /// Keeps the secret of the session that begins.
    pub(super) fn keep(&self, secret: &Token) {
        let kept = self.write(&secret.reveal().to_string());
        if let Err(error) = kept {
            tracing::warn!(%error, "a master that is killed will not resume at once: its secret was not written");
        }
    }

    /// The session has ended as it should.
    pub(super) fn forget(&self) {
        let _ = self.write("");
    }

    fn write(&self, text: &str) -> io::Result<()> {
        let mut file = &self.file;
        file.set_len(0)?;
        file.rewind()?;
        file.write_all(text.as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::PermissionsExt;

    #[test]
    fn the_secret_outlives_a_master_and_is_for_one_at_a_time_and_for_its_owner() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("new/resume");
        let secret = Token::new([7; 32]);
        let first = ResumeFile::open(&path).unwrap().unwrap();
        assert!(first.secret().is_none());
        first.keep(&secret);
        assert!(ResumeFile::open(&path).unwrap().is_none(), "it lives");
        drop(first);
        let again = ResumeFile::open(&path).unwrap().unwrap();
        assert!(again.secret() == Some(secret));
        let mode = std::fs::metadata(&path).unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o600);
        again.forget();
        drop(again);
        std::fs::write(&path, "no secret").unwrap();
        let broken = ResumeFile::open(&path).unwrap().unwrap();
        assert!(broken.secret().is_none());
    }
}
