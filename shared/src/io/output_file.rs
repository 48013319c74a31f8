//! A file that a run writes as it goes, such as a record. One writer has it at a time, and it takes the place of nothing but an
//! older one of its kind.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Error, ErrorKind, Read};
use std::path::Path;

/// More bytes than any kind needs to be known by.
const HEAD_MAX: u64 = 64;

/// Creates the file, or empties an older one that begins as this kind does: `is_of_kind` is given its first bytes, 64 at the most.
/// What is no file, such as a pipe, is taken as it is.
///
/// # Errors
/// It cannot be written, somebody writes it already, or it holds something else.
pub fn create(path: &Path, is_of_kind: impl Fn(&[u8]) -> bool) -> io::Result<File> {
    let file = claim(path, is_of_kind)?;
    empty(&file)?;
    Ok(file)
}

/// Takes away what the file holds. A pipe or a device holds nothing.
///
/// # Errors
/// The system refuses that.
pub fn empty(file: &File) -> io::Result<()> {
    if file.metadata()?.is_file() {
        file.set_len(0)?;
    }
    Ok(())
}

/// The same, but what the file holds stays there for now.
///
/// # Errors
/// As [`create`].
pub fn claim(path: &Path, is_of_kind: impl Fn(&[u8]) -> bool) -> io::Result<File> {
    let mut options = OpenOptions::new();
    let file = options
        .write(true)
        .create(true)
        .truncate(false)
        .open(path)?;
    if !file.metadata()?.is_file() {
        return Ok(file);
    }
    // held until the file is closed; a file system that knows no locks lets everybody write
    if let Err(TryLockError::WouldBlock) = file.try_lock() {
        let busy = "another run writes it, or another option of this one";
        return Err(Error::new(ErrorKind::ResourceBusy, busy));
    }
    let mut head = Vec::new();
    File::open(path)?.take(HEAD_MAX).read_to_end(&mut head)?;
    if !head.is_empty() && !is_of_kind(&head) {
        let other = "it holds something else, which would be lost";
        return Err(Error::new(ErrorKind::AlreadyExists, other));
    }
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;
    use std::io::Write;

    #[test]
    fn a_file_has_one_writer_at_a_time_and_replaces_its_kind_alone() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("a");
        let of_kind = |head: &[u8]| head.starts_with(b"kind");
        let mut first = create(&path, of_kind).unwrap();
        first.write_all(b"kind 1").unwrap();
        let busy = create(&path, of_kind).unwrap_err();
        assert!(busy.to_string().contains("another run"), "{busy}");
        assert_eq!(fs::read(&path).unwrap(), b"kind 1");
        drop(first);
        drop(claim(&path, of_kind).unwrap());
        assert_eq!(fs::read(&path).unwrap(), b"kind 1", "for now");
        drop(create(&path, of_kind).unwrap());
        assert_eq!(fs::read(&path).unwrap(), b"", "an older one of its kind");
        fs::write(&path, b"the only copy").unwrap();
        let other = create(&path, of_kind).unwrap_err();
        assert!(other.to_string().contains("would be lost"), "{other}");
        assert_eq!(fs::read(&path).unwrap(), b"the only copy");
        let full = create(Path::new("/dev/full"), of_kind);
        assert!(full.is_ok(), "no file");
        assert!(create(place.path(), of_kind).is_err(), "a folder");
    }
}
